# SPDX-License-Identifier: MIT
"""Images whose every pixel is known in closed form."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from agreement import ROUNDING, assert_agree, assert_mean
from numpy.typing import NDArray
from rendering import ESTIMATORS, batches, list_at_most, rendered
from scene_builders import Vector, box, lambert, rectangle, stare, triangles_of

from fragtracer.scene import (
    Ambient,
    Camera,
    DirectionalLight,
    Disk,
    Light,
    Material,
    Plane,
    Rectangle,
    Scene,
    Sphere,
    SpotLight,
)
from fragtracer.scene.reflectance import METAL_F0

# One albedo and one emission per channel: a run tests three furnaces.
ALBEDOS = ((0.3, 0.5, 0.8), (0.6, 0.9, 0.1))
EMISSION = (0.1, 1.0, 10.0)
RADIANCE = (3.0, 1.0, 0.2)
AMBIENT = (0.5, 1.0, 4.0)
INSIDE = Camera((0.3, 0.2, 0.9), (-0.2, -0.1, -1.0), fov_degrees=60.0)


def furnace(albedo: Vector, kind: str = "rectangles") -> Scene:
    """A closed box and a sphere in it, all of one glowing material. Disks are larger than the box's walls, their rims
    outside of it."""
    return Scene(
        INSIDE,
        {"glow": lambert(albedo, EMISSION)},
        spheres=[Sphere((-0.1, -0.2, -0.3), 0.3, "glow")],
        **of_kind(box("glow"), kind),
    )


def of_kind(walls: list[Rectangle], kind: str, *, inside: bool = False) -> dict[str, Any]:
    """Rectangles, the two triangles of each, or disks around or ``inside`` each, as arguments of a scene."""
    if kind == "rectangles":
        return {kind: walls}
    if kind == "triangles":
        return {kind: [half for wall in walls for half in triangles_of(wall)]}
    return {kind: [disk_of(wall, inside=inside) for wall in walls]}


def disk_of(wall: Rectangle, *, inside: bool = False) -> Disk:
    """The largest disk within a rectangle, or one beyond its corners; its front the same."""
    u, v = np.asarray(wall.edge_u), np.asarray(wall.edge_v)
    diameter = min(np.linalg.norm(u), np.linalg.norm(v)) if inside else 1.01 * np.linalg.norm(u + v)
    return Disk(tuple(np.add(wall.corner, (u + v) / 2)), tuple(np.cross(u, v)), float(diameter) / 2, wall.material)


def after_bounces(albedo: Vector, bounces: int) -> NDArray[np.float64]:
    """Radiance in the furnace: each bounce returns the albedo's share of the one before."""
    return np.sum([np.multiply(EMISSION, np.power(albedo, k)) for k in range(bounces + 1)], axis=0)


def each_kind_with(*estimators: str) -> list[tuple[Vector, str, str]]:
    """Flat shapes of each kind with each of the estimators, under the albedos in turns."""
    pairs = itertools.product(estimators, ("rectangles", "triangles", "disks"))
    return [(albedo, *pair) for albedo, pair in zip(itertools.cycle(ALBEDOS), pairs, strict=False)]


def glowing_shapes_apart(albedo: Vector, kind: str = "rectangles") -> Scene:
    """A floor, a wall and two spheres that emit (1 - albedo) of the ambient light: all that is seen from anywhere is as
    bright. None touches another, since light sampling has no finite variance where two emitters meet."""
    walls = [
        rectangle((0.0, -1.0, 0.75), (0.0, 0.0, 4.5), (6.0, 0.0, 0.0), "ghost"),
        rectangle((0.0, 1.0, -1.8), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0), "ghost"),
    ]
    return Scene(
        Camera((0.4, 0.6, 4.0), (0.0, -0.2, 0.0), fov_degrees=50.0),
        {"ghost": lambert(albedo, np.multiply(AMBIENT, np.subtract(1, albedo)))},
        spheres=[Sphere((-0.7, -0.15, 0.0), 0.7, "ghost"), Sphere((0.8, -0.35, 0.2), 0.5, "ghost")],
        ambient=Ambient(AMBIENT),
        **of_kind(walls, kind, inside=True),
    )


