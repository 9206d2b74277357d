# SPDX-License-Identifier: MIT
"""Direct light on a matte floor, against the form factors of lights of every kind."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import pytest
from agreement import assert_mean
from numpy.typing import NDArray
from rendering import CHUNK, ESTIMATORS, Image, Planter, rendered
from scene_builders import Vector, lambert, rectangle, stare, triangles_of

from fragtracer.packing import pack
from fragtracer.scene import DirectionalLight, Disk, Light, Plane, Rectangle, Scene, Sphere, SpotLight

T = TypeVar("T")

# The floor is seen at the origin, from low above it so that no light is in the way.
FLOOR_ALBEDO = (0.2, 0.5, 0.9)
EYE = (0.0, 0.3, 6.0)
# Rays start a few 1e-5 m above the floor, so that it does not shade itself: that much nearer the light.
LIFT = 1e-4
RADIANCE = (3.0, 1.0, 0.2)


def floor_under(**lights: Any) -> Scene:
    materials = {"floor": lambert(FLOOR_ALBEDO), "lamp": lambert(0.0, RADIANCE), "black": lambert(0.0)}
    floor = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")
    return Scene(stare((0.0, 0.0, 0.0), EYE), materials, planes=[floor], **lights)


def seen(ctx, spp: int, estimator: str, **lights: Any) -> Image:
    """The floor under lights, by programs that all of these tests share."""
    return rendered(ctx, floor_under(**lights), spp, estimator=estimator, rays=CHUNK, shared=True)


def floor_radiance(irradiance: Any) -> NDArray[np.float64]:
    return np.multiply(FLOOR_ALBEDO, irradiance) / np.pi


def sphere_form(center: Vector, radius: float) -> float:
    """Irradiance at the origin, facing up, by a sphere of radiance 1 that lies above the horizon."""
    distance = float(np.linalg.norm(center))
    return float(np.pi * (radius / distance) ** 2 * center[1] / distance)


def polygon_form(vertices: Sequence[Vector]) -> float:
    """The same by a flat polygon (Lambert 1760): half the sum of its edges' angles, each times the
    height of its plane's normal."""
    total = 0.0
    for a, b in zip(vertices, (*vertices[1:], vertices[0]), strict=True):
        normal = np.cross(a, b)
        angle = np.arctan2(np.linalg.norm(normal), np.dot(a, b))
        total += angle * normal[1] / np.linalg.norm(normal)
    return abs(total) / 2


BALLS = (
    ((0.0, 1.0, 0.0), 0.5),
    ((0.0, 3.0, 0.0), 0.01),
    ((2.0, 1.0, 0.0), 0.6),
    ((0.0, 1.05, 0.0), 1.0),
    ((-40.0, 90.0, 0.0), 30.0),
)


def with_estimators(cases: Iterable[T], small: Callable[[T], bool]) -> list[tuple[str, T]]:
    """Each case with each estimator, but those with a small light not where it must be met by chance."""
    return [(e, case) for e in ESTIMATORS for case in cases if e != "bsdf" or not small(case)]


@pytest.mark.parametrize(("estimator", "ball"), with_estimators(BALLS, lambda ball: ball[1] < 0.1))
def test_floor_under_a_spherical_light(ctx, estimator, ball):
    form = sphere_form(*ball)
    image = seen(ctx, 512 if estimator == "bsdf" else 128, estimator, lights=[Light(*ball, radiance=RADIANCE)])
    assert_mean(image, floor_radiance(np.multiply(RADIANCE, form)), 0.02 if estimator == "bsdf" else 0.002, LIFT)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_floor_under_a_light_that_the_horizon_cuts(ctx, estimator):
    """A ball half of which is under the floor: the integral of the cosine over half a cone."""
    half_angle = np.arcsin(1 / 1.5)
    form = half_angle - np.sin(half_angle) * np.cos(half_angle)
    image = seen(ctx, 1024, estimator, lights=[Light((1.5, 0.0, 0.0), 1.0, radiance=RADIANCE)])
    assert_mean(image, floor_radiance(np.multiply(RADIANCE, form)), 0.005, LIFT)


