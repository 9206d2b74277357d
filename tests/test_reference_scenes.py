# SPDX-License-Identifier: MIT
"""Every bundled scene, and settings that change the mean image, agree with Mitsuba to better than 1 %.

docs/correctness.md (scripts/correctness.py) has these comparisons and more, with more samples and a smaller margin.
"""

from dataclasses import replace
from zlib import crc32

import numpy as np
import pytest
from agreement import assert_proved
from rendering import in_long_passes
from shaders.bsdf_models import MODELS
from shaders.light_oracle import LIGHTS
from shaders.scene_oracle import SHAPES

from fragtracer.apps.compare.rendering import render_ours, render_reference
from fragtracer.io.toml import bundled, load
from fragtracer.scene import (
    Ambient,
    Camera,
    Density,
    DirectionalLight,
    Disk,
    Fog,
    Light,
    Material,
    Medium,
    Plane,
    RenderSettings,
    Scene,
    Sphere,
    SpotLight,
)

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
pytestmark = pytest.mark.slow

# For fog and wax MEDIA has cases with less noise, and deep paths of still-life are noise for the most part.
CASES = [(name, {}) for name in bundled() if name not in ("fog", "wax", "still-life")]
CASES += [("still-life", {"bounces": 2})]
CASES += [("roughness-grid", {"geometry": term}) for term in ("smith-height-correlated", "schlick-beckmann")]
CASES += [("roughness-grid", settings) for settings in ({"geometry": "karis"}, {"multiple_scattering": True})]
CASES += [("cornell-box", {"bounces": 0}), ("three-spheres", {"bounces": 1})]
CASES += [("three-spheres-ambient", {"pixel_filter": kind}) for kind in ("tent", "gaussian")]

SIZE, BATCHES = (48, 36), 16
SPP, SPP_OF_MESHES = 1024, 256
# More where the noise would hide a difference of 1 %, fewer where that many already show it.
OTHER_SPP = {
    "behind an emitter of opacity 0.5 in fog": 2048,
    "caustic": 2048,
    "cornell-box": 2048,
    "five-lights": 1024,
    "furnace": 256,
    "knot": 1024,
    "light-size-0": 256,
    "light-size-large": 256,
    "light-size-small": 256,
    "mirror": 1280,
    "overcast": 256,
    "red-bounce": 256,
    "ring": 1024,
    "sphere-field": 128,
    "spheres-49": 1536,
    "still-life": 1536,
    "weekend": 160,
    "a disk that emits, of opacity 0.5": 4096,
    "a spot light": 4096,
    "all kinds": 2048,
    "blends": 2048,
    "conductor": 2048,
    "dielectric": 2048,
    "eon": 512,
    "half-vector": 512,
    "lights behind a pane": 1536,
    "thin-dielectric": 2048,
}

# Lamps that are met over metal and through glass by chance, and so by fewer samples if they are larger.
LARGER = {"caustic": 4, "five-lights": 3, "mirror": 2, "ring": 2}

