# SPDX-License-Identifier: MIT
"""Surfaces that transmit light diffusely, in pictures: closed forms, and all ways to sample against each other."""

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from agreement import assert_agree
from mesh_shapes import field
from rendering import batches, rendered
from scene_builders import box, lambert, rectangle
from test_light_tracing import light_of

from fragtracer.renderer import Renderer
from fragtracer.scene import (
    Ambient,
    Camera,
    DirectionalLight,
    Geometry,
    Light,
    Material,
    Mesh,
    Part,
    Plane,
    RenderSettings,
    Scene,
    Sphere,
)

AHEAD = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=10.0)
SHEET = rectangle((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0), "paper")
ALBEDO, COLOR, FACTOR = (0.7, 0.5, 0.3), (0.2, 0.6, 0.9), 0.4
PAPER = Material(
    albedo=ALBEDO, specular=0.0, diffuse_transmission=FACTOR, diffuse_transmission_color=COLOR, roughness=0.4
)
REFLECTED, TRANSMITTED = (1 - FACTOR) * np.array(ALBEDO), FACTOR * np.array(COLOR)


def sheet(material: Material = PAPER, **lights: Any) -> Scene:
    """A square that the camera sees the front of."""
    return Scene(AHEAD, {"paper": material, "black": lambert(0.0)}, rectangles=[SHEET], **lights)


def lit_from(*directions: float) -> dict[str, Any]:
    """Directional lights along z."""
    return {"directional_lights": [DirectionalLight((0.0, 0.3, z), 2.0) for z in directions]}


@pytest.mark.parametrize("double_sided", [True, False])
def test_a_sheet_lit_from_both_sides(ctx: moderngl.Context, double_sided: bool) -> None:
    """E / pi times what it reflects of one light and transmits of the other; from behind it is not there if its back is
    culled, and shows what is beyond."""
    ahead, behind, ambient = np.array([1.0, 2.0, 3.0]), np.array([3.0, 1.0, 0.5]), 0.7
    lights = [DirectionalLight((0.0, 0.0, z), tuple(e)) for z, e in ((-1.0, ahead), (1.0, behind))]
    scene = sheet(replace(PAPER, double_sided=double_sided), directional_lights=lights)
    front = rendered(ctx, scene, 1024, (4, 4), bounces=1)
    expected = (ahead * REFLECTED + behind * TRANSMITTED) / np.pi
    np.testing.assert_allclose(front.mean((0, 1)), expected, rtol=0.01)
    scene = replace(scene, camera=replace(AHEAD, position=(0.0, 0.0, -3.0)), ambient=Ambient(ambient))
    back = rendered(ctx, scene, 1024, (4, 4), bounces=1)
    expected = (behind * REFLECTED + ahead * TRANSMITTED) / np.pi + ambient * (REFLECTED + TRANSMITTED)
    expected = expected if double_sided else np.full(3, ambient)
    np.testing.assert_allclose(back.mean((0, 1)), expected, rtol=0.01)


def test_a_sheet_in_ambient_light_by_light_samples(ctx: moderngl.Context) -> None:
    """From both sides."""
    image = rendered(ctx, sheet(ambient=Ambient(1.0)), 4096, (2, 2), bounces=1, estimator="nee")
    np.testing.assert_allclose(image.mean((0, 1)), REFLECTED + TRANSMITTED, rtol=0.02)


def test_a_furnace_of_white_paper(ctx: moderngl.Context) -> None:
    """A box in ambient light vanishes: all that is not reflected is transmitted."""
    white = replace(PAPER, albedo=(1.0, 1.0, 1.0), diffuse_transmission_color=(1.0, 1.0, 1.0))
    scene = Scene(AHEAD, {"paper": white}, rectangles=box("paper"), ambient=Ambient(1.0))
    image = rendered(ctx, scene, 16, (8, 8), bounces=1000, russian_roulette=False)
    np.testing.assert_allclose(image, 1.0, rtol=1e-4)


@pytest.mark.parametrize(
    "changed", [{"blend": "black", "blend_weight": 0.25}, {"alpha_mode": "blend", "opacity": 0.75}]
)
def test_paper_that_is_there_in_part(ctx: moderngl.Context, changed: dict[str, Any]) -> None:
    """Blended with black, or with holes, which show no directional light: three quarters of what it transmits."""
    scene = sheet(replace(PAPER, **changed), **lit_from(1.0))
    image = rendered(ctx, scene, 4096, (4, 4), bounces=1)
    np.testing.assert_allclose(image.mean((0, 1)), 0.75 * 2.0 / np.sqrt(1.09) / np.pi * TRANSMITTED, rtol=0.01)


