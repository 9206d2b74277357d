# SPDX-License-Identifier: MIT
"""light/: all lights as one sampler, and each kind for itself."""

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.gpu.specialise import Level
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.lights import FEW_LIGHTS, LightKind
from fragtracer.packing.shapes import Kind
from fragtracer.probe import probe
from fragtracer.resources import folder
from fragtracer.scene import (
    Camera,
    DirectionalLight,
    Disk,
    Light,
    Material,
    Rectangle,
    Scene,
    Sphere,
    SpotLight,
    Triangle,
)
from fragtracer.scene.light import NARROWEST_SPOT

from . import Floats, domains
from .chi_square import assert_fits, assert_uniform, fit
from .directions import direction, random_directions
from .light_oracle import LIGHTS, khronos_falloff, sphere_irradiance
from .scene_oracle import bounds, corners_of, shapes_of
from .scene_probe import camera_on, light_numbers, random_scene, scene_probe, shape_records

LIGHT = ["light/light.glsl"]
FLATS = ["rectangle", "disk", "triangle"]

SAMPLE = (
    "LightSample s = light_sample(o, u); wi = vec4(s.wi, s.distance); pdf = vec3(s.pdf, float(s.delta), s.primitive);"
)
SAMPLED = {"wi": 4, "pdf": 3}


def packed_lights(scene: Scene, most_listed: int = 0) -> PackedScene:
    return pack(scene, scene.render, 64, 64, most_listed)


STORAGES = {"texture": (0, Level.NOTHING), "compiled in": (10**6, Level.SCENE)}
STEPS = 2**23  # in [0, 1): what random numbers are multiples of


def choose(
    ctx: moderngl.Context, packed: PackedScene, steps: NDArray[np.integer], level: Level = Level.NOTHING
) -> tuple[NDArray[np.int64], Floats]:
    """The number of the light that u = steps / STEPS chooses, which its cumulative probability tells; what is left. Of
    so many steps that four of them, each chosen by itself, fill each row of a probe."""
    body = " ".join(
        f"left.{lane} = u.{lane}; chosen.{lane} = light_choose(0.0, left.{lane}).cumulative;" for lane in "xyzw"
    )
    inputs = {"u": (steps / STEPS).astype(np.float32).reshape(-1, 4)}
    result = scene_probe(ctx, packed, LIGHT, body, inputs, {"left": 4, "chosen": 4}, level)
    cumulative, _ = choices(packed)
    chosen = result["chosen"].ravel() * STEPS
    number = np.searchsorted(cumulative, chosen)
    np.testing.assert_array_equal(cumulative[number], chosen)
    return number, result["left"].ravel()