@pytest.mark.parametrize(("estimator", "radius"), with_estimators((0.0, 1e-3, 0.1, 0.5, 0.9), lambda r: 0 < r < 0.1))
def test_power_does_not_depend_on_radius(ctx, estimator, radius):
    """A ball of power P above a floor at distance d gives it P / (4 pi d²), however large the ball."""
    power, height = (10.0, 20.0, 5.0), 1.2
    image = seen(ctx, 256, estimator, lights=[Light((0.0, height, 0.0), radius, power=power)])
    expected = floor_radiance(np.divide(power, 4 * np.pi * height**2))
    assert_mean(image, expected, 0.05 if estimator == "bsdf" and radius else 0.002, LIFT)


@pytest.mark.parametrize("position", [(0.0, 1.0, 0.0), (0.0, 30.0, 0.0), (-2.0, 1.0, 1.0)])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_floor_under_a_point_light(ctx, position, estimator):
    """Without noise: power / (4 pi d²) cos theta. No estimator can meet a point by chance, so all sample it."""
    power = (10.0, 20.0, 5.0)
    distance = np.linalg.norm(position)
    irradiance = np.multiply(power, position[1] / distance) / (4 * np.pi * distance**2)
    image = seen(ctx, 8, estimator, lights=[Light(position, power=power)])
    np.testing.assert_allclose(image, np.broadcast_to(floor_radiance(irradiance), image.shape), rtol=LIFT)


RECTANGLES = {
    "overhead": rectangle((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), "lamp"),
    "aside": rectangle((2.0, 1.5, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 2.0), "lamp"),
    "tilted": rectangle((-3.0, 1.5, -1.0), (1.0, 0.5, 0.0), (-0.5, 1.0, 1.5), "lamp"),
    "wall": rectangle((0.0, 1.2, -1.0), (1.8, 0.0, 0.0), (0.0, 2.0, 0.0), "lamp"),
    "sky": rectangle((0.0, 1.0, 0.0), (8.0, 0.0, 0.0), (0.0, 0.0, 8.0), "lamp"),
    "stamp": rectangle((0.0, 5.0, 1.0), (0.02, 0.0, 0.0), (0.0, 0.0, 0.02), "lamp"),
}


def corners(r: Rectangle) -> list[Vector]:
    a, u, v = (np.asarray(x) for x in (r.corner, r.edge_u, r.edge_v))
    return [tuple(a), tuple(a + u), tuple(a + u + v), tuple(a + v)]


def shape_of(estimator: str, name: str) -> str:
    """Rectangles and triangles in turns: each estimator has both, and each place has both where lights are sampled."""
    return ("rectangles", "triangles")[([*RECTANGLES].index(name) + (estimator == "mis")) % 2]


@pytest.mark.parametrize(
    ("estimator", "name", "shape"),
    [(*case, shape_of(*case)) for case in with_estimators(RECTANGLES, lambda name: name == "stamp")],
)
def test_floor_under_a_flat_light(ctx, estimator, name, shape):
    lamp = RECTANGLES[name]
    vertices, lamps = corners(lamp), {"rectangles": [lamp]}
    if shape == "triangles":
        vertices, lamps = vertices[:3], {"triangles": triangles_of(lamp)[:1]}
    form = polygon_form(vertices)
    image = seen(ctx, 2048 if estimator == "bsdf" and form < 0.1 else 256, estimator, **lamps)
    assert_mean(image, floor_radiance(np.multiply(RADIANCE, form)), 0.02 if estimator == "bsdf" else 0.01, LIFT)


def facing_disk(center: Vector, radius: float) -> Disk:
    """That looks at the origin."""
    return Disk(center, tuple(-x for x in center), radius, "lamp")


def parallel_disk(center: Vector, radius: float) -> Disk:
    """That looks straight down."""
    return Disk(center, (0.0, -2.0, 0.0), radius, "lamp")


