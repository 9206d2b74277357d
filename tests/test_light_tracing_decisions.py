# SPDX-License-Identifier: MIT
"""Light is traced from the lights where that pays and where photons can bring all of it, and what decides is said."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from mesh_shapes import ball
from rendering import batches
from scene_builders import lambert, rectangle
from test_light_tracing import FLOOR, LAMP, LENS, MATERIALS, SIZE, spheres

from fragtracer import guiding, light_tracing
from fragtracer.io.toml import load
from fragtracer.light_tracing import decision
from fragtracer.light_tracing.decision import Measurement
from fragtracer.light_tracing.tracer import PHOTONS
from fragtracer.renderer import Renderer
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import (
    Camera,
    Disk,
    Environment,
    Fog,
    Geometry,
    Light,
    Material,
    Medium,
    Mesh,
    Part,
    Placement,
    RenderSettings,
    Scene,
    Sky,
    Sphere,
)


def test_it_is_used_where_it_pays(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The measurement says so, and the pictures too: a third of the variance at most."""
    monkeypatch.setattr("fragtracer.light_tracing.decision.cached", lambda kind, key, make, doing: make())
    for module in ("guiding", "light_tracing"):  # as software renderers: GPUs measure nothing for so small pictures
        monkeypatch.setattr(f"fragtracer.{module}.decision.is_software", lambda _: True)
    scene, size = load("three-spheres"), (64, 36)
    with Renderer(scene, size, context=ctx, spp=8192, guiding="off") as renderer:
        assert renderer.metadata()["light_tracing_decision"].startswith("on: the variance falls by")
    with Renderer(scene, (48, 48), context=ctx, spp=8192) as renderer:
        assert renderer.metadata()["light_tracing_decision"].startswith("off: guiding alone promises")
        assert renderer.metadata()["guiding_decision"].startswith("on: ")
    with Renderer(load("glass"), size, context=ctx, spp=8192, guiding="off") as renderer:
        assert renderer.metadata()["light_tracing_decision"].startswith("off: the variance would fall by")
    variances = []
    for choice in ("on", "off"):
        images = batches(ctx, scene, 256, range(8), size, light_tracing=choice).astype(np.float64)
        brightness = np.square(images.mean((0, 3))) + 1e-2 * np.square(images.mean())
        variances.append((images.var(0, ddof=1).mean(-1) / brightness).mean())
    assert variances[0] < variances[1] / 3


def test_there_are_more_photons_where_they_have_the_error() -> None:
    """Of what is left in one of the two ways, and where paths are guided, which leave less."""

    def photons(share: float, gain: float = 1.0, adaptive: Literal["auto", "off"] = "auto") -> float:
        settings = RenderSettings(adaptive=adaptive)
        return Measurement(5.0, share, 5.0).promise(spheres(), settings, guiding.Decision(None, "", gain, 1.5))[0]

    assert photons(0.05) == 1 / 4
    assert photons(0.5) == 1 / 2
    assert photons(0.2) < photons(0.2, gain=5.0)
    assert photons(0.05, adaptive="off") == 1 / 8