def choices(packed: PackedScene) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cumulative and own probability of each light in STEPS, which are whole numbers."""
    table = packed.scene_records["LightChoice"].view(np.float32).reshape(-1, 8)[:, :2].astype(np.float64) * STEPS
    assert (table == np.rint(table)).all()
    return table[:, 0].astype(np.int64), table[:, 1].astype(np.int64)


def many_lights(count: int) -> Scene:
    """Points whose powers are spread over twelve orders of magnitude."""
    rng = np.random.default_rng(count)
    powers = 10 ** rng.uniform(-6, 6, count)
    places = rng.normal(size=(count, 3))
    lights = tuple(Light(tuple(p), power=float(w)) for p, w in zip(places.tolist(), powers, strict=True))
    return Scene(lights=lights, materials={"m": Material()}, camera=camera_on(1.0, 0.0))


assert f"const int FEW_LIGHTS = {FEW_LIGHTS};" in (folder("shaders") / "light" / "light.glsl").read_text("utf-8")
# More than these are found by the guide table and bisection.
COUNTS = [1, 2, 8, 9, 10, 1000, 10_000]


@pytest.mark.parametrize("count", COUNTS)
def test_probabilities_add_up_exactly(count: int) -> None:
    """In whole steps, each one at least; within a step of what power asks for."""
    scene = many_lights(count)
    packed = packed_lights(scene)
    cumulative, steps = choices(packed)
    assert len(steps) == count
    assert steps.min() >= 1
    assert steps.sum() == STEPS
    np.testing.assert_array_equal(cumulative, np.cumsum(steps) - steps)
    number_of = light_numbers(packed)
    steps = steps[[number_of[LightKind.POINT, i] for i in range(count)]]
    power = np.array([sum(light.power) for light in scene.lights])
    asked = 0.9 * power / power.sum() + 0.1 / count
    assert np.abs(steps - asked * (STEPS - count)).max() <= 2  # one of its own, one of what is left over


@pytest.mark.parametrize("count", COUNTS)
def test_guide_table_is_right_at_every_edge(count: int) -> None:
    """Row i has the lights of all numbers from i / count to (i + 1) / count, a step more on both sides, and no more."""
    packed = packed_lights(many_lights(count))
    cumulative, _ = choices(packed)
    guide = packed.scene_records["LightChoice"].reshape(-1, 8)[:, 4:6].astype(np.int64)
    edges = [-(-i * STEPS // count) for i in range(count + 1)]  # the first step of each row
    for row in range(count):
        low, high = max(edges[row] - 1, 0), min(edges[row + 1], STEPS - 1)
        first, last = np.searchsorted(cumulative, [low, high], side="right") - 1
        assert guide[row, 0] <= first
        assert guide[row, 1] >= last
        least = np.searchsorted(cumulative, max(low - 2, 0), side="right") - 1
        most = np.searchsorted(cumulative, min(high + 2, STEPS - 1), side="right") - 1
        assert guide[row, 0] >= least
        assert guide[row, 1] <= most


@pytest.mark.parametrize(
    ("count", "storage"),
    [*((count, "texture") for count in (1, 8, 9, 1000, 10_000)), *((count, "compiled in") for count in (1, 8, 9))],
)
def test_lights_are_chosen_exactly_as_often_as_they_say(ctx: moderngl.Context, count: int, storage: str) -> None:
    """Over all numbers that there are: each light by as many of them as its probability says, in order; and what is
    left of a number is where in the light's part it lies."""
    most_listed, level = STORAGES[storage]
    packed = packed_lights(many_lights(count), most_listed)
    cumulative, own = choices(packed)
    counts = np.zeros(count, np.int64)
    before = 0
    part = 1 << 21
    for start in range(0, STEPS, part):
        steps = start + np.arange(part)
        number, left = choose(ctx, packed, steps, level)
        assert number[0] >= before
        assert (np.diff(number) >= 0).all()
        before = number[-1]
        counts += np.bincount(number, minlength=count)
        assert (left >= 0).all()
        assert (left < 1).all()
        exact = (steps - cumulative[number]) / own[number]
        assert (np.abs(left - exact) <= 3e-7 * exact + 1e-30).all()
        within = np.diff(number) == 0
        assert (np.diff(left)[within] > 0).all()
    np.testing.assert_array_equal(counts, own)


@pytest.mark.parametrize("storage", STORAGES)
def test_lights_of_all_kinds_are_chosen_by_their_probability(ctx: moderngl.Context, storage: str) -> None:
    """What is left of the number is uniform again, for each light alone."""
    most_listed, level = STORAGES[storage]
    packed = packed_lights(random_scene(4), most_listed)
    _, own = choices(packed)
    steps = np.arange(16, STEPS, 32)
    number, left = choose(ctx, packed, steps, level)
    counts = np.bincount(number, minlength=len(own))
    assert len(counts) == packed.uniforms["u_light_count"]
    assert np.abs(counts - own / 32).max() <= 2
    assert_uniform({f"{i}": left[number == i] for i in range(len(own))}, cells=64)


def test_power_decides_nine_tenths_of_the_choice() -> None:
    """Twice the power, twice as likely, but for the share that is dealt out evenly."""
    powers = np.array([1.0, 2.0, 4.0, 0.001])
    lights = tuple(Light((i, 0.0, 0.0), power=p, radius=0.1 * (i % 2)) for i, p in enumerate(powers.tolist()))
    _, steps = choices(packed_lights(Scene(lights=lights, materials={"m": Material()})))
    probability = np.sort(steps / STEPS)
    asked = np.sort(0.9 * powers / powers.sum() + 0.1 / 4)
    np.testing.assert_allclose(probability, asked, rtol=1e-6, atol=1 / STEPS)  # whole steps


