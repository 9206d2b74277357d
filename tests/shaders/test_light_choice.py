# SPDX-License-Identifier: MIT
"""light/: which light is chosen, by power and by a tree, and how often."""

from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.gpu.specialise import Level
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.lights import FEW_LIGHTS, LightKind
from fragtracer.resources import folder
from fragtracer.scene import Light, Material, Scene

from . import Floats
from .chi_square import assert_uniform
from .scene_probe import camera_on, light_numbers, random_scene, scene_probe

LIGHT = ["light/light.glsl"]


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