def disk_form(disk: Disk) -> float:
    """Irradiance at the origin, facing up, by a disk of radiance 1 above the horizon: one that looks straight at it
    (the cosine over its cone), or straight down (Hottel: a differential area and a parallel disk off its axis)."""
    x, height, z = disk.center
    distance, radius = float(np.linalg.norm(disk.center)), disk.radius
    if abs(np.dot(disk.normal, disk.center)) > (1 - 1e-9) * distance * np.linalg.norm(disk.normal):
        return float(np.pi * radius**2 / (radius**2 + distance**2) * height / distance)
    off2 = x**2 + z**2
    root = np.sqrt((height**2 + off2 + radius**2) ** 2 - 4 * off2 * radius**2)
    return float(np.pi / 2 * (1 - (height**2 + off2 - radius**2) / root))


DISKS = {
    "overhead": parallel_disk((0.0, 1.0, 0.0), 0.5),
    "aside": parallel_disk((1.5, 1.2, -0.8), 0.7),
    "tilted": facing_disk((-1.0, 1.5, 0.5), 0.6),
    "sky": parallel_disk((0.0, 1.0, 0.0), 4.0),
    "stamp": facing_disk((0.0, 5.0, 1.0), 0.01),
}


@pytest.mark.parametrize(("estimator", "name"), with_estimators(DISKS, lambda name: name == "stamp"))
def test_floor_under_a_disk(ctx, estimator, name):
    image = seen(ctx, 256, estimator, disks=[DISKS[name]])
    expected = floor_radiance(np.multiply(RADIANCE, disk_form(DISKS[name])))
    assert_mean(image, expected, 0.02 if estimator == "bsdf" else 0.01, LIFT)


def test_the_two_forms_of_a_disk_agree_where_it_is_overhead():
    disk = DISKS["overhead"]
    straight = disk_form(disk)
    off = replace(disk, center=(1e-4, 1.0, 0.0))
    assert disk_form(off) == pytest.approx(straight, rel=1e-6)
    assert straight == pytest.approx(np.pi * 0.25 / 1.25)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_lamp_lights_only_what_is_before_it(ctx, estimator):
    """The floor under the back of a lamp, and the floor above the top of a sphere of light, stay black."""
    lamp = replace(RECTANGLES["overhead"], edge_u=(0.0, 0.0, 1.0), edge_v=(1.0, 0.0, 0.0))
    below = {"lights": [Light((0.0, -2.0, 0.0), 1.0, radiance=RADIANCE)]}
    for lights in ({"rectangles": [lamp]}, {"triangles": triangles_of(lamp)}, below):
        assert not seen(ctx, 64, estimator, **lights).any()


SPOTS = {
    "on its axis": SpotLight((0.0, 2.0, 0.0), (0.0, -3.0, 0.0), RADIANCE, 10.0, 30.0),
    "within the inner cone": SpotLight((1.0, 2.0, 0.0), (-0.7, -2.0, 0.1), RADIANCE, 25.0, 40.0),
    "between the cones": SpotLight((1.0, 2.0, 0.5), (0.1, -1.0, 0.1), RADIANCE, 10.0, 60.0),
    "no inner cone": SpotLight((-1.0, 1.0, 0.5), (0.5, -1.0, 0.0), RADIANCE, 0.0, 80.0),
    "beyond the outer cone": SpotLight((1.0, 2.0, 0.0), (1.0, -1.0, 0.0), RADIANCE, 10.0, 30.0),
    "almost a step": SpotLight((0.0, 3.0, 1.0), (0.0, -3.0, -0.9), RADIANCE, 29.999, 30.0),
    "facing away": SpotLight((0.0, 2.0, 0.0), (0.0, 1.0, 0.0), RADIANCE, 0.0, 90.0),
}


def spot_irradiance(spot: SpotLight) -> NDArray[np.float64]:
    """At the origin, facing up: KHR_lights_punctual in float64."""
    distance = np.linalg.norm(spot.position)
    cosine = -np.dot(spot.position, spot.direction) / distance / np.linalg.norm(spot.direction)
    inner, outer = np.cos(np.radians([spot.inner_degrees, spot.outer_degrees]))
    falloff = np.clip((cosine - outer) / (inner - outer), 0, 1) ** 2
    return np.multiply(spot.intensity, falloff * spot.position[1] / distance**3)