def test_one_light_keeps_the_number(ctx: moderngl.Context) -> None:
    packed = packed_lights(Scene(lights=(Light((0.0, 1.0, 0.0), power=1.0),), materials={"m": Material()}))
    steps = np.arange(0, STEPS, 1 << 13)
    _, left = choose(ctx, packed, steps)
    np.testing.assert_array_equal(left, steps / STEPS)


@pytest.mark.parametrize("most_listed", [0, 10**6], ids=["bvh", "listed"])
@pytest.mark.parametrize("level", [Level.NOTHING, Level.SCENE], ids=["texture", "compiled in"])
def test_density_of_a_sample_is_that_of_its_hit(ctx: moderngl.Context, most_listed: int, level: Level) -> None:
    """What light_sample says of a direction is what a path that meets the light there asks of light_pdf;
    and the light is at the distance it says."""
    scene = random_scene(5)
    packed = packed_lights(scene, most_listed)
    rng = np.random.default_rng(1)
    count = 1 << 16
    origin = rng.normal(size=(count, 3)).astype(np.float32)
    body = f"""{SAMPLE}
        for (int i = 0; i < u_light_count; i++) {{
            LightChoice c = light_choice_load(i);
            int primitive = -2;
            vec3 normal = vec3(0.0);
            if (c.kind == LIGHT_SPHERE) primitive = sphere_light_load(c.record).primitive;
            if (c.kind == LIGHT_AREA) {{
                primitive = area_light_load(c.record).primitive;
                normal = area_light_load(c.record).normal;
            }}
            float alone = c.probability;
            if (i < u_light_tree_count) alone = light_tree_probability(o, c.cumulative, c.probability);
            vec3 place = vec3(1e9);
            if (c.kind == LIGHT_POINT) place = point_light_load(c.record).position;
            if (c.kind == LIGHT_SPOT) place = spot_light_load(c.record).position;
            bool is_there = distance(o + s.wi * s.distance, place) < 1e-5;
            if (s.delta && (c.kind == LIGHT_DIRECTIONAL ? s.distance > 1e6 : is_there)) met = alone;
            if (primitive == s.primitive && !s.delta) {{
                cosine = -dot(s.wi, normal);
                met = light_pdf(i, o, s.distance, cosine, 0.0);
                number = float(i);
            }}
        }}"""
    inputs = {"o": origin, "u": rng.random((count, 2), np.float32)}
    outputs = SAMPLED | {"met": 1, "cosine": 1, "number": 1}
    result = scene_probe(ctx, packed, LIGHT, body, inputs, outputs, level)
    pdf, delta, primitive = result["pdf"].T
    assert (pdf >= 0).all()
    assert ((primitive == -1) == (delta == 1))[pdf > 0].all()
    assert not delta[pdf == 0].any()  # within a sphere, where there is no sample, or behind an area
    np.testing.assert_allclose(result["met"], pdf, rtol=1e-5)

    found = pdf > 0
    wi, distance = result["wi"][:, :3], result["wi"][:, 3]
    assert np.abs(np.linalg.norm(wi[found], axis=1) - 1).max() < 1e-6
    shines = [
        s for s in shapes_of(scene) if s.material not in scene.materials or scene.materials[s.material].is_emissive
    ]
    kinds = [LightKind.SPHERE if isinstance(shape, Sphere) else LightKind.AREA for shape in shines]
    number_of = light_numbers(packed)
    numbers = [number_of[kind, kinds[:k].count(kind)] for k, kind in enumerate(kinds)]
    for i, shape in zip(numbers, shines, strict=True):
        mine = found & (delta == 0) & (result["number"] == i)
        assert len(np.unique(primitive[mine])) == 1
        low, high = bounds(shape, origin[mine] + packed.origin, wi[mine], 1e-5)
        assert ((distance[mine] >= low - 1e-5) & (distance[mine] <= high + 1e-5)).all(), shape
        if not isinstance(shape, Sphere):
            assert (result["cosine"][mine] > 0).all()
            behind = (delta == 0) & (result["number"] == i) & (result["cosine"] <= 0)
            assert not pdf[behind].any()  # behind it is dark
    assert len(np.unique(result["number"][found & (delta == 0)])) == len(shines)


