# SPDX-License-Identifier: MIT
"""emitter/light.glsl and area_light.glsl: all lights as one sampler."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from fragtracer.gpu.probe import probe
from fragtracer.packing import PackedScene, pack
from fragtracer.scene import Camera, Light, Material, Rectangle, Scene, Sphere, Triangle

from . import Floats, domains
from .chi_square import assert_fits, assert_uniform, fit
from .directions import direction
from .includes import CORE, EMITTER
from .scene_oracle import bounds, shapes_of
from .scene_probe import random_scene, scene_probe

SAMPLE = (
    "LightSample s = light_sample(o, u); wi = vec4(s.wi, s.distance); pdf = vec3(s.pdf, float(s.delta), s.primitive);"
)
SAMPLED = {"wi": 4, "pdf": 3}


def packed_lights(scene: Scene, baked: bool = False) -> PackedScene:
    return pack(scene, scene.render, 64, 64, baked)


def choose(ctx: moderngl.Context, packed: PackedScene, count: int) -> tuple[Floats, Floats, Floats]:
    """Evenly spaced numbers, the light each chooses, by its cumulative probability, and what is left of it."""
    u = ((np.arange(count) + 0.5) / count).astype(np.float32)
    body = "left = u; Light l = light_choose(left); chosen = vec2(l.cumulative, l.probability);"
    result = scene_probe(ctx, packed, EMITTER, body, {"u": u}, {"left": 1, "chosen": 2})
    return u.astype(np.float64), result["chosen"], result["left"]


@pytest.mark.parametrize("baked", [False, True])
def test_lights_are_chosen_by_their_probability(ctx: moderngl.Context, baked: bool) -> None:
    """As often as it says; and what is left of the number is uniform again, for each light alone."""
    packed = packed_lights(random_scene(4), baked)
    count = 1 << 18
    u, chosen, left = choose(ctx, packed, count)
    cumulative, first, counts = np.unique(chosen[:, 0], return_index=True, return_counts=True)
    probability = chosen[first, 1]
    assert len(cumulative) == packed.defines["LIGHT_COUNT"]
    assert probability.sum() == pytest.approx(1, abs=1e-6)
    # Even spacing leaves each count no more than 1 from its share; float32 limits move by 1e-7.
    assert np.abs(counts - count * probability).max() <= 2
    exact = (u - (chosen[:, 0] - chosen[:, 1])) / chosen[:, 1]
    np.testing.assert_allclose(left, exact, atol=2e-7 / probability.min())
    assert_uniform({f"{c:.3f}": left[chosen[:, 0] == c] for c in cumulative}, cells=64)


def test_power_decides_nine_tenths_of_the_choice(ctx: moderngl.Context) -> None:
    """Twice the power, twice as likely, but for the share that is dealt out evenly."""
    powers = np.array([1.0, 2.0, 4.0, 0.001])
    lights = tuple(Light((i, 0.0, 0.0), power=p, radius=0.1 * (i % 2)) for i, p in enumerate(powers.tolist()))
    _, chosen, _ = choose(ctx, packed_lights(Scene(lights=lights, materials={"m": Material()})), 1 << 16)
    probability = np.sort(np.unique(chosen[:, 1]))
    np.testing.assert_allclose(probability, np.sort(0.9 * powers / powers.sum() + 0.1 / 4), rtol=1e-6)


def test_one_light_keeps_the_number(ctx: moderngl.Context) -> None:
    packed = packed_lights(Scene(lights=(Light((0.0, 1.0, 0.0), power=1.0),), materials={"m": Material()}))
    u, _, left = choose(ctx, packed, 1 << 10)
    np.testing.assert_array_equal(left, u)


@pytest.mark.parametrize("baked", [False, True])
def test_density_of_a_sample_is_that_of_its_hit(ctx: moderngl.Context, baked: bool) -> None:
    """What light_sample says of a direction is what a path that meets the light there asks of light_pdf;
    and the light is at the distance it says."""
    scene = random_scene(5)
    packed = packed_lights(scene, baked)
    rng = np.random.default_rng(1)
    count = 1 << 16
    origin = rng.normal(size=(count, 3)).astype(np.float32)
    body = f"""{SAMPLE}
        for (int i = 0; i < LIGHT_COUNT; i++) {{
            Light l = light_load(i);
            if (l.primitive == s.primitive && !s.delta) {{
                cosine = -dot(s.wi, l.normal);
                met = light_pdf(i, o, s.distance, cosine, 0.0);
            }}
        }}"""
    inputs = {"o": origin, "u": rng.random((count, 2), np.float32)}
    result = scene_probe(ctx, packed, EMITTER, body, inputs, SAMPLED | {"met": 1, "cosine": 1})
    pdf, delta, primitive = result["pdf"].T
    assert (pdf >= 0).all()
    assert ((primitive == -1) == (delta == 1)).all()
    np.testing.assert_allclose(result["met"][delta == 0], pdf[delta == 0], rtol=1e-5)

    found = pdf > 0
    wi, distance = result["wi"][:, :3], result["wi"][:, 3]
    assert np.abs(np.linalg.norm(wi[found], axis=1) - 1).max() < 1e-6
    for k, shape in enumerate(shapes_of(scene)):
        mine = found & (primitive == k)
        low, high = bounds(shape, origin[mine] + packed.origin, wi[mine], 1e-5)
        assert ((distance[mine] >= low - 1e-5) & (distance[mine] <= high + 1e-5)).all(), shape
        if not isinstance(shape, Sphere):
            assert (result["cosine"][mine] > 0).all()
            assert not pdf[(primitive == k) & (result["cosine"] <= 0)].any()  # behind it is dark
    assert len(np.unique(primitive[found])) == packed.defines["LIGHT_COUNT"]


CEILING = Rectangle((-0.5, 2.0, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), "dim")  # its front looks down
GABLE = Triangle(((1.0, 0.5, 0.0), (1.5, 2.0, 1.0), (1.2, 1.5, -1.0)), "bright")
BALL = Sphere((-1.0, 1.5, 0.5), 0.4, "dim")
LAMP = Light((0.5, 1.0, 1.0), power=(30.0, 20.0, 10.0))
GLOBE = Light((0.0, 1.5, -1.5), radius=0.5, radiance=(1.0, 2.0, 3.0))


def lit_by(lights: tuple[Light, ...] = (), **shapes: tuple[Rectangle | Triangle | Sphere, ...]) -> Scene:
    materials = {"dim": Material(emission=(1.0, 0.5, 0.2)), "bright": Material(emission=(7.0, 8.0, 9.0))}
    return Scene(camera=Camera((0.0, 1.0, 3.0)), materials=materials, lights=lights, **shapes)


ROOMS = {
    "rectangle": lit_by(rectangles=(CEILING,)),
    "triangle": lit_by(triangles=(GABLE,)),
    "sphere": lit_by(spheres=(BALL,)),
    "point": lit_by(lights=(LAMP,)),
    "all": lit_by(lights=(LAMP, GLOBE), rectangles=(CEILING,), triangles=(GABLE,), spheres=(BALL,)),
}


def polygon_irradiance(corners: Floats, normal: Floats) -> float:
    """Of radiance 1 from the front of a polygon wholly above the horizon (Lambert's formula)."""
    v = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    after = np.roll(v, -1, axis=0)
    cross = np.cross(v, after)
    angle = np.arctan2(np.linalg.norm(cross, axis=1), (v * after).sum(1))
    across = cross / np.linalg.norm(cross, axis=1, keepdims=True)
    return max(0.0, float(-(angle[:, None] * across).sum(0) @ normal / 2))


def irradiance(scene: Scene, normal: Floats) -> Floats:
    """At the origin, of everything that emits, as if nothing stood in its way."""
    total = np.zeros(3)
    for r in scene.rectangles:
        c, u, v = (np.array(x) for x in (r.corner, r.edge_u, r.edge_v))
        corners = np.array([c, c + u, c + u + v, c + v])
        total += polygon_irradiance(corners, normal) * np.array(scene.materials[r.material].emission)
    for t in scene.triangles:
        total += polygon_irradiance(np.array(t.vertices), normal) * np.array(scene.materials[t.material].emission)
    balls = [(s.center, s.radius, scene.materials[s.material].emission) for s in scene.spheres]
    balls += [(light.position, light.radius, light.surface_radiance) for light in scene.lights if light.radius > 0]
    for center, radius, radiance in balls:
        distance = np.linalg.norm(center)
        total += np.pi * (radius / distance) ** 2 * (center @ normal) / distance * np.array(radiance)
    for light in scene.lights:
        if light.radius == 0:
            distance = np.linalg.norm(light.position)
            total += np.array(light.intensity) * (np.array(light.position) @ normal) / distance**3
    return total


@pytest.mark.parametrize("name", ROOMS)
def test_irradiance(ctx: moderngl.Context, name: str) -> None:
    """The mean of radiance times cosine over the density is the closed form: it needs the density, the
    distance and the choice of the light to be right together."""
    scene = ROOMS[name]
    packed = packed_lights(scene)
    u = np.random.default_rng(2).random((1 << 20, 2), np.float32)
    x, z, y = direction(15)
    for normal in (np.array([0.0, 1.0, 0.0]), np.array([x, y, z])):
        place = np.broadcast_to((-packed.origin).astype(np.float32), (len(u), 3))
        facing = np.broadcast_to(normal, (len(u), 3))
        body = """
            LightSample s = light_sample(o, u);
            if (s.pdf > 0.0) e = s.radiance * max(0.0, dot(s.wi, n)) / s.pdf;"""
        e = scene_probe(ctx, packed, EMITTER, body, {"o": place, "n": facing, "u": u}, {"e": 3})["e"]
        error = e.std(axis=0) / np.sqrt(len(e))
        expected = irradiance(scene, normal)
        assert (np.abs(e.mean(axis=0) - expected) <= 4.5 * error + 1e-5 * expected).all()
        assert (error < 0.005 * expected).all()


def test_flat_lights_are_dark_from_behind(ctx: moderngl.Context) -> None:
    scene = lit_by(rectangles=(CEILING,), triangles=(replace(GABLE, vertices=GABLE.vertices[::-1]),))
    packed = packed_lights(scene)
    u = np.random.default_rng(3).random((1 << 12, 2), np.float32)
    above = np.broadcast_to(np.array([0.0, 3.0, 0.0]) - packed.origin, (len(u), 3))
    result = scene_probe(ctx, packed, EMITTER, SAMPLE, {"o": above, "u": u}, SAMPLED)
    assert not result["pdf"][result["pdf"][:, 2] == 0, 0].any()
    below = np.broadcast_to(-packed.origin, (len(u), 3))
    result = scene_probe(ctx, packed, EMITTER, SAMPLE, {"o": below, "u": u}, SAMPLED)
    assert (result["pdf"][result["pdf"][:, 2] == 0, 0] > 0).all()
    assert not result["pdf"][result["pdf"][:, 2] == 1, 0].any()


@pytest.mark.parametrize("kind", ["rectangle", "triangle"])
def test_points_are_uniform_over_the_area(ctx: moderngl.Context, kind: str) -> None:
    """Whatever the place they are seen from; the density over solid angle is that over the area, turned."""
    corner, u_edge, v_edge, origin = (np.float32(v) for v in ((1, 2, 3), (2, 0, 0.5), (0, 3, 0), (0.5, 1, -2)))
    rng = np.random.default_rng(4)
    place = rng.random((1 << 18, 2), np.float32)
    coordinates = "square_to_triangle(place)" if kind == "triangle" else "place"
    edges = ", ".join(f"vec3{tuple(v.tolist())}" for v in (corner, u_edge, v_edge, origin))
    includes = [*CORE, "emitter/area_light.glsl"]
    body = f"point = area_light_sample({edges}, {coordinates}); pdf = area_light_pdf(2.5, point.w, 0.4);"
    result = probe(ctx, includes, body, {"place": place}, {"point": 4, "pdf": 1})
    wi, distance = result["point"][:, :3].astype(np.float64), result["point"][:, 3].astype(np.float64)
    found = origin + distance[:, None] * wi - corner
    inside = found @ np.linalg.pinv(np.stack([u_edge, v_edge]).astype(np.float64))
    assert np.abs(inside - np.clip(inside, 0, 1)).max() < 2e-6
    domain, density = (domains.Triangle(), 2.0) if kind == "triangle" else (domains.Box(), 1.0)
    points = np.clip(inside, 0, 1 - 1e-9)
    if kind == "triangle":
        assert points.sum(1).max() < 1 + 2e-6
        points /= np.maximum(1, points.sum(1) + 1e-9)[:, None]
    assert_fits({kind: fit(domain, points, lambda points: np.full(len(points), density))})
    np.testing.assert_allclose(result["pdf"], distance**2 / (0.4 * 2.5), rtol=1e-6)