BALLS = Scene(
    camera=Camera((0.0, 1.4, 4.0), (0.0, 0.5, 0.0), fov_degrees=35.0),
    materials={
        "matt": Material(albedo=(0.6, 0.5, 0.4), specular=0.0),
        "plastic": Material(albedo=(0.2, 0.4, 0.6), roughness=0.3),
        "gold": Material(metal="gold", roughness=0.3),
        "one-sided": Material(albedo=0.7, double_sided=False),
        "lamp": Material(albedo=0.3, emission=(8.0, 6.0, 4.0)),
        "veil": Material(albedo=0.3, emission=(8.0, 6.0, 4.0), alpha_mode="blend", opacity=0.5),
    },
    planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matt")],
    spheres=[Sphere((-0.6, 0.5, 0.0), 0.5, "plastic"), Sphere((0.6, 0.5, 0.0), 0.5, "gold")],
    render=RenderSettings(bounces=4),
)
REFLECTORS = [
    Disk((-1.2, 0.6, -0.6), (2.0, 0.0, 1.0), 0.6, "gold"),
    Disk((1.3, 0.6, -0.4), (1.0, 0.0, -1.0), 0.6, "matt"),
    Disk((0.0, 0.9, -0.8), (0.0, 0.0, 1.0), 0.5, "one-sided"),
    Disk((0.0, 0.3, 0.8), (0.0, 0.0, -1.0), 0.3, "one-sided"),
]
LAMP_ABOVE = Light((-1.0, 3.0, 2.0), 0.5, power=300.0)
LAMP = Disk((0.3, 2.2, 0.4), (-0.2, -1.0, 0.1), 0.6, "lamp")
SPOT = SpotLight((1.0, 3.0, 1.5), (-1.0, -2.5, -1.5), (40.0, 35.0, 30.0), 12.0, 25.0)
SUN = DirectionalLight((1.0, -2.0, -0.7), (3.0, 2.8, 2.5))
DISKS_AND_LIGHTS = {
    "a disk that emits, of opacity 0.5": replace(BALLS, disks=[replace(LAMP, material="veil")]),
    "disks that are lit": replace(BALLS, disks=REFLECTORS, lights=[LAMP_ABOVE]),
    "a spot light": replace(BALLS, spot_lights=[SPOT]),
    "lights behind a pane": replace(
        BALLS,
        materials=BALLS.materials | {"pane": Material(model="thin-dielectric", transmittance=(0.5, 0.8, 0.9))},
        disks=[Disk((0.0, 1.4, 0.2), (-0.2, -1.0, 0.1), 0.9, "pane")],
        lights=[LAMP_ABOVE, Light((0.5, 3.0, 1.0), 0.0, power=200.0)],
        spot_lights=[SPOT],
        directional_lights=[SUN],
    ),
}


def with_every_kind():
    """The balls with shapes and lights of every kind: of shapes one that reflects, and one that emits."""
    rng = np.random.default_rng(2)
    contents = {kind: list(model.examples.values()) for kind, model in LIGHTS.items()}
    for i, kind in enumerate(kind for kind in SHAPES if kind != "planes"):
        places = np.array([(0.8 * i - 1.2, 1.3, -0.2), (0.8 * i - 1.2, 2.6, 0.3)])
        shapes = [
            SHAPES[kind](rng, place, 0.4, name) for place, name in zip(places, ("one-sided", "lamp"), strict=True)
        ]
        contents[kind] = [*getattr(BALLS, kind), *shapes]
    return replace(BALLS, ambient=Ambient(0.3), **contents)


DISKS_AND_LIGHTS["all kinds"] = with_every_kind()

BSDFS = {
    name: replace(
        BALLS,
        materials=BALLS.materials | {"plastic": model.scene_materials[0], "gold": model.scene_materials[1]},
        lights=[LAMP_ABOVE],
        ambient=Ambient(0.2),
    )
    for name, model in MODELS.items()
    if model.scene_materials
}

GLASS_AND_PANE = {"glass": Material(model="dielectric", roughness=0.5), "pane": Material(model="thin-dielectric")}
BSDFS["blends"] = replace(
    BALLS,
    materials=BALLS.materials
    | GLASS_AND_PANE
    | {
        "plastic": replace(BALLS.materials["plastic"], blend="glass", blend_weight=0.6),
        "gold": replace(BALLS.materials["gold"], blend="pane", blend_weight=0.4),
    },
    lights=[LAMP_ABOVE],
    ambient=Ambient(0.2),
)

CLOUD = Sphere((-0.1, 0.9, 0.4), 0.6, "cloud")
SMOKE = Density(np.random.default_rng(1).random((6, 5, 4)) * 2)
SMOG = Medium(extinction=(2.0, 3.0, 5.0), albedo=(0.9, 0.8, 0.7), g=0.4)