def scattered_lights(count: int) -> Scene:
    """Points of powers from 1 to 10 W over a square of 30 m, 2 m high."""
    rng = np.random.default_rng(count)
    places = np.column_stack([rng.uniform(-15, 15, count), np.full(count, 2.0), rng.uniform(-15, 15, count)])
    powers = 10 ** rng.uniform(0, 1, count)
    lights = tuple(Light(tuple(p), power=w) for p, w in zip(places.tolist(), powers.tolist(), strict=True))
    return Scene(lights=lights, materials={"m": Material()}, camera=camera_on(1.0, 0.0))


TREE = "LightChoice c = light_choice_load(int(number)); p = light_tree_probability(o, c.cumulative, c.probability);"


def tree_probabilities(ctx: moderngl.Context, packed: PackedScene, origins: Floats) -> Floats:
    """Of each light at each origin, (origins, lights)."""
    count = packed.uniforms["u_light_count"]
    inputs = {"o": np.repeat(origins, count, axis=0), "number": np.tile(np.arange(count), len(origins))}
    return scene_probe(ctx, packed, LIGHT, TREE, inputs, {"p": 1})["p"].reshape(len(origins), count)


@pytest.mark.parametrize("lights", [many_lights, scattered_lights])
def test_a_tree_chooses_each_light_as_often_as_it_says(ctx: moderngl.Context, lights: Any) -> None:
    """At places among the lights, and far away; over numbers that are evenly spaced."""
    packed = packed_lights(lights(300))
    origins = np.concatenate([np.random.default_rng(1).normal(scale=3, size=(6, 3)), [[300.0, 0.0, 0.0]]])
    expected = tree_probabilities(ctx, packed, origins)
    assert expected.min() > 0
    np.testing.assert_allclose(expected.sum(axis=1), 1, rtol=1e-5)
    count = 1 << 18
    u = ((np.arange(count) + 0.5) / count).astype(np.float32)
    body = "left = u; LightChoice c = light_choose_at(o, left); p = c.probability; cumulative = c.cumulative;"
    cumulative, _ = choices(packed)
    for origin, probability in zip(origins, expected, strict=True):
        inputs = {"u": u, "o": np.broadcast_to(origin, (count, 3))}
        found = scene_probe(ctx, packed, LIGHT, body, inputs, {"left": 1, "p": 1, "cumulative": 1})
        number = np.searchsorted(cumulative, np.rint(found["cumulative"] * STEPS))
        np.testing.assert_allclose(found["p"], probability[number], rtol=1e-5)
        shares = np.bincount(number, minlength=len(probability)) / count
        np.testing.assert_allclose(shares, probability, atol=40 / count)
        assert ((found["left"] >= 0) & (found["left"] < 1)).all()
        heavy = int(probability.argmax())
        assert_uniform({"left": found["left"][number == heavy]}, cells=16)


def test_what_a_tree_leaves_of_a_number_is_fine(ctx: moderngl.Context) -> None:
    """Close to one of so many lights that each has a few dozen steps of probability by power alone."""
    scene = scattered_lights(20_000)
    packed = packed_lights(scene)
    cumulative, steps = choices(packed)
    assert np.median(steps) < 500
    near = light_numbers(packed)[LightKind.POINT, 123]
    origin = np.add(scene.lights[123].position, (0.0, 0.0, 0.01)) - packed.origin
    count = 1 << 18
    inputs = {"u": (np.arange(count) + 0.5) / count, "o": np.broadcast_to(origin, (count, 3))}
    body = "left = u; chosen = light_choose_at(o, left).cumulative;"
    found = scene_probe(ctx, packed, LIGHT, body, inputs, {"left": 1, "chosen": 1})
    left = found["left"][np.rint(found["chosen"] * STEPS) == cumulative[near]]
    assert len(left) > 1000
    assert len(np.unique(left)) > 0.99 * len(left)
    assert_uniform({"left": left}, cells=64)