def test_what_brushed_facets_reflect_stays(ctx: moderngl.Context) -> None:
    """Over a base that reflects nothing it is that of a material that transmits nothing."""
    black = Material(albedo=0.0, anisotropy=0.7)
    materials = (black, replace(black, diffuse_transmission=1.0))
    one, other = (rendered(ctx, sheet(m, **lit_from(-1.0)), 16, (8, 8), bounces=1) for m in materials)
    assert one.min() > 1e-3
    np.testing.assert_allclose(one, other, rtol=1e-5)


@pytest.mark.parametrize("height", [30.0, -30.0])
def test_no_light_leaks_where_normals_lean(ctx: moderngl.Context, height: float) -> None:
    """A flat wall that reflects nothing, with normals that lean far over, shows light from behind it alone."""
    points, triangles = field(24)
    lean = np.random.default_rng(1).normal((0.0, 0.7, 0.0), 1.0, points.shape)
    wall = Geometry(20 * points * (1, 0, 1), triangles, normals=lean)
    scene = Scene(
        Camera((0.0, 8.0, 6.0), (0.0, 0.0, 0.0)),
        {"paper": replace(PAPER, diffuse_transmission=1.0)},
        meshes=[Mesh([Part(wall, "paper")])],
        lights=[Light((3.0, height, 0.0), power=1e5)],
        render=RenderSettings(bounces=2),
    )
    assert (rendered(ctx, scene, 64).max() > 0) == (height < 0)


def test_what_is_transmitted_is_diffuse(ctx: moderngl.Context) -> None:
    """In layers of light; what facets reflect is not. The albedo counts both sides."""
    shiny = replace(PAPER, specular=1.0)
    expected = REFLECTED + TRANSMITTED + 0.04
    for z in (1.0, -1.0):
        with Renderer(sheet(shiny, **lit_from(z)), (8, 8), context=ctx, aovs=["diffuse"], bounces=1) as renderer:
            renderer.sample(16)
            image, diffuse, specular = renderer.image(), renderer.aov("diffuse"), renderer.aov("specular")
            if z > 0:
                np.testing.assert_allclose(renderer.aov("albedo")[4, 4], expected, rtol=1e-5)
        np.testing.assert_allclose(diffuse + specular, image, rtol=1e-5)
        assert diffuse.min() > 0
        assert specular.any() == (z < 0)


def screen() -> Scene:
    """Balls of metal and of glass throw the light of a lamp on a floor and on a sheet, which is seen from behind, and
    has a gloss of its own that throws some back."""
    materials = {
        "paper": replace(PAPER, albedo=(0.8, 0.7, 0.6), diffuse_transmission=0.6, specular=1.0),
        "floor": lambert((0.6, 0.5, 0.4)),
        "gold": Material(metal="gold", roughness=0.4),
        "glass": Material(model="dielectric", roughness=0.3),
    }
    return Scene(
        Camera((0.2, 1.0, 3.2), (0.0, 0.5, 0.0), fov_degrees=40.0),
        materials,
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")],
        rectangles=[rectangle((0.0, 0.6, 0.3), (1.6, 0.0, 0.4), (0.0, 1.2, 0.0), "paper")],
        spheres=[Sphere((-0.4, 0.7, -0.2), 0.25, "glass"), Sphere((0.4, 0.5, -0.5), 0.5, "gold")],
        lights=[Light((-2.5, 2.4, -1.5), 1.4, power=200.0)],
        render=RenderSettings(bounces=4),
    )


def test_ways_to_sample_agree(ctx: moderngl.Context) -> None:
    """Light sampling alone, and BSDF sampling alone, guided, with both together."""
    size, ways = (24, 16), ({"estimator": "nee"}, {"estimator": "bsdf", "guiding": "on"})
    plain = batches(ctx, screen(), 256, range(4), size)
    for way in ways:
        assert_agree(batches(ctx, screen(), 512, range(10, 14), size, **way), plain, 0.02)


def test_guiding_finds_light_behind_a_sheet(ctx: moderngl.Context) -> None:
    """Also of one that reflects nothing: the variance falls to less than two thirds (to a third with more samples)."""
    sheet_only = replace(PAPER, diffuse_transmission=1.0)
    scene = replace(screen(), materials=screen().materials | {"paper": sheet_only})
    one, other = (
        batches(ctx, scene, 64, range(4), (48, 32), guiding=guiding)[:, 8:23, 14:36] for guiding in ("off", "on")
    )
    assert other.var(axis=0).mean() < 0.67 * one.var(axis=0).mean()


def test_photons_bring_what_paths_leave_out(ctx: moderngl.Context) -> None:
    """A fifth of the light on the sheet."""
    by_paths, by_photons = light_of(ctx, screen(), 768, 4)
    assert_agree(by_photons, by_paths, 0.1, (2, 3))
