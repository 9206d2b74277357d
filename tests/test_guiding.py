# SPDX-License-Identifier: MIT
"""Guiding changes the noise alone: with any lobes whatever, and with those that photons teach."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from agreement import assert_agree, assert_mean
from mesh_shapes import geometry
from numpy.typing import NDArray
from rendering import ESTIMATORS, batches, rendered
from scene_builders import box, lambert, rectangle
from test_furnace import AMBIENT, EMISSION, INSIDE, furnace, glowing_shapes_apart

from fragtracer import guiding
from fragtracer.guiding import Decision, Guide, guide, learn
from fragtracer.guiding.decision import _Sampled, measure
from fragtracer.guiding.lobes import LOBES, Lobes, fit
from fragtracer.guiding.photons import Photons, PhotonTracer
from fragtracer.io.toml import load
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.shapes import Kind
from fragtracer.packing.targets import targets_of
from fragtracer.renderer import Renderer
from fragtracer.scene import (
    Ambient,
    Camera,
    Disk,
    Environment,
    Light,
    Material,
    Mesh,
    Panorama,
    Part,
    Plane,
    RenderSettings,
    Scene,
    Sphere,
)

ALBEDO = (0.3, 0.5, 0.8)


def any_lobes() -> Guide:
    """Lobes of all widths and weights that aim anywhere, in cells of both levels, about a box of 2 m."""
    rng = np.random.default_rng(5)
    edges = np.tile([1, 2, 4, 1], 2)
    cells = int((edges**3).sum())
    lobes = Lobes(
        low=np.full(3, -1.1),
        edge=1.1,
        size=np.array([2, 2, 2]),
        first=np.cumsum(edges**3) - edges**3,
        edges=edges,
        points=rng.uniform(-1.5, 1.5, (cells, LOBES, 3)),
        widths=10 ** rng.uniform(-1.5, 0.5, (cells, LOBES)),
        ratios=10 ** rng.uniform(-2, 0.5, (cells, LOBES)) * (rng.random((cells, LOBES)) < 0.8),
    )
    return Guide(lobes, np.zeros(3))


def guide_by_any(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have renderers guide by :func:`any_lobes`."""
    monkeypatch.setattr("fragtracer.guiding.decide", lambda *_, **__: Decision(any_lobes(), "on"))


@pytest.mark.parametrize("estimator", ["bsdf", "mis"])
def test_furnace(ctx: Any, monkeypatch: pytest.MonkeyPatch, estimator: str) -> None:
    """Le / (1 - albedo)."""
    guide_by_any(monkeypatch)
    image = rendered(ctx, furnace(ALBEDO), 512, bounces=1000, estimator=estimator)
    assert_mean(image, np.divide(EMISSION, np.subtract(1, ALBEDO)), 0.02)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_glowing_shapes_in_ambient_light(ctx: Any, monkeypatch: pytest.MonkeyPatch, estimator: str) -> None:
    guide_by_any(monkeypatch)
    image = rendered(ctx, glowing_shapes_apart(ALBEDO), 512, bounces=1000, estimator=estimator)
    assert_mean(image, AMBIENT, 0.01)