def test_a_tree_chooses_what_is_near(ctx: moderngl.Context) -> None:
    """The second moment of irradiance that nothing occludes, by choice in the tree and by power alone."""
    scene = scattered_lights(300)
    packed = packed_lights(scene)
    origins = np.column_stack([*np.random.default_rng(3).uniform(-12, 12, (2, 40)), np.zeros(40)])[:, [0, 2, 1]]
    probability = tree_probabilities(ctx, packed, origins - packed.origin)
    number_of = light_numbers(packed)
    numbers = [number_of[LightKind.POINT, i] for i in range(300)]
    place, power = (np.array([getattr(light, key) for light in scene.lights]) for key in ("position", "power"))
    to_light = place - origins[:, None]
    distance = np.linalg.norm(to_light, axis=2)
    irradiance = power[:, 0] * to_light[..., 1] / distance**3
    _, own = choices(packed)
    by_tree, by_power = (
        (irradiance**2 / p[..., numbers]).sum(axis=1) - irradiance.sum(axis=1) ** 2 for p in (probability, own / STEPS)
    )
    assert np.median(by_power / by_tree) > 6
    assert (by_tree < by_power).all()


CEILING = Rectangle((-0.5, 2.0, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), "dim")  # its front looks down
HATCH = Disk((0.3, 1.8, 0.6), (0.2, -1.0, -0.3), 0.5, "dim")
GABLE = Triangle(((1.0, 0.5, 0.0), (1.5, 2.0, 1.0), (1.2, 1.5, -1.0)), "bright")
BALL = Sphere((-1.0, 1.5, 0.5), 0.4, "dim")


def lit_by(**contents: Any) -> Scene:
    materials = {"dim": Material(emission=(1.0, 0.5, 0.2)), "bright": Material(emission=(7.0, 8.0, 9.0))}
    return Scene(camera=Camera((0.0, 1.0, 3.0)), materials=materials, **contents)


EMISSIVE = {
    "rectangle": {"rectangles": (CEILING,)},
    "disk": {"disks": (HATCH,)},
    "triangle": {"triangles": (GABLE,)},
    "sphere": {"spheres": (BALL,)},
}
OWN = {name: {kind: (light,)} for kind, model in LIGHTS.items() for name, light in model.examples.items()}
# Two of each kind, so that the records of a kind follow each other.
SECOND = {
    "lights": (
        Light((-0.8, 1.2, 0.4), power=(5.0, 15.0, 25.0)),
        Light((1.5, 1.5, -0.5), radius=0.3, radiance=(3.0, 2.0, 1.0)),
    ),
    "spot_lights": (SpotLight((-0.5, 1.5, 0.6), (0.3, -1.0, -0.4), (2.0, 3.0, 6.0), 20.0, 50.0),),
    "directional_lights": (DirectionalLight((-0.5, -1.0, 0.2), (0.2, 0.5, 0.9)),),
}
EVERYTHING = {kind: (*model.examples.values(), *SECOND[kind]) for kind, model in LIGHTS.items()}
EVERYTHING |= {kind: shapes for contents in EMISSIVE.values() for kind, shapes in contents.items()}
ROOMS = {name: lit_by(**contents) for name, contents in (EMISSIVE | OWN | {"all": EVERYTHING}).items()}


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
    for d in scene.disks:  # as a polygon of 4096 sides and the same area
        turns = 2 * np.pi * (np.arange(4096) + 0.5) / 4096
        center, u, v = corners_of(d)
        swell = np.sqrt(np.pi / (4096 * np.sin(2 * np.pi / 4096) / 2))
        corners = center + swell * (np.cos(turns)[:, None] * (u - center) + np.sin(turns)[:, None] * (v - center))
        total += polygon_irradiance(corners, normal) * np.array(scene.materials[d.material].emission)
    for t in scene.triangles:
        total += polygon_irradiance(np.array(t.vertices), normal) * np.array(scene.materials[t.material].emission)
    for s in scene.spheres:
        emission = np.array(scene.materials[s.material].emission)
        total += sphere_irradiance(np.array(s.center), s.radius, normal) * emission
    for kind, model in LIGHTS.items():
        for light in getattr(scene, kind):
            total += model.irradiance(light, normal)
    return total