def clouded(cloud, medium=SMOG, **changes):
    """The balls with one of a medium before them."""
    materials = BALLS.materials | {"cloud": cloud}
    media = {"smog": medium, "haze": Medium(extinction=(0.05, 0.1, 0.15), albedo=0.9, g=-0.3)}
    changed = {"lights": [LAMP_ABOVE], "spheres": [*BALLS.spheres, CLOUD]} | changes
    return replace(BALLS, materials=materials, media=media, **changed)


MEDIA = {
    "a cloud in fog": clouded(Material(model="null", interior="smog"), fog=Fog("haze")),
    "a grid": clouded(
        Material(model="null", interior="smog"),
        replace(SMOG, density=SMOKE, bounds=((-0.4, 0.6, 0.1), (0.2, 1.2, 0.6))),
        ambient=Ambient(0.5),
    ),
    "wax under a rough surface": clouded(
        Material(model="dielectric", roughness=0.6, interior="smog"), ambient=Ambient(0.5)
    ),
    "behind an emitter of opacity 0.5 in fog": clouded(
        Material(),
        Medium(extinction=(0.1, 0.2, 0.15), albedo=0.9),
        disks=[replace(LAMP, material="veil", normal=(0.2, 1.0, -0.1))],
        spheres=BALLS.spheres,
        lights=[replace(LAMP_ABOVE, position=(0.0, 3.0, -2.0))],
        fog=Fog("smog"),
    ),
}

LEVEL = 0.01 / (len(CASES) + len(DISKS_AND_LIGHTS) + len(BSDFS) + len(MEDIA))


def scene_of(name, settings):
    if name in (others := DISKS_AND_LIGHTS | BSDFS | MEDIA):
        return others[name]
    scene = load(name)
    if name in LARGER:
        lights = [replace(light, radius=LARGER[name] * light.radius) for light in scene.lights]
        scene = replace(scene, lights=lights)
    return replace(scene, render=replace(scene.render, **settings))


def spp_of(name, scene):
    if scene.render.bounces == 0:  # all noise is that of edges, and samples are cheap
        return 4 * SPP
    return OTHER_SPP.get(name, SPP_OF_MESHES if scene.meshes else SPP)


def seed_of(*case):
    """A seed of its own for each case."""
    return crc32(repr(case).encode())


@pytest.mark.parametrize(("name", "settings"), CASES, ids=[f"{n}-{list(s.values())}" for n, s in CASES])
def test_a_scene_agrees_with_the_reference(ctx, name, settings):
    assert_agreement(ctx, name, settings)


def test_without_scattering_a_scene_whose_light_is_out_of_view_is_black(ctx):
    scene = scene_of("three-spheres", {"bounces": 0})
    assert not render_reference(scene, SIZE, 64, 2, is_timed=False).pictures.any()
    assert not render_ours(scene, SIZE, 64, 2, context=ctx).pictures.any()


@pytest.mark.parametrize("name", DISKS_AND_LIGHTS)
def test_disks_and_lights_agree_with_the_reference(ctx, name):
    assert_agreement(ctx, name)


@pytest.mark.parametrize("name", BSDFS)
def test_bsdfs_agree_with_the_reference(ctx, name):
    """Each model of the table that no bundled scene has, and blends, within 1 %."""
    assert_agreement(ctx, name, margin=0.01)


@pytest.mark.parametrize("name", MEDIA)
def test_media_agree_with_the_reference(ctx, name):
    """Media behind boundaries that are none, in fog, on a grid, and under a surface."""
    assert_agreement(ctx, name)


def assert_agreement(ctx, name, settings=None, margin=0.02):
    settings = settings or {}
    scene = scene_of(name, settings)
    samples = SIZE, spp_of(name, scene), BATCHES
    ours = render_ours(in_long_passes(scene), *samples, seed_of(name, settings), context=ctx)
    reference = render_reference(scene, *samples, seed_of(name, tuple(settings.items())), is_timed=False)
    assert_proved(ours, reference, LEVEL, margin)