def test_coats_and_lamps(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A box of smooth plastic, whose reflections are deltas beside a matte base, around a lamp and a ball of gold."""
    materials = {"coat": Material(albedo=ALBEDO, roughness=0.0), "gold": Material(metal="gold", roughness=0.5)}
    scene = Scene(
        INSIDE,
        materials,
        rectangles=box("coat"),
        spheres=[Sphere((-0.1, -0.5, -0.3), 0.4, "gold")],
        lights=[Light((0.4, 0.5, 0.1), 0.3, power=100.0)],
    )
    unguided = batches(ctx, scene, 512, range(4), bounces=4)
    guide_by_any(monkeypatch)
    assert_agree(batches(ctx, scene, 512, range(10, 14), bounces=4), unguided, 0.02)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_learned_lobes_keep_the_mean(ctx: Any, estimator: str) -> None:
    # Lights are merely met by chance by "bsdf": few of many samples, which adaptive sampling would take for none.
    scene, chance = load("three-spheres"), estimator == "bsdf"
    settings = {"size": (48, 32), "adaptive": "off" if chance else "on"}
    guided = batches(ctx, scene, 2048 if chance else 256, range(10, 14), estimator=estimator, guiding="on", **settings)
    unguided = batches(ctx, scene, 256, range(4), **settings)
    assert_agree(guided, unguided, 0.04 if estimator == "bsdf" else 0.01)


def test_photons_do_not_depend_on_the_view(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor are they traced again for another one, or for other settings; they are for another material."""
    scene = load("three-spheres")
    guide = learn(ctx, scene)
    other = replace(scene, camera=Camera((9.0, 8.0, -7.0), (0.0, 0.0, 0.0)), render=replace(scene.render, seed=3))
    monkeypatch.setattr("fragtracer.guiding.guide.cached", lambda kind, key, make, doing: make())
    again = learn(ctx, other)
    assert guide is not None
    assert again is not None
    for name, value in vars(guide.lobes).items():
        np.testing.assert_array_equal(getattr(again.lobes, name), value, name)
    assert guiding.same_light(scene, other)
    assert not guiding.same_light(scene, replace(scene, ambient=Ambient(1.0)))


def test_same_seed_same_bits(ctx: Any) -> None:
    """However the passes are cut."""
    images = [rendered(ctx, load("three-spheres"), 16, (48, 32), guiding="on", rays=rays) for rays in (1, 16)]
    np.testing.assert_array_equal(*images)


def decide_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """And as software renderers do: GPUs learn nothing for pictures as small as those of tests."""
    monkeypatch.setattr("fragtracer.guiding.decision.cached", lambda kind, key, make, doing: make())
    monkeypatch.setattr("fragtracer.guiding.decision.is_software", lambda _: True)


def test_guiding_pays_for_caustics(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The measurement says so, and the picture too: half of the variance at least."""
    decide_anew(monkeypatch)
    scene, settings = load("three-spheres"), {"size": (64, 36), "seeds": range(8), "spp": 256}
    with Renderer(scene, (64, 36), context=ctx, spp=2**16, light_tracing="off") as renderer:
        assert renderer.metadata()["guiding_decision"].startswith("on: the variance falls by")
    variances = []
    for choice in ("on", "off"):
        images = batches(ctx, scene, guiding=choice, **settings).astype(np.float64)
        brightness = np.square(images.mean((0, 3))) + 1e-2 * np.square(images.mean())
        variances.append((images.var(0, ddof=1).mean(-1) / brightness).mean())
    assert variances[0] < 0.5 * variances[1]


def measured(ctx: Any, monkeypatch: pytest.MonkeyPatch, name: str) -> tuple[float, float]:
    """By what the variance of a scene is said to fall, and the time of a sample to rise, where that pays."""
    decide_anew(monkeypatch)
    with Renderer(load(name), (96, 54), context=ctx, spp=2**14, light_tracing="off") as renderer:
        said = renderer.metadata()["guiding_decision"]
    found = re.fullmatch(r"on: the variance falls by (\S+), the time of a sample rises by (\S+)", said)
    assert found is not None
    return float(found[1]), float(found[2])


def measurements_of_caustic(ctx: Any, monkeypatch: pytest.MonkeyPatch, seeds: int, least: float = 1.15) -> np.ndarray:
    """The gain and the cost of guiding it (seeds, 2), as :func:`measure` finds them."""
    monkeypatch.setattr("fragtracer.guiding.decision.cached", lambda kind, key, make, doing: make())
    scene = load("caustic")
    guide = learn(ctx, scene)
    assert guide is not None
    settings = replace(scene.render, width=96, height=54, spp=2**14)
    return np.array([measure(ctx, scene, replace(settings, seed=seed), guide, {}, least) for seed in range(seeds)])


def test_what_guiding_does_not_find_counts(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """64 samples say that it divides the variance of caustic by 17, and 256 by 11, but the more there are, the less it
    does. Single seeds say 2 to 25."""
    gain, cost = np.median(measurements_of_caustic(ctx, monkeypatch, 7), axis=0)
    assert 1.5 < gain < 5
    assert gain > 1.15 * cost, "it pays"


def test_guided_paths_are_longer(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """On caustic they go through the glass; the first 64 samples of a pixel tell."""
    ((_, cost),) = measurements_of_caustic(ctx, monkeypatch, 1, least=100.0)
    assert cost > 1.65  # a guided ray is taken to cost 1.5 of another


def test_a_short_picture_is_worth_a_short_measurement(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A sixteenth of its samples at most, but 256 of a pixel of the small picture."""
    decide_anew(monkeypatch)
    scene = load("three-spheres")
    guide = learn(ctx, scene)
    assert guide is not None
    asked: list[int] = []

    def sampled(tracer: Any, film: Any, samples: int) -> _Sampled:
        asked.append(samples)
        return _Sampled(gain=2.5, left=1.0, rays=1.0)  # more than the 1.7 that are needed, but not clearly

    monkeypatch.setattr("fragtracer.guiding.decision._sampled", sampled)
    for spp, samples in ((2**14, [64, 64, 192, 768]), (2**14 - 1, [64, 64, 192])):
        measure(ctx, scene, replace(scene.render, width=96, height=54, spp=spp), guide, {})
        assert asked == samples
        asked.clear()


def test_stratification_counts(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """To choose between lobes and BSDF adds to the variance of a sample of three-spheres-ambient, which stratified
    samples do not have: pictures of 512 samples have 5.7 times less variance, and not 1.5 times."""
    gain, _ = measured(ctx, monkeypatch, "three-spheres-ambient")
    assert 4 < gain < 10


def test_photons_bring_what_mirrors_reflect(ctx: Any) -> None:
    """All of it, to a ceiling: the lamp's power by the solid angle of each mirror, whatever is aimed at it. A half of a
    mesh is there, and the back of a front is not; of a wall it is what goes up and is not far away."""
    lamp, height = np.array([0.2, 4.0, 0.1]), 6.0
    silver = Material(albedo=0.8, metallic=1.0, roughness=0.0)
    materials = {"silver": silver, "sieve": replace(silver, opacity=0.5, alpha_mode="blend"), "ceiling": lambert(0.5)}
    materials["back"] = replace(silver, double_sided=False)
    corners = np.array([[-1.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.0, 0.0, 1.5], [-1.0, 0.0, 1.5]])
    scene = Scene(
        Camera((0.0, 1.0, 9.0), (0.0, 1.0, 0.0)),
        materials,
        planes=[Plane((-10.0, 0.0, 0.0), (1.0, 0.0, 0.0), "silver")],
        rectangles=[
            rectangle((1.0, 0.0, -0.5), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), "silver"),
            rectangle((-1.0, 0.0, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), "back"),
            rectangle((0.0, height, 0.0), (40.0, 0.0, 0.0), (0.0, 0.0, 40.0), "ceiling"),
        ],
        disks=[Disk((0.0, 0.0, -2.0), (0.0, 1.0, 0.0), 0.5, "silver")],
        meshes=[Mesh((Part(geometry((corners, np.array([[0, 1, 2], [0, 2, 3]]))), "sieve"),))],
        lights=[Light(tuple(lamp), 0.05, power=100.0)],
    )
    packed = pack(scene, RenderSettings(), 8, 8)
    targets = targets_of(packed, scene, reach=12.0)
    weights = np.random.default_rng(4).uniform(0.5, 2.0, len(targets)) * np.where(targets.kind == Kind.TRIANGLE, 64, 1)
    tracer = PhotonTracer(ctx, packed)
    try:
        photons = tracer.trace(targets, weights, range(4))
    finally:
        tracer.release()

    def reflected(places: NDArray[np.float64], area: float, distance: float = lamp[1]) -> float:
        """Of a flat mirror at a ``distance`` from the lamp, by points (n, 3) spread evenly over it."""
        squared = np.square(places - lamp).sum(axis=1)
        return float(0.8 * 100 / (4 * np.pi) * area * (distance / squared**1.5).mean())

    u, v = ((np.indices((200, 200)) + 0.5) / 200).reshape(2, -1)
    square = np.stack([u - 0.5, np.zeros_like(u), v - 0.5], axis=1)
    turn = np.stack([np.cos(2 * np.pi * v), np.zeros_like(v), np.sin(2 * np.pi * v)], axis=1)
    wanted = [
        reflected(square + np.array([1.0, 0.0, -0.5]), 1.0),
        reflected(0.5 * np.sqrt(u)[:, None] * turn + np.array([0.0, 0.0, -2.0]), np.pi / 4),
        0.5 * reflected(square + np.array([-0.5, 0.0, 1.0]), 1.0),
        reflected(np.stack([np.full_like(u, -10.0), 5.0 + 0.9 * u, 10.0 * v - 5.0], axis=1), 9.0, 10.2),
    ]
    learned = guide._photons(ctx, packed, targets)  # of a pilot and of what is sent by it
    assert learned is not None
    for found in (photons, learned):
        np.testing.assert_allclose(found.receiver[:, 1] + packed.origin[1], height, atol=1e-4)
        x, y, z = (found.source + packed.origin).T
        is_wall = x < -9.9
        is_counted = (found.group % 2 == 0) & (~is_wall | ((y > 5.0) & (y < 5.9) & (np.abs(z) < 5.0)))
        which = np.select([is_wall, z < -1.4, x > 0.4], [3, 1, 0], 2)
        flux, variance = (np.bincount(which, found.flux**power * is_counted) for power in (1, 2))
        assert (np.abs(flux - wanted) < 4 * np.sqrt(variance) + 3e-4 * flux).all()
        assert [len(np.unique(found.group[is_counted & (which == i)])) for i in range(4)] == [1, 1, 2, 1]


def test_too_few_photons_teach_nothing(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """One or two, of which a lobe has no width."""
    monkeypatch.setattr("fragtracer.guiding.guide.cached", lambda kind, key, make, doing: make())
    receiver = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    source = receiver + np.array([0.0, 1.0, 0.0])
    found = Photons(receiver, source, np.ones(2), np.array([0, 1]), np.array([0, 2]), np.ones(2))
    assert fit(found) is None
    monkeypatch.setattr("fragtracer.guiding.guide._photons", lambda *_: found)
    assert learn(ctx, load("three-spheres")) is None


def test_lobes_do_not_depend_on_units() -> None:
    """Of length or power, also where no other light arrives; their ratios are float32, and so is the sum of them."""
    rng = np.random.default_rng(0)
    receiver, source = rng.uniform(size=(2, 8000, 3)) * [[[1, 0, 1]], [[1, 1, 1]]] + [[[0, 0, 0]], [[0, 2, 0]]]
    flux, group, nothing = rng.uniform(size=8000), rng.integers(0, 6, 8000), np.zeros(8000)
    found = Photons(receiver, source, flux, group // 2, group, nothing)
    ratios = []
    for length, power in ((1.0, 1.0), (2.0**-10, 1.0), (1.0, 2.0**40)):
        lobes = fit(replace(found, receiver=length * receiver, source=length * source, flux=power * found.flux))
        assert lobes is not None
        ratios.append(lobes.ratios)
    assert ratios[0].max() < 1e20
    for other in ratios[1:]:
        np.testing.assert_allclose(other, ratios[0], rtol=1e-6)


def test_photons_come_from_an_even_sky(ctx: Any) -> None:
    """Which is no light to paths, for BSDF sampling finds it: photons are of light samples alone."""
    scene = replace(load("three-spheres-ambient"), lights=(), ambient=Ambient(), environment=Environment(radiance=1.0))
    assert not pack(scene, scene.render, 8, 8).uniforms["u_light_count"]
    assert learn(ctx, scene) is not None


def test_a_lamp_behind_a_pane_teaches_nothing(ctx: Any) -> None:
    """Rays to it pass the pane. Those to a sky do not know where there is one."""
    pane = rectangle((0.0, 1.0, 0.0), (0.0, 0.0, 2.0), (2.0, 0.0, 0.0), "pane")
    floor = rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 4.0), (4.0, 0.0, 0.0), "floor")
    scene = Scene(
        materials={"pane": Material(model="thin-dielectric"), "floor": lambert(0.5)},
        rectangles=[pane, floor],
        lights=[Light((0.0, 3.0, 0.0), 0.2, power=100.0)],
    )
    assert learn(ctx, scene) is None
    assert learn(ctx, replace(scene, lights=(), environment=Environment(radiance=1.0))) is not None


def test_a_large_sky_is_made_smaller_to_learn_from(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []

    def no_targets(packed: PackedScene, *_: object, **__: object) -> list[object]:
        assert packed.environment is not None
        sizes.append(packed.environment.size)
        return []

    monkeypatch.setattr("fragtracer.guiding.guide.targets_of", no_targets)
    monkeypatch.setattr("fragtracer.guiding.guide.cached", lambda kind, key, make, doing: make())
    sky = Environment(image=Panorama(np.ones((2, 4096, 3), np.float32)))
    assert learn(ctx, replace(load("three-spheres"), environment=sky)) is None
    assert sizes == [(2048, 1)]


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"guiding": "off"}, "as asked for"),
        ({"bounces": 1}, "one bounce"),
        ({"spp": 64}, "less time than to learn"),
        ({"integrator": "split-sum"}, "split-sum"),
    ],
)
def test_what_is_not_guided_says_why(ctx: Any, changed: dict[str, Any], reason: str) -> None:
    with Renderer(load("three-spheres"), (8, 8), context=ctx, **changed) as renderer:
        assert reason in renderer.metadata()["guiding_decision"]


def test_matte_scenes_trace_no_photons(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fragtracer.guiding.decision.learn", lambda *_: pytest.fail("photons were traced"))
    scene = Scene(Camera(), {"chalk": lambert(0.5)}, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "chalk")])
    with Renderer(scene, (8, 8), context=ctx) as renderer:
        assert "narrowly" in renderer.metadata()["guiding_decision"]


@pytest.mark.parametrize(
    ("size", "measured"), [((640, 360), (96, 54)), ((1080, 1920), (54, 96)), ((10, 4000), (1, 96)), ((1, 1), (96, 96))]
)
def test_what_is_measured_is_small(size, measured):
    assert guiding.measured_size(RenderSettings(width=size[0], height=size[1])) == measured
