# SPDX-License-Identifier: MIT
"""Environments in Mitsuba: the same radiance from every direction."""

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from fragtracer.errors import FragtracerError
from fragtracer.reference.environment import map_rows
from fragtracer.reference.export import export_mitsuba
from fragtracer.reference.render import render_reference
from fragtracer.reference.translate import scene_tree, to_mitsuba
from fragtracer.scene import (
    Ambient,
    Camera,
    Environment,
    Light,
    Material,
    Panorama,
    RenderSettings,
    Scene,
    Sky,
    Sphere,
)
from fragtracer.scene.environment import lookup

PIXELS = np.random.default_rng(0).random((5, 8, 3)).astype(np.float32)
Background = Literal["environment", "prefiltered", "irradiance", "black"]
TURNED = Environment(image=Panorama(PIXELS), rotation_degrees=35.0, strength=2.0, tint=(1.0, 0.5, 0.25))


def test_every_direction_has_the_same_radiance(mi, tmp_path: Path) -> None:
    scene = Scene(environment=TURNED, ambient=Ambient(0.125))
    emitter = mi.load_dict(to_mitsuba(scene, tmp_path)["environment"])
    import drjit as dr

    directions = np.random.default_rng(1).normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    expected = lookup(PIXELS, directions @ TURNED.rotation) * TURNED.scale + 0.125
    si = dr.zeros(mi.SurfaceInteraction3f, len(directions))
    si.wi = mi.Vector3f(-directions.T)
    np.testing.assert_allclose(emitter.eval(si, True).numpy().T, expected, atol=1e-5)


def test_rows_for_mitsuba_interpolate_to_the_same_values() -> None:
    """Its rows lie at v = k / 2 h; ours at the odd k."""
    rows = map_rows(PIXELS)
    assert rows.shape == (11, 8, 3)
    np.testing.assert_array_equal(rows[1::2], PIXELS)
    np.testing.assert_allclose(rows[2], (PIXELS[0] + PIXELS[1]) / 2)
    np.testing.assert_array_equal(rows[[0, -1]], PIXELS[[0, -1]])


def test_sun_is_where_it_should_be(mi) -> None:
    """Its sphere fills the middle of a narrow view, with the radiance that it has here."""
    environment = Environment(sky=Sky(sun_elevation_degrees=30.0, sun_azimuth_degrees=110.0), rotation_degrees=20.0)
    sun = environment.sun
    assert sun is not None
    scene = Scene(Camera((0.0, 0.0, 0.0), sun.direction, fov_degrees=2.0), environment=environment)
    picture = render_reference(scene, (21, 21), 16)[0]
    # Its size is rounded, and its radiance makes up for that.
    sphere = to_mitsuba(scene)["sun"]
    rounded = (sphere["radius"] / np.linalg.norm(sphere["center"])) ** 2
    exact = sun.one_minus_cos * (2 - sun.one_minus_cos)
    np.testing.assert_allclose(picture[10, 10] * rounded / exact, sun.radiance, rtol=1e-3)
    seen = (picture[..., 0] > 0.5 * sun.radiance[0]).mean() * (2.0 * 60) ** 2  # square arc minutes
    assert seen == pytest.approx(np.pi * (0.2666 * 60) ** 2, rel=0.15)


def test_sun_lights_what_faces_it(mi) -> None:
    """By its radiance times π sin², although its cone is too narrow for Mitsuba's 1 - cos: the size is made to fit."""
    import drjit as dr

    environment = Environment(sky=Sky(sun_elevation_degrees=30.0))
    sun = environment.sun
    assert sun is not None
    world = mi.load_dict({"type": "scene", "sun": to_mitsuba(Scene(environment=environment))["sun"]})
    count = 1 << 18
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.n, si.t = mi.Normal3f(*sun.direction), mi.Float(1)
    si.sh_frame = mi.Frame3f(si.n)
    u = np.random.default_rng(1).random((2, count), dtype="f4")
    sample, weight = world.sample_emitter_direction(si, mi.Point2f(u), False)
    found = (weight * dr.dot(sample.d, si.n)).numpy().mean(axis=1, dtype=float)
    expected = np.array(sun.radiance) * np.pi * sun.one_minus_cos * (2 - sun.one_minus_cos)
    np.testing.assert_allclose(found, expected, rtol=2e-4)


def test_hiding_alone_cannot_be_said(tmp_path: Path) -> None:
    hidden = Environment(radiance=1.0, visible=False)
    for scene in (
        Scene(environment=hidden, lights=[Light((0.0, 3.0, 0.0), 0.5, power=1.0)]),
        Scene(environment=Environment(radiance=1.0, visible=False, background=1.0)),
    ):
        with pytest.raises(FragtracerError, match="cannot hide the environment alone"):
            scene_tree(scene, tmp_path)


def hides(tmp_path: Path, environment: Environment | None, background: Background, **rest: Any) -> bool:
    scene = Scene(environment=environment, render=RenderSettings(background=background), **rest)
    hidden = scene_tree(scene, tmp_path)["integrator"]["hide_emitters"]
    assert isinstance(hidden, bool)
    return hidden


def test_a_black_background_hides_the_environment(tmp_path: Path) -> None:
    """But not ambient light, nor the background of an environment that is hidden anyway."""
    seen, hidden = Environment(radiance=1.0), Environment(radiance=1.0, visible=False)
    assert not hides(tmp_path, seen, "environment")
    assert hides(tmp_path, seen, "black")
    assert hides(tmp_path, hidden, "black")
    assert hides(tmp_path, replace(seen, background=1.0), "black")
    assert not hides(tmp_path, None, "black", ambient=Ambient(1.0))
    for environment, ambient in ((seen, Ambient(1.0)), (replace(hidden, background=1.0), Ambient())):
        with pytest.raises(FragtracerError, match=r"cannot hide the environment alone.*render\.background"):
            hides(tmp_path, environment, "black", ambient=ambient)


@pytest.mark.parametrize("background", ["prefiltered", "irradiance"])
def test_backgrounds_of_the_split_sum_approximation_are_refused(tmp_path: Path, background: Background) -> None:
    with pytest.raises(
        FragtracerError, match=rf'render\.background = "{background}"; make it "environment" or "black"'
    ):
        hides(tmp_path, Environment(radiance=1.0), background)
    assert not hides(tmp_path, None, background)


def test_unlit_surfaces_are_seen_before_a_hidden_environment(tmp_path: Path) -> None:
    """They are emitters in Mitsuba; materials that nothing has are not."""
    hidden, sphere = Environment(radiance=1.0, visible=False), Sphere((0.0, 0.0, 0.0), 1.0, "shown")
    for material in (Material(unlit=True), Material(emission=1.0)):
        with pytest.raises(FragtracerError, match="cannot hide the environment alone"):
            hides(tmp_path, hidden, "environment", materials={"shown": material}, spheres=[sphere])
        assert hides(tmp_path, hidden, "environment", materials={"unused": material})


def test_exported_environment_is_opened(mi, tmp_path: Path) -> None:
    scene = Scene(Camera((0.0, 0.0, 0.0), (0.3, 0.2, -1.0)), environment=TURNED)
    export_mitsuba(scene, tmp_path)
    world = mi.load_file(str(tmp_path / "scene.xml"), parallel=False)
    expected = render_reference(scene, (16, 12), 64)[0]
    found = np.array(mi.render(world, spp=64))
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)
