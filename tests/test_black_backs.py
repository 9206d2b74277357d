# SPDX-License-Identifier: MIT
"""Surfaces that scatter nothing from behind."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest
from agreement import assert_agree
from rendering import batches, rendered
from scene_builders import lambert, rectangle

from fragtracer.renderer import Renderer
from fragtracer.scene import Ambient, Camera, Disk, Light, Material, Scene, Sphere

SURFACES = [
    lambert(0.7),
    Material(roughness=0.3),
    Material(metal="gold", roughness=0.0),
    Material(model="eon", roughness=0.5),
    Material(model="conductor", metal="copper"),
    Material(model="plastic"),
    Material(model="rough-plastic", roughness=0.4),
]
SIZE = (len(SURFACES), 1)
MIDDLE = (len(SURFACES) - 1) / 2
AHEAD, BEHIND = (Camera((MIDDLE, 0.0, z), (MIDDLE, 0.0, 0.0), fov_degrees=1.8) for z in (30.0, -30.0))


def row(black: bool, camera: Camera = AHEAD) -> Scene:
    """A square of each surface side by side in ambient light, seen from the front or from behind."""
    materials = {str(i): replace(material, black_back=black) for i, material in enumerate(SURFACES)}
    squares = [rectangle((float(i), 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), str(i)) for i in range(len(SURFACES))]
    return Scene(camera, materials, rectangles=squares, ambient=Ambient((1.0, 1.0, 1.0)))


@pytest.mark.parametrize("integrator", ["path", "split-sum"])
def test_the_back_alone_is_black(ctx: moderngl.Context, integrator: str) -> None:
    for camera, is_black in ((AHEAD, False), (BEHIND, True)):
        shown, other = (
            rendered(ctx, row(black, camera), 16, SIZE, integrator=integrator, bounces=2) for black in (True, False)
        )
        assert (other > 0.05).any(axis=-1).all()
        assert (shown == 0).all() if is_black else np.array_equal(shown, other)


def test_layers(ctx: moderngl.Context) -> None:
    """What a denoiser is told, too."""
    for camera, is_black in ((AHEAD, False), (BEHIND, True)):
        with Renderer(row(True, camera), SIZE, context=ctx) as renderer:
            renderer.sample(4)
            for name in ("albedo", "denoising_albedo"):
                assert (renderer.aov(name) == 0).all() == is_black, name


def test_it_shades_and_emits(ctx: moderngl.Context) -> None:
    """It is there for rays from behind: it takes away the light of half of all directions, and its front emits."""
    materials = {"back": lambert(0.0, 2.0), "floor": lambert(0.5)}
    materials["back"] = replace(materials["back"], black_back=True)
    floor = rectangle((0.0, -1.0, 0.0), (0.0, 0.0, 2.0), (2.0, 0.0, 0.0), "floor")
    camera = Camera((0.0, -0.5, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), fov_degrees=1.0)
    seen = {}
    for y in (1.0, -1.0):
        roof = Disk((0.0, 0.0, 0.0), (0.0, y, 0.0), 1e4, "back")
        scene = Scene(camera, materials, rectangles=[floor], disks=[roof], ambient=Ambient((1.0, 1.0, 1.0)))
        seen[y] = rendered(ctx, scene, 256, (4, 4), bounces=1)
    assert seen[1.0].max() < 1e-3
    np.testing.assert_allclose(seen[-1.0].mean(), 0.5 * 2.0, rtol=0.01)


def test_ways_to_sample_agree(ctx: moderngl.Context) -> None:
    """Light that a ring of gold with a black back throws onto a floor, from the camera and from the lights."""
    gold = Material(metal="gold", roughness=0.15, black_back=True)
    materials = {"gold": gold, "floor": lambert(0.6), "ball": replace(gold, roughness=0.3)}
    floor = rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 4.0), (4.0, 0.0, 0.0), "floor")
    walls = [
        rectangle((0.0, 0.5, -1.0), (2.0, 0.0, 0.0), (0.0, 1.0, 0.0), "gold"),
        rectangle((-1.0, 0.5, 0.0), (0.0, 0.0, 2.0), (0.0, 1.0, 0.0), "gold"),
    ]
    scene = Scene(
        Camera((1.0, 3.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=45.0),
        materials,
        rectangles=[floor, *walls],
        spheres=[Sphere((0.3, 0.2, 0.3), 0.2, "ball")],
        lights=[Light((1.5, 2.0, 1.5), 0.2, radiance=(30.0, 30.0, 30.0))],
    )
    plain = batches(ctx, scene, 256, range(8), (24, 24))
    assert_agree(batches(ctx, scene, 256, range(8, 16), (24, 24), light_tracing="on"), plain, 0.02)
    assert_agree(batches(ctx, scene, 256, range(16, 24), (24, 24), guiding="on"), plain, 0.02)


@pytest.mark.parametrize(
    "others", [{"model": "dielectric"}, {"diffuse_transmission": 0.5}, {"double_sided": False}], ids=str
)
def test_where_it_has_no_meaning(others: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="black_back must stay false; the back of this surface is"):
        Material(black_back=True, **others)