(SPOT,) = LIGHTS["spot_lights"].examples.values()
(SUN,) = LIGHTS["directional_lights"].examples.values()
SPOTS = [
    SPOT,
    SpotLight((1.0, 2.0, 3.0), (0.0, 0.0, -1.0), (1.0, 2.0, 3.0), 0.0, 90.0),
    SpotLight((-1.0, 0.0, 0.0), (3.0, 1.0, -2.0), (5.0, 0.0, 1.0), 30.0, 33.0),
    SpotLight((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 89.0, 90.0),
    SpotLight((0.0, 0.0, 0.0), (1.0, 2.0, -2.0), (1.0, 1.0, 1.0), 0.0, 0.1),
    SpotLight((0.0, 0.0, 0.0), (2.0, 1.0, 3.0), (1.0, 1.0, 1.0), NARROWEST_SPOT / 2, NARROWEST_SPOT),
]


@pytest.mark.parametrize("level", [Level.NOTHING, Level.SCENE], ids=["texture", "compiled in"])
@pytest.mark.parametrize("spot", SPOTS)
def test_spot(ctx: moderngl.Context, spot: SpotLight, level: Level) -> None:
    """Its falloff in every direction, at every distance; it is a delta light that nothing meets."""
    packed = packed_lights(Scene(spot_lights=(spot,), camera=Camera((0.0, 1.0, 3.0)), materials={"m": Material()}))
    rng = np.random.default_rng(5)
    axis = np.array(spot.direction) / np.linalg.norm(spot.direction)
    direction = np.concatenate(
        [random_directions(rng, 4000), around(axis, spot.inner_degrees, spot.outer_degrees, rng)]
    )
    distance = 10 ** rng.uniform(-1, 2, len(direction))
    origin = np.array(spot.position) + distance[:, None] * direction - packed.origin
    body = f"{SAMPLE} radiance = s.radiance;"
    inputs = {"o": origin, "u": rng.random((len(direction), 2))}
    found = scene_probe(ctx, packed, LIGHT, body, inputs, SAMPLED | {"radiance": 3}, level)
    assert (found["pdf"] == (1, 1, -1)).all()
    np.testing.assert_allclose(found["wi"][:, :3], -direction, atol=3e-6 * (1 + 4 / distance[:, None]).max())
    np.testing.assert_allclose(found["wi"][:, 3], distance, rtol=1e-5)
    # float32 knows directions to a few 1e-7, and to the rounding of the places.
    inner, outer = np.radians([spot.inner_degrees, spot.outer_degrees])
    edge = np.sin(outer) / (2 * np.sin((outer + inner) / 2) * np.sin((outer - inner) / 2))
    doubt = 2 * edge * (5e-7 + 1e-6 * 4 / distance)
    falloff = khronos_falloff(spot, direction)
    exact = np.array(spot.intensity) / (distance**2)[:, None]
    error = np.abs(found["radiance"] - falloff[:, None] * exact)
    assert (error <= exact * (doubt + 2e-5 * falloff)[:, None]).all()
    assert (falloff == 1).any() or spot.inner_degrees == 0
    assert ((falloff > 0) & (falloff < 1)).mean() > 0.02


def around(axis: Floats, inner: float, outer: float, rng: np.random.Generator) -> Floats:
    """Directions from within the inner to beyond the outer angle."""
    across = np.cross(axis, random_directions(rng, 2000))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    margin = min(3.0, outer)
    angle = np.radians(rng.uniform(max(0.0, inner - margin), outer + margin, (2000, 1)))
    result: Floats = np.cos(angle) * axis + np.sin(angle) * across
    return result


@pytest.mark.parametrize("level", [Level.NOTHING, Level.SCENE], ids=["texture", "compiled in"])
def test_directional(ctx: moderngl.Context, level: Level) -> None:
    """The same from everywhere, against the way that it travels."""
    packed = packed_lights(lit_by(directional_lights=(SUN,)))
    rng = np.random.default_rng(6)
    inputs = {"o": 100 * rng.normal(size=(1000, 3)), "u": rng.random((1000, 2))}
    found = scene_probe(
        ctx, packed, LIGHT, f"{SAMPLE} radiance = s.radiance;", inputs, SAMPLED | {"radiance": 3}, level
    )
    expected = -np.array(SUN.direction) / np.linalg.norm(SUN.direction)
    np.testing.assert_allclose(found["wi"][:, :3], np.broadcast_to(expected, (1000, 3)), rtol=2e-7)
    assert (found["wi"][:, 3] == np.float32(1e30)).all()
    assert (found["pdf"] == (1, 1, -1)).all()
    np.testing.assert_allclose(found["radiance"], np.broadcast_to(SUN.irradiance, (1000, 3)), rtol=2e-7)


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
        e = scene_probe(ctx, packed, LIGHT, body, {"o": place, "n": facing, "u": u}, {"e": 3})["e"]
        error = e.std(axis=0) / np.sqrt(len(e))
        expected = irradiance(scene, normal)
        assert (np.abs(e.mean(axis=0) - expected) <= 4.5 * error + 1e-5 * expected).all()
        assert (error < 0.005 * expected).all()


RECTANGLE, DISK, TRIANGLE = Kind.RECTANGLE, Kind.DISK, Kind.SINGLE_TRIANGLE


def test_flat_lights_are_dark_from_behind(ctx: moderngl.Context) -> None:
    """Above the ceiling and the disk, and below the triangle whose front is above."""
    turned = replace(GABLE, vertices=GABLE.vertices[::-1])
    for most_listed in (0, 10**6):
        packed = packed_lights(lit_by(rectangles=(CEILING,), disks=(HATCH,), triangles=(turned,)), most_listed)
        numbers, words = shape_records(packed)
        kind = dict(zip(numbers.tolist(), (words[:, 0, 3] >> 24).tolist(), strict=True))
        u = np.random.default_rng(3).random((1 << 12, 2), np.float32)
        for place, lit in (((0.0, 3.0, 0.0), {TRIANGLE}), ((0.0, 0.0, 0.0), {RECTANGLE, DISK})):
            origin = np.broadcast_to(np.array(place) - packed.origin, (len(u), 3))
            result = scene_probe(ctx, packed, LIGHT, SAMPLE, {"o": origin, "u": u}, SAMPLED)
            of = np.array([kind[int(p)] for p in result["pdf"][:, 2]])
            assert set(of.tolist()) == {RECTANGLE, DISK, TRIANGLE}
            for one in {RECTANGLE, DISK, TRIANGLE} - lit:
                assert not result["pdf"][of == one, 0].any()
            if lit == {RECTANGLE, DISK}:
                assert (result["pdf"][np.isin(of, (RECTANGLE, DISK)), 0] > 0).all()


KINDS = {"rectangle": "KIND_RECTANGLE", "disk": "KIND_DISK", "triangle": "KIND_SINGLE_TRIANGLE"}


@pytest.mark.parametrize("kind", FLATS)
def test_points_are_uniform_over_the_area(ctx: moderngl.Context, kind: str) -> None:
    """Whatever the place they are seen from; the density over solid angle is that over the area, turned."""
    corner, u_edge, v_edge, origin = (np.float32(v) for v in ((1, 2, 3), (2, 0, 0.5), (0, 3, 0), (0.5, 1, -2)))
    if kind == "disk":
        v_edge = v_edge / 3 * np.linalg.norm(u_edge)
    normal = np.cross(v_edge, u_edge).astype(np.float32)  # on the side of the origin
    normal /= np.linalg.norm(normal)
    place = np.random.default_rng(4).random((1 << 18, 2), np.float32)
    a, u, v, n, o = (f"vec3{tuple(x.tolist())}" for x in (corner, u_edge, v_edge, normal, origin))
    body = f"""
        AreaLight light = AreaLight({a}, 2.5, {u}, {KINDS[kind]}, {v}, 17, {n}, vec3(1.0, 2.0, 3.0));
        LightSample s = area_light_sample(light, {o}, place);
        point = vec4(s.wi, s.distance); said = s.pdf; radiance = s.radiance;
        what = vec2(float(s.primitive), float(s.delta));
        pdf = area_light_pdf(2.5, s.distance, 0.4);"""
    outputs = {"point": 4, "said": 1, "radiance": 3, "what": 2, "pdf": 1}
    result = probe(ctx, ["light/area.glsl"], body, {"place": place}, outputs)
    wi, distance = result["point"][:, :3].astype(np.float64), result["point"][:, 3].astype(np.float64)
    found = origin + distance[:, None] * wi - corner
    inside = found @ np.linalg.pinv(np.stack([u_edge, v_edge]).astype(np.float64))
    if kind == "disk":
        assert np.linalg.norm(inside, axis=1).max() < 1 + 2e-6
        points = inside / np.maximum(1, np.linalg.norm(inside, axis=1) + 1e-9)[:, None]
    else:
        assert np.abs(inside - np.clip(inside, 0, 1)).max() < 2e-6
        points = np.clip(inside, 0, 1 - 1e-9)
    if kind == "triangle":
        assert points.sum(1).max() < 1 + 2e-6
        points /= np.maximum(1, points.sum(1) + 1e-9)[:, None]
    domain, density = {
        "rectangle": (domains.Box(), 1.0),
        "disk": (domains.Disk(), 1 / np.pi),
        "triangle": (domains.Triangle(), 2.0),
    }[kind]
    assert_fits({kind: fit(domain, points, lambda points: np.full(len(points), density))})
    np.testing.assert_allclose(result["pdf"], distance**2 / (0.4 * 2.5), rtol=1e-6)
    cosine = -wi @ normal.astype(np.float64)
    assert (cosine > 0).all()
    np.testing.assert_allclose(result["said"], distance**2 / (cosine * 2.5), rtol=1e-5)
    assert (result["radiance"] == (1, 2, 3)).all()
    assert (result["what"] == (17, 0)).all()


@pytest.mark.parametrize("kind", FLATS)
def test_density_of_an_area_integrates_to_one(ctx: moderngl.Context, kind: str) -> None:
    """Over the directions in which the shader's own intersection meets it; and it is 0 from behind."""
    shapes = {"rectangle": {"rectangles": (CEILING,)}, "disk": {"disks": (HATCH,)}, "triangle": {"triangles": (GABLE,)}}
    scene = lit_by(**shapes[kind])
    packed = packed_lights(scene)
    (shape,) = shapes_of(scene)
    a, b, c = corners_of(shape)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    for side in (1, -1):
        origin = a + (b - a) * 0.3 + (c - a) * 0.3 + side * 0.6 * normal
        axis = tuple((-side * normal).tolist())
        rng = np.random.default_rng(7)
        count = 1 << 18
        s, t = rng.random((2, count))
        wi, _ = domains.Cone(axis).place(s, t)  # uniform over the hemisphere that looks at it
        body = """
            Hit hit = scene_intersect(Ray(o, d), INFINITE_DISTANCE, NO_PRIMITIVE, false);
            if (hit.primitive != NO_PRIMITIVE) {
                Surface s = surface_at(Ray(o, d), hit);
                pdf = light_pdf(s.light, o, hit.distance, -dot(s.normal, d), 0.0);
            }"""
        inputs = {"o": np.broadcast_to(origin - packed.origin, (count, 3)), "d": wi}
        pdf = 2 * np.pi * scene_probe(ctx, packed, LIGHT, body, inputs, {"pdf": 1})["pdf"]
        if side == 1:
            assert abs(pdf.mean() - 1) < 4 * pdf.std() / np.sqrt(count)
            assert pdf.std() / np.sqrt(count) < 0.01
        else:
            assert not pdf.any()
