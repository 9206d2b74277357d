# SPDX-License-Identifier: MIT
"""Guiding changes the noise alone: with any lobes whatever, and with those that photons teach."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from agreement import assert_agree, assert_mean
from rendering import ESTIMATORS, batches, rendered
from scene_builders import box, lambert
from test_furnace import AMBIENT, EMISSION, INSIDE, furnace, glowing_shapes_apart

from fragtracer import guiding
from fragtracer.guiding import Decision, Guide, learn
from fragtracer.guiding.lobes import LOBES, Lobes, fit
from fragtracer.guiding.photons import Photons
from fragtracer.guiding.targets import targets_of
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import Ambient, Camera, Geometry, Light, Material, Mesh, Part, Placement, Scene, Sphere

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
    monkeypatch.setattr("fragtracer.guiding.decide", lambda *_: Decision(any_lobes(), "on"))


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
    monkeypatch.setattr("fragtracer.guiding.guide.cached", lambda kind, key, make: make())
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


def test_guiding_pays_for_caustics(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The measurement says so, and the picture too: half of the variance at least."""
    monkeypatch.setattr("fragtracer.guiding.decision.cached", lambda kind, key, make: make())
    scene, settings = load("three-spheres"), {"size": (64, 36), "seeds": range(8), "spp": 256}
    with Renderer(scene, (64, 36), context=ctx, spp=8192, light_tracing="off") as renderer:
        assert renderer.metadata()["guiding_decision"].startswith("on: the variance falls by")
    variances = []
    for choice in ("on", "off"):
        images = batches(ctx, scene, guiding=choice, **settings).astype(np.float64)
        brightness = np.square(images.mean((0, 3))) + 1e-2 * np.square(images.mean())
        variances.append((images.var(0, ddof=1).mean(-1) / brightness).mean())
    assert variances[0] < 0.5 * variances[1]


def test_what_guiding_does_not_find_counts(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Few samples say that it divides the variance of caustic by 12, but the more there are, the less it does; and
    guided paths go through the glass and are longer."""
    monkeypatch.setattr("fragtracer.guiding.decision.cached", lambda kind, key, make: make())
    with Renderer(load("caustic"), (96, 54), context=ctx, spp=8192, light_tracing="off") as renderer:
        said = renderer.metadata()["guiding_decision"]
    found = re.fullmatch(r"off: the variance would fall by \S+, the time of a sample rise by (\S+)", said)
    assert found is not None
    assert float(found[1]) > 1.65  # a guided ray is taken to cost 1.5 of another


def test_photons_are_aimed_at_quarters_of_meshes() -> None:
    """Each triangle of each instance lies in one of the bounding spheres, which are smaller than the mesh."""
    corners = np.float64([[[i, 0, 0], [i + 1, 0, 0], [i, 0, 1]] for i in range(8)])
    placements = (Placement(), Placement(translation=(0.0, 5.0, 0.0), scale=(2.0, 1.0, 1.0)))
    for count, expected in ((8, 4), (3, 3), (1, 1)):
        geometry = Geometry(corners[:count].reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
        mesh = Mesh((Part(geometry, "matte"),), placements)
        targets = targets_of(Scene(materials={"matte": Material()}, meshes=[mesh]))
        assert len(targets) == 2 * expected
        assert (targets[:, 3] < 0).all()  # chords begin inside
        for matrix, _ in mesh.placed():
            placed = corners[:count] @ matrix[:3, :3].T + matrix[:3, 3]
            off = np.linalg.norm(placed[:, None] - targets[:, None, :3], axis=-1).max(axis=2)
            assert (off <= 1.0001 * -targets[:, 3]).any(axis=1).all()
            assert (-targets[:, 3]).max() < np.ptp(placed[..., 0]) / 2 or count == 1


def test_too_few_photons_teach_nothing(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """One or two, of which a lobe has no width."""
    monkeypatch.setattr("fragtracer.guiding.guide.cached", lambda kind, key, make: make())
    receiver = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    source = receiver + np.array([0.0, 1.0, 0.0])
    found = Photons(receiver, source, np.ones(2), np.array([0, 2]), np.ones(2))
    assert fit(found) is None
    monkeypatch.setattr("fragtracer.guiding.guide._photons", lambda *_: found)
    assert learn(ctx, load("three-spheres")) is None


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
