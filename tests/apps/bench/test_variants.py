# SPDX-License-Identifier: MIT
"""Variants of the shaders count right, and change the picture only where they should."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.apps.bench.cases import case
from fragtracer.apps.bench.variants import (
    COUNT_WORK,
    NO_PATH_REGENERATION,
    NO_PATHS_BEFORE_VERTICES,
    ONE_BSDF_EVALUATION,
    Edit,
    edited_shaders,
)
from fragtracer.apps.bench.work import Work, count_work
from fragtracer.errors import ShaderError
from fragtracer.renderer import Renderer
from fragtracer.resources import folder
from fragtracer.scene import Camera, Light, Material, Plane, RenderSettings, Scene

SIZE = (24, 16)
SLOWER = {"none before vertices": NO_PATHS_BEFORE_VERTICES, "no regeneration": NO_PATH_REGENERATION}
OTHERS = {"count": COUNT_WORK, "one evaluation": ONE_BSDF_EVALUATION}


def _image(scene: Scene, edits: Sequence[Edit], **options: Any) -> NDArray[np.float32]:
    with edited_shaders(edits) as shaders, Renderer(scene, SIZE, shaders=shaders, **options) as renderer:
        return renderer.render(8)


@pytest.mark.parametrize(
    ("variant", "scene", "specialised"),
    [
        (variant, scene, (i + j) % 2 == 0)
        for i, variant in enumerate(OTHERS)
        for j, scene in enumerate(("three-spheres", "leaves", "sun-sky"))
    ],
)
def test_every_other_variant_compiles_and_draws(variant: str, scene: str, specialised: bool) -> None:
    image = _image(case(scene), OTHERS[variant], specialised=specialised)
    assert np.isfinite(image).all()
    assert image.mean() > 0


def _floor(bounces: int, light_samples: int = 1, albedo: float = 0.5) -> Scene:
    """Every camera ray meets a plane, nothing else is there but a point light above it."""
    return Scene(
        camera=Camera((0.0, 3.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), fov_degrees=40.0),
        materials={"floor": Material(albedo=albedo, specular=0.0)},
        planes=(Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor"),),
        lights=(Light((0.0, 2.0, 0.0), power=(100.0,) * 3),),
        render=RenderSettings(width=SIZE[0], height=SIZE[1], bounces=bounces, light_samples=light_samples),
    )


def test_work_of_a_floor_under_a_light_is_known() -> None:
    # A path meets the floor once, looks for the light from there, and what is scattered escapes.
    assert count_work(_floor(bounces=0)) == Work(1, 0, 0)
    assert count_work(_floor(bounces=5)) == Work(2, 1, 1)
    assert count_work(_floor(bounces=5, light_samples=3)) == Work(2, 3, 1)


def test_no_shadow_ray_where_nothing_is_scattered() -> None:
    assert count_work(_floor(bounces=5, albedo=0.0)).shadow_rays == 0


@pytest.mark.parametrize("variant", SLOWER)
@pytest.mark.parametrize("name", ["three-spheres", "cornell-box", "leaves", "glass", "sun-sky"])
def test_wherever_paths_begin_the_picture_is_the_same(name: str, variant: str) -> None:
    for specialised in (False, True) if name in ("three-spheres", "leaves") else (True,):
        image = _image(case(name), SLOWER[variant], specialised=specialised)
        np.testing.assert_array_equal(image, _unedited(name, specialised))


@cache
def _unedited(name: str, specialised: bool) -> NDArray[np.float32]:
    return _image(case(name), (), specialised=specialised)


def test_one_evaluation_is_the_default_for_a_single_light_sample_alone() -> None:
    scene = case("cornell-box")
    np.testing.assert_allclose(_image(scene, ONE_BSDF_EVALUATION), _image(scene, ()), rtol=1e-5)
    edited, default = _image(scene, ONE_BSDF_EVALUATION, light_samples=8), _image(scene, (), light_samples=8)
    assert not np.allclose(edited, default, rtol=0.01)


def test_shaders_that_have_changed_are_noticed() -> None:
    for text in ("no such text", "float"):
        with (
            pytest.raises(ShaderError, match=r"film/film.glsl has \d+ times"),
            edited_shaders([Edit("film/film.glsl", text, "")]),
        ):
            pass


def test_the_copy_goes_and_the_original_stays() -> None:
    original = Path(folder("shaders")) / "integrator" / "path.glsl"
    before = original.read_bytes()
    with edited_shaders(COUNT_WORK) as root:
        assert root is not None
        assert (root / "integrator" / "path.glsl").read_bytes() != before
    assert not root.exists()
    assert original.read_bytes() == before