@pytest.mark.parametrize("name", SPOTS)
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_floor_under_a_spot_light(ctx, name, estimator):
    """Without noise, whatever the estimator: light that no ray can meet."""
    image = seen(ctx, 8, estimator, spot_lights=[SPOTS[name]])
    irradiance = spot_irradiance(SPOTS[name])
    assert (irradiance[0] > 0) == (name not in ("beyond the outer cone", "facing away"))
    np.testing.assert_allclose(image, np.broadcast_to(floor_radiance(irradiance), image.shape), rtol=5 * LIFT)


@pytest.mark.parametrize("direction", [(0.0, -1.0, 0.0), (3.0, -4.0, 0.0), (-1.0, -0.02, 1.0), (0.0, 1.0, 0.0)])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_floor_under_a_directional_light(ctx, direction, estimator):
    image = seen(ctx, 8, estimator, directional_lights=[DirectionalLight(direction, RADIANCE)])
    irradiance = np.multiply(RADIANCE, max(0.0, -direction[1] / np.linalg.norm(direction)))
    np.testing.assert_allclose(image, np.broadcast_to(floor_radiance(irradiance), image.shape), rtol=LIFT)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_lights_that_no_ray_meets_cast_shadows(ctx, estimator):
    """Of all that is before them, however far away, and of nothing beyond a spot."""
    spot, sun = SpotLight((0.0, 2.0, 0.0), (0.0, -1.0, 0.0), RADIANCE), DirectionalLight((0.0, -1.0, 0.0), RADIANCE)
    near, far = Sphere((0.0, 1.5, 0.0), 0.1, "black"), Sphere((0.0, 50.0, 0.0), 1.0, "black")
    for lights, blocker, is_dark in (
        ({"spot_lights": [spot]}, near, True),
        ({"spot_lights": [spot]}, far, False),
        ({"directional_lights": [sun]}, near, True),
        ({"directional_lights": [sun]}, far, True),
    ):
        assert seen(ctx, 8, estimator, **lights, spheres=[blocker]).any() != is_dark


def many_lights() -> tuple[Scene, NDArray[np.float64]]:
    """Eighty lights of all kinds whose powers are spread over a thousandfold, and the irradiance of all: more than are
    looked through one by one. None is as bright as the others together."""
    rng = np.random.default_rng(4)
    places = [(*rng.uniform(-2, 2, 1), *rng.uniform(1, 3, 1), *rng.uniform(-2, 2, 1)) for _ in range(60)]
    # Weak and strong ones side by side in their order, so that one light more or less makes a difference.
    powers = [tuple(10 ** rng.uniform(-1.5, 1.5) * rng.uniform(0.5, 1, 3)) for _ in places]
    points = [Light(place, power=power) for place, power in zip(places, powers, strict=True)]
    spots = [SPOTS[name] for name in ("on its axis", "within the inner cone", "between the cones", "no inner cone")]
    suns = [DirectionalLight((0.1 * i, -1.0, 0.0), np.multiply(RADIANCE, 0.1 * (i + 1))) for i in range(4)]
    disks = [Disk((6.0 * np.cos(i), 4.0, 6.0 * np.sin(i)), (0.0, -1.0, 0.0), 0.1 * (i + 1), "lamp") for i in range(6)]
    balls = [((5.0 * np.sin(i), 1.5, 5.0 * np.cos(i)), 0.1 * (i + 1)) for i in range(6)]
    scene = floor_under(
        lights=[*points, *(Light(*b, radiance=RADIANCE) for b in balls)],
        spot_lights=spots,
        directional_lights=suns,
        disks=disks,
    )
    total = sum(np.multiply(p.intensity, p.position[1] / np.linalg.norm(p.position) ** 3) for p in points)
    total = total + sum(spot_irradiance(spot) for spot in spots)
    total += sum(np.multiply(s.irradiance, -s.direction[1] / np.linalg.norm(s.direction)) for s in suns)
    form = sum(disk_form(disk) for disk in disks) + sum(sphere_form(*b) for b in balls)
    return scene, total + np.multiply(RADIANCE, form)


@pytest.mark.parametrize(("estimator", "light_samples"), [("nee", 5), ("mis", 1)])
def test_floor_under_eighty_lights(ctx, light_samples, estimator):
    """Each is chosen as often as its probability says, by whatever search finds it."""
    scene, irradiance = many_lights()
    assert len(pack(scene, scene.render, 8, 8).scene_records["LightChoice"]) == 80
    image = rendered(ctx, scene, 1024, bounces=1, estimator=estimator, light_samples=light_samples)
    assert_mean(image, floor_radiance(irradiance), 0.01, LIFT)