@pytest.mark.parametrize(("albedo", "estimator", "kind"), each_kind_with("bsdf", "mis"))
def test_closed_furnace(ctx, albedo, estimator, kind):
    """Le / (1 - albedo), with russian roulette and as many bounces as it takes; once with adaptive sampling."""
    spp, adaptive = (256, "on") if (estimator, kind) == ("mis", "rectangles") else (128, "off")
    image = rendered(ctx, furnace(albedo, kind), spp, bounces=1000, estimator=estimator, adaptive=adaptive)
    assert_mean(image, np.divide(EMISSION, np.subtract(1, albedo)), 0.01)


@pytest.mark.parametrize("bounces", [1, 5])
def test_furnace_after_few_bounces(ctx, bounces):
    image = rendered(ctx, furnace(ALBEDOS[0]), 1024, bounces=bounces, estimator="mis", russian_roulette=False)
    assert_mean(image, after_bounces(ALBEDOS[0], bounces), 0.0005)


@pytest.mark.parametrize("bounces", [2, 5])
def test_light_sampling_after_few_bounces(ctx, bounces):
    """It brings what BSDF sampling brings, which the other furnaces hold to its value."""
    settings: dict[str, Any] = {"bounces": bounces, "russian_roulette": False}
    scene = glowing_shapes_apart(ALBEDOS[0])
    nee, bsdf = (batches(ctx, scene, 256, range(4), estimator=name, **settings) for name in ("nee", "bsdf"))
    assert_agree(nee, bsdf, 0.01)


@pytest.mark.parametrize("bounces", [2, 4, 6])
def test_roulette_keeps_the_mean_at_every_vertex(ctx, bounces):
    """Of paths cut off after some bounces, resolved to 0.1 %: what the roulette does at a vertex shows in all later
    ones."""
    albedo = (0.9, 0.93, 0.96)
    image = rendered(ctx, furnace(albedo), 128, (128, 96), bounces=bounces, estimator="bsdf", russian_roulette_depth=1)
    assert_mean(image, after_bounces(albedo, bounces), 0.001)


@pytest.mark.parametrize("most_listed", [0, 64], ids=["bvh", "list"])
@pytest.mark.parametrize("kind", ["rectangles", "triangles", "disks"])
@pytest.mark.parametrize("bounces", [0, 1, 4, 50])
def test_furnace_has_no_noise_without_light_sampling(ctx, monkeypatch, bounces, kind, most_listed):
    """Every path of cosine sampling brings the same: any leak or wrong weight shows in a single one."""
    list_at_most(monkeypatch, most_listed)
    image = rendered(
        ctx, furnace(ALBEDOS[1], kind), 16, bounces=bounces, estimator="bsdf", russian_roulette=False, shared=True
    )
    np.testing.assert_allclose(image, np.broadcast_to(after_bounces(ALBEDOS[1], bounces), image.shape), rtol=ROUNDING)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("albedo", ALBEDOS)
def test_convex_object_in_ambient_light(ctx, albedo, estimator):
    """It reflects its albedo's share of the ambient light, at every point, however many bounces."""
    ambient = (0.5, 1.0, 4.0)
    scene = Scene(
        Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=20.0),
        {"ball": lambert(albedo)},
        spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "ball")],
        ambient=Ambient(ambient),
    )
    image = rendered(ctx, scene, 64, bounces=3, estimator=estimator, shared=True)
    expected = np.broadcast_to(np.multiply(albedo, ambient), image.shape)
    np.testing.assert_allclose(image, expected, rtol=ROUNDING)


@pytest.mark.parametrize(
    ("albedo", "estimator", "kind"), [*each_kind_with("nee", "mis"), (ALBEDOS[0], "bsdf", "rectangles")]
)
def test_objects_that_glow_enough_vanish_in_ambient_light(ctx, albedo, estimator, kind):
    """Light from emitters, from the ambient light and from bounces together."""
    spp = 512 if estimator == "nee" else 128
    image = rendered(ctx, glowing_shapes_apart(albedo, kind), spp, bounces=1000, estimator=estimator)
    assert_mean(image, AMBIENT, 0.003)