def test_a_gpu_learns_for_more_samples_and_sends_fewer_photons(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has traced many samples by then, and photons cost more of them there."""
    scene, settings = spheres(), RenderSettings(width=256, height=256, spp=2048)
    more = replace(settings, spp=4 * settings.spp, guiding="off")
    found = {}
    for is_software in (True, False):
        for module in ("guiding", "light_tracing"):
            monkeypatch.setattr(f"fragtracer.{module}.decision.is_software", lambda _, said=is_software: said)
        found[is_software] = light_tracing.decision.measure(ctx, scene, more)
    for made in light_tracing.decide_both(ctx, scene, settings):
        assert made.reason.startswith("off: to trace the 2048 samples per pixel takes less time than to ")
    one = replace(settings, guiding="off")
    for enough in ((more, 1), (one, 4)):
        assert not light_tracing.decide_both(ctx, scene, *enough)[0].reason.startswith("off: to trace")
    assert light_tracing.decide_both(ctx, scene, one, 3)[0].reason.startswith("off: to trace")
    photons = [replace(one, share=0.5).promise(scene, more, guiding.Decision(None, ""))[0] for one in found.values()]
    assert photons == [1 / 2, 1 / 4]


def test_photons_that_miss_light_are_not_trusted(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that bring less than paths leave to them, beyond the errors of both; to bring more is no mistake, since
    paths may not have met it."""
    rng, size = np.random.default_rng(0), (8, 8)

    def pixels(mean: float, error: float) -> Pixels:
        means = np.concatenate([rng.normal(mean, error, (*size, 3)), np.full((*size, 1), 64.0)], axis=2)
        halves = rng.normal(0.0, error, (*size, 3))
        return Pixels(means.astype(np.float32), np.zeros_like(means, np.float32), halves.astype(np.float32))

    def misses(traced: float, noise: float, error: float = 1e-3) -> bool:
        brought = np.full((*size, 3), traced)
        return decision._misses(pixels(1.0, error), pixels(0.9, error), brought, np.full(size, noise), np.ones(size))

    assert misses(0.08, 1e-6)
    assert not misses(0.1, 1e-6)
    assert not misses(0.3, 1e-6)
    assert not misses(0.08, 1e-2)
    assert not misses(0.08, 1e-6, 0.2)
    monkeypatch.setattr(decision, "_measured", lambda *_: (0.0, 0.0))
    monkeypatch.setattr(decision, "cached", lambda kind, key, make, doing: make())
    settings = RenderSettings(spp=2**16)
    assert decision.decide(ctx, spheres(), settings).reason == "off: photons find less of the light than paths do"


def test_a_measurement_promises_what_it_has_found() -> None:
    """With the number of photons that it was made with, evenly sampled and unguided."""
    settings, nothing = RenderSettings(adaptive="off"), guiding.Decision(None, "")
    photons, gain, cost = Measurement(3.0, 0.1, 5.0).promise(spheres(), settings, nothing)
    assert (photons, gain) == (1 / 8, pytest.approx(3.0))
    pair = 2 * PHOTONS / (640 * 480 * 256)  # of passes that aim the others
    assert cost == pytest.approx(1.05 + 5 * (1 / 8 + pair))


def test_a_small_picture_has_two_passes_of_photons() -> None:
    """And as many that aim them, which cost more there than its samples."""
    settings = RenderSettings(width=64, height=64, spp=16, adaptive="off")
    _, gain, cost = Measurement(3.0, 0.1, 5.0).promise(spheres(), settings, guiding.Decision(None, ""))
    pair = 2 * PHOTONS / (64 * 64 * 16)
    assert gain == pytest.approx(3.0 / (0.9 + 0.1 / 8 / pair))
    assert cost == pytest.approx(1.05 + 5 * 2 * pair)


GLASS = Material(model="dielectric", ior=1.5)
FRONT = Material(metal="gold", roughness=0.6, double_sided=False)
GOLDEN = Sphere((0.0, 0.0, 0.0), 0.3, "gold")
PASSED = "light passes a surface that is met from its front alone"


def around(center: tuple[float, float, float], radius: float, is_turned: bool = False, material: str = "front") -> Mesh:
    """A closed mesh whose front is outside, or, if it is turned inside out, inside."""
    positions, triangles = ball(12, 6)
    part = Part(Geometry(positions, triangles[:, ::-1] if is_turned else triangles), material)
    return Mesh((part,), (Placement(center, scale=(radius,) * 3),))


def joined(*meshes: Mesh) -> Mesh:
    """One part with the triangles of all."""
    placed = [(matrix, part) for mesh in meshes for matrix, part in mesh.placed()]
    positions = [part.geometry.positions @ matrix[:3, :3].T + matrix[:3, 3] for matrix, part in placed]
    first = np.cumsum([0, *map(len, positions)])
    triangles = [part.geometry.triangles + start for (_, part), start in zip(placed, first[:-1], strict=True)]
    return Mesh((Part(Geometry(np.concatenate(positions), np.concatenate(triangles)), placed[0][1].material),))


def box(low: float, high: float) -> list[Any]:
    """The six faces of a cube of glass about the y axis, their fronts outside."""
    middle, edge = (low + high) / 2, high - low
    axes = np.eye(3)
    faces = [(sign * axes[i], axes[i - 2], sign * axes[i - 1]) for i in range(3) for sign in (-1, 1)]
    return [
        rectangle(np.array((0.0, middle, 0.0)) + edge / 2 * normal, edge * u, edge * v, "glass")
        for normal, u, v in faces
    ]


IN_GLASS = "a light is, or may be, inside of a dielectric"
OPEN_GLASS = "what bounds a dielectric is not closed"
BALL = Sphere((0.0, 0.6, 0.0), 0.5, "glass")
BULBS = [around((x, 0.6, 0.0), 0.1, material="lamp") for x in (-0.9, 0.9, 0.3)]
BOTTLE = joined(around((0.0, 0.6, 0.0), 0.5, material="glass"), around((0.0, 0.6, 0.0), 0.4, True, "glass"))


@pytest.mark.parametrize(
    ("scene", "settings", "reason"),
    [
        (spheres(), {"light_tracing": "off"}, "as asked for"),
        (spheres(), {"bounces": 1}, "one bounce"),
        (spheres(), {"spp": 64}, "less time than to measure"),
        (spheres(), {"integrator": "split-sum"}, "split-sum"),
        (spheres(), {"light_tracing": "on"}, "on: as asked for"),
        (Scene(LENS, {"floor": MATERIALS["floor"]}, planes=[FLOOR]), {}, "narrowly"),
        (Scene(LENS, {"floor": Material(model="thin-dielectric", ior=1.0)}, planes=[FLOOR]), {}, "narrowly"),
        (replace(spheres(), camera=Camera((0.0, 0.4, -0.3), (0.0, 0.4, 0.0))), {}, "inside of a mirror"),
        (
            replace(spheres(), media={"air": Medium(scattering=0.1, absorption=0.0)}, fog=Fog("air")),
            {"light_tracing": "on"},
            "medium",
        ),
        *(
            (Scene(LENS, {**MATERIALS, "front": FRONT}, **shapes), {"light_tracing": "on"}, reason)
            for shapes, reason in (
                ({"planes": [replace(FLOOR, material="front")]}, PASSED),
                ({"meshes": [around((0.0, 0.0, 0.0), 1.0)]}, "on: as asked for"),
                ({"meshes": [around(LENS.position, 1.0)]}, PASSED),
                ({"meshes": [around((0.0, 0.0, 0.0), 1.0)], "spheres": [GOLDEN]}, PASSED),
                ({"meshes": [around((0.0, 0.0, 0.0), 9.0, True)], "spheres": [GOLDEN]}, "on: as asked for"),
                ({"meshes": [around((0.0, 0.0, 0.0), 1.0, True)], "spheres": [GOLDEN]}, PASSED),
                ({"meshes": [around(LENS.position, 1.0, True)], "spheres": [GOLDEN]}, PASSED),
                ({"spheres": [Sphere((0.0, 0.0, 0.0), 1.0, "front")]}, "on: as asked for"),
                ({"spheres": [Sphere(LENS.position, 1.0, "front")]}, PASSED),
                ({"spheres": [Sphere((0.0, 0.0, 0.0), 1.0, "front"), GOLDEN]}, PASSED),
            )
        ),
        (
            Scene(
                LENS,
                {**MATERIALS, "front": replace(FRONT, diffuse_transmission=0.5)},
                meshes=[around((0.0, 0.0, 0.0), 1.0)],
            ),
            {"light_tracing": "on"},
            PASSED,
        ),
        (
            Scene(LENS, {"glass": GLASS}, spheres=[Sphere(LENS.position, 1.0, "glass")]),
            {"light_tracing": "on"},
            "the camera is inside",
        ),
        (
            Scene(LENS, {"glass": GLASS}, spheres=[Sphere(LAMP.position, 1.5, "glass")], lights=[LAMP]),
            {"light_tracing": "on"},
            IN_GLASS,
        ),
        *(
            (Scene(LENS, {**MATERIALS, "glass": GLASS}, **things), {"light_tracing": "on"}, reason)
            for things, reason in (
                ({"spheres": [BALL], "lights": [Light((0.65, 0.6, 0.0), 0.2, power=1.0)]}, IN_GLASS),
                ({"spheres": [BALL], "lights": [Light((0.45, 1.05, 0.0), 0.1, power=1.0)]}, "on: as asked for"),
                (
                    {"spheres": [BALL], "rectangles": [rectangle((0.9, 0.6, 0.0), (2, 0, 0), (0, 0, 0.2), "lamp")]},
                    IN_GLASS,
                ),
                ({"spheres": [BALL], "meshes": [joined(*BULBS[:2])]}, "on: as asked for"),
                ({"spheres": [BALL], "meshes": [joined(*BULBS)]}, IN_GLASS),
                ({"meshes": [BOTTLE], "lights": [Light((0.0, 0.6, 0.0), 0.2, power=1.0)]}, "on: as asked for"),
                ({"meshes": [BOTTLE], "lights": [Light((0.45, 0.6, 0.0), 0.2, power=1.0)]}, IN_GLASS),
                ({"meshes": [around((0.0, 0.6, 0.0), 0.5, True, "glass")]}, OPEN_GLASS),
                ({"rectangles": box(0.1, 0.8)}, "on: as asked for"),
                ({"rectangles": box(0.1, 0.8)[1:]}, OPEN_GLASS),
                ({"disks": [Disk((0.0, 1.0, 0.0), (0.0, 1.0, 0.0), 0.5, "glass")]}, OPEN_GLASS),
            )
        ),
        (
            Scene(
                LENS, {"glass": GLASS}, planes=[replace(FLOOR, material="glass")], environment=Environment(sky=Sky())
            ),
            {"light_tracing": "on"},
            "light from afar is inside",
        ),
    ],
)
def test_what_decides_is_said(ctx: Any, scene: Scene, settings: dict[str, Any], reason: str) -> None:
    small = RenderSettings(width=8, height=8, guiding="off")
    assert reason in light_tracing.decision.decide(ctx, scene, replace(small, **settings)).reason


def test_a_camera_that_moves_into_glass_sees_paths_alone(ctx: Any) -> None:
    """The light that photons would bring is that of paths there, as in a picture of its own."""
    ball = Sphere((-1.5, 0.6, 0.5), 0.5, "glass")
    scene = Scene(LENS, {"floor": lambert(0.5), "glass": GLASS}, planes=[FLOOR], spheres=[ball], lights=[LAMP])
    within = replace(scene, camera=Camera(ball.center, (0.0, 0.4, 0.0)))
    settings = {"light_tracing": "on", "guiding": "off", "adaptive": "off"}
    images = []
    with Renderer(scene, SIZE, context=ctx, moves=True, **settings) as renderer:
        for moved, said in ((scene, "on: as asked for"), (within, "the camera is inside"), (scene, "on: as asked for")):
            renderer.reset(moved)
            assert said in renderer.metadata()["light_tracing_decision"]
            renderer.sample(16)
            images.append(renderer.image())
    np.testing.assert_array_equal(images[0], images[2])
    for moved, image in zip((scene, within), images, strict=False):
        with Renderer(moved, SIZE, context=ctx, moves=True, **settings) as alone:
            alone.sample(16)
            # The coordinates of the first picture are others, and so are the last digits.
            assert image.mean() == pytest.approx(alone.image().mean(), rel=1e-4)


def test_layers_of_light_are_of_paths_alone(ctx: Any) -> None:
    with Renderer(spheres(), (8, 8), context=ctx, aovs=["emission"], light_tracing="on") as renderer:
        assert "layers of light" in renderer.metadata()["light_tracing_decision"]