@pytest.mark.parametrize("light_samples", [1, 5])
@pytest.mark.parametrize("estimator", ["nee", "mis"])
def test_floor_under_many_lights(ctx, light_samples, estimator):
    """Lights of every kind add up, whatever the chance with which each is chosen."""
    lamps = [RECTANGLES["aside"], RECTANGLES["wall"], *triangles_of(RECTANGLES["tilted"])]
    balls = [((0.5, 2.0, 0.8), 0.3), ((-1.5, 0.9, 0.5), 0.2)]
    power, point = (4.0, 1.0, 0.1), (0.2, 0.8, 0.4)
    scene = floor_under(
        rectangles=lamps[:2],
        triangles=lamps[2:],
        spheres=[Sphere(*balls[0], "lamp")],
        lights=[Light(*balls[1], radiance=RADIANCE), Light(point, power=power)],
    )
    form = sum(sphere_form(*ball) for ball in balls)
    form += sum(polygon_form(corners(RECTANGLES[name])) for name in ("aside", "wall", "tilted"))
    by_point = np.multiply(power, point[1] / np.linalg.norm(point) ** 3 / (4 * np.pi))
    image = rendered(ctx, scene, 1024, estimator=estimator, light_samples=light_samples)
    assert_mean(image, floor_radiance(np.multiply(RADIANCE, form) + by_point), 0.01, LIFT)


def _check_floor(ctx, estimator: str, **light: Any) -> None:
    """As test_floor_under_a_spherical_light: a light from aside, near and large."""
    center, radius = (1.2, 1.0, 0.0), 0.8
    scene = floor_under(lights=[Light(center, radius, radiance=RADIANCE)])
    image = rendered(ctx, scene, 256, estimator=estimator, **light)
    assert_mean(image, floor_radiance(np.multiply(RADIANCE, sphere_form(center, radius))), 0.005, LIFT)


def _check_flat(ctx) -> None:
    image = rendered(ctx, floor_under(rectangles=[RECTANGLES["tilted"]]), 256, estimator="nee")
    form = polygon_form(corners(RECTANGLES["tilted"]))
    assert_mean(image, floor_radiance(np.multiply(RADIANCE, form)), 0.005, LIFT)


# Errors that the tests above must find: file, text, what stands there instead, and the check.
PLANTED = {
    "lobe 1 % too bright": (
        *("bsdf/diffuse.glsl", "b.diffuse * (wi.z * INVERSE_PI)", "b.diffuse * (1.01 * wi.z * INVERSE_PI)"),
        lambda ctx: _check_floor(ctx, "mis"),
    ),
    "light counted twice": (
        *("integrator/direct.glsl", "power_heuristic(bsdf_pdf, float(u_light_samples) * light_pdf)", "1.0"),
        lambda ctx: _check_floor(ctx, "mis"),
    ),
    "weights without the number of light samples": (
        *("integrator/direct.glsl", "power_heuristic(bsdf_pdf, float(u_light_samples) * light_pdf)"),
        *("power_heuristic(bsdf_pdf, light_pdf)", lambda ctx: _check_floor(ctx, "mis", light_samples=4)),
    ),
    "cone 1 % too wide": (
        *("core/warp.glsl", "u.y * one_minus_cos_max", "u.y * 1.01 * one_minus_cos_max"),
        lambda ctx: _check_floor(ctx, "nee"),
    ),
    "area of the lamp 1 % too large": (
        *("light/area.glsl", "(cos_theta * area)", "(cos_theta * 1.01 * area)", _check_flat),
    ),
}


@pytest.mark.parametrize(("file", "text", "replacement", "check"), PLANTED.values(), ids=PLANTED)
def test_planted_error_is_found(ctx, monkeypatch, tmp_path, file, text, replacement, check):
    check(ctx)
    Planter(monkeypatch, tmp_path)(file, text, replacement)
    with pytest.raises(AssertionError):
        check(ctx)