@pytest.mark.parametrize("degrees", [0.0, 45.0, 80.0])
@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("kind", ["colour", "metal"])
def test_mirror_scales_the_emitter_it_shows(ctx, kind, estimator, degrees):
    """Without noise: F(theta) Le with Schlick's F, which is F0 seen straight on."""
    f0 = {"colour": (0.9, 0.5, 0.1), "metal": METAL_F0["gold"]}[kind]
    material = {
        "colour": Material(albedo=f0, metallic=1.0, roughness=0.0),
        "metal": Material(metal="gold", roughness=0),
    }
    tilt = np.radians(degrees)
    away = (float(np.sin(tilt)), float(np.cos(tilt)), 0.0)
    screen = rectangle((-5 * away[0], 5 * away[1], 0.0), (6.0, 0.0, 0.0), (0.0, 0.0, 6.0), "lamp")
    if degrees > 60:
        screen = rectangle((-5 * away[0], 5 * away[1], 0.0), (0.0, 6.0, 0.0), (0.0, 0.0, 6.0), "lamp")
    scene = Scene(
        stare((0.0, 0.0, 0.0), tuple(3 * x for x in away)),
        {"mirror": material[kind], "lamp": lambert(0.0, RADIANCE)},
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "mirror")],
        rectangles=[screen],
    )
    expected = np.multiply(RADIANCE, np.add(f0, np.subtract(1, f0) * (1 - np.cos(tilt)) ** 5))
    for bounces in (1, 4):
        image = rendered(ctx, scene, 8, bounces=bounces, estimator=estimator, shared=True)
        np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=ROUNDING)


LOOKING = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=10.0)
SCREEN = rectangle((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0), "lamp")
SEEN = {
    "sphere": {"spheres": [Sphere((0.0, 0.0, 0.0), 1.0, "lamp")]},
    "pane": {"spheres": [Sphere((0.0, 0.0, 0.0), 1.0, "pane")]},  # into which nothing is emitted
    "glass": {"spheres": [Sphere((0.0, 0.0, 0.0), 1.0, "glass")]},
    "rectangle": {"rectangles": [SCREEN]},
    "triangles": {"triangles": triangles_of(SCREEN)},
    "disk": {"disks": [disk_of(SCREEN)]},
    "ambient": {"ambient": Ambient(RADIANCE)},
    "light": {"lights": [Light((0.0, 0.0, 0.0), 1.0, radiance=RADIANCE)]},
    "power": {"lights": [Light((0.0, 0.0, 0.0), 0.7, power=tuple(np.multiply(RADIANCE, 4 * np.pi**2 * 0.49)))]},
}


LAMPS = {
    "lamp": lambert(0.0, RADIANCE),
    "pane": Material(model="rough-thin-dielectric", emission=RADIANCE),
    "glass": Material(model="dielectric", emission=RADIANCE),
}


@pytest.mark.parametrize(
    ("estimator", "name"),
    [
        *itertools.product(ESTIMATORS, [name for name in SEEN if name not in ("pane", "glass")]),
        *(("mis", name) for name in ("pane", "glass")),
    ],
)
def test_emission_is_seen_exactly(ctx, estimator, name):
    lamp = name if name in LAMPS else "lamp"
    scene = Scene(LOOKING, {lamp: LAMPS[lamp]}, **SEEN[name])
    for bounces in (0, 3):
        image = rendered(ctx, scene, 5, bounces=bounces, estimator=estimator, shared=True)
        np.testing.assert_array_equal(image, np.broadcast_to(np.float32(RADIANCE), image.shape))


back = replace(SCREEN, edge_u=SCREEN.edge_v, edge_v=SCREEN.edge_u)
UNSEEN = {
    "nothing": {},
    "the back of a rectangle": {"rectangles": [back]},
    "the back of triangles": {"triangles": triangles_of(back)},
    "the back of a disk": {"disks": [disk_of(back)]},
    "the inside of a sphere": {"spheres": [Sphere((0.0, 0.0, 3.0), 1.0, "lamp")]},
    "the inside of a light": {"lights": [Light((0.0, 0.0, 3.0), 1.0, radiance=RADIANCE)]},
    "a point light": {"lights": [Light((0.0, 0.0, 0.0), power=10.0)]},
    "a spot light": {"spot_lights": [SpotLight((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 10.0)]},
    "a directional light": {"directional_lights": [DirectionalLight((0.0, 0.0, 1.0), 10.0)]},
    "something black": {"spheres": [Sphere((0.0, 0.0, 0.0), 1.0, "black")], "ambient": Ambient(0.0)},
}


@pytest.mark.parametrize(
    ("estimator", "name"),
    [
        *(("mis", name) for name in UNSEEN),
        *itertools.product(("nee", "bsdf"), ("the back of a rectangle", "the inside of a sphere", "a point light")),
    ],
)
def test_black_where_there_is_nothing(ctx, name, estimator):
    scene = Scene(LOOKING, {"lamp": lambert(0.0, RADIANCE), "black": lambert(0.0)}, **UNSEEN[name])
    assert not rendered(ctx, scene, 16, bounces=5, estimator=estimator).any()
