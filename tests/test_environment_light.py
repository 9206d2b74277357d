# SPDX-License-Identifier: MIT
"""Light from all around, in whole renders: closed forms, integrals in numpy, Mitsuba, and planted errors."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from agreement import assert_agree, assert_mean
from numpy.typing import NDArray
from rendering import ESTIMATORS, Planter, batches, in_long_passes, rendered
from scene_builders import lambert, stare

from fragtracer.apps.compare.rendering import render_ours, render_reference
from fragtracer.apps.compare.verdict import judge
from fragtracer.io.toml import load
from fragtracer.scene import (
    Ambient,
    Camera,
    Environment,
    Gradient,
    Light,
    Material,
    Panorama,
    Plane,
    Scene,
    Sky,
    Sphere,
)
from fragtracer.scene.environment import direction_of, lookup

FLOOR_ALBEDO = (0.2, 0.5, 0.9)
NORMAL = (0.6, 0.64, 0.48)  # of the floor, tilted so that the rotation of an environment shows


def noise(height: int, width: int) -> NDArray[np.float32]:
    """No symmetry: a picture that is turned, mirrored or upside down gives other light."""
    rng = np.random.default_rng(3)
    pixels = 0.3 * rng.random((height, width, 3))
    pixels[height // 5, width // 3] = (4.0, 1.0, 1.0)
    pixels[height // 3, 3 * width // 4] = (0.0, 2.0, 5.0)
    return pixels.astype(np.float32)


def one_texel(height: int, width: int) -> NDArray[np.float32]:
    pixels = np.zeros((height, width, 3), np.float32)
    pixels[height // 4, 7 * width // 8] = (2000.0, 1500.0, 900.0)
    return pixels


ENVIRONMENTS = {
    "noise": Environment(image=Panorama(noise(10, 16)), rotation_degrees=130.0, strength=2.0, tint=(1.0, 0.8, 0.5)),
    "one texel": Environment(image=Panorama(one_texel(64, 128)), rotation_degrees=-20.0),
    "one texel where the ends meet": Environment(image=Panorama(np.roll(one_texel(64, 128), 16, axis=1))),
    "gradient": Environment(gradient=Gradient((1.0, 2.0, 4.0), 1.0, (5.0, 0.0, 0.0))),
    "constant": Environment(radiance=(1.0, 2.0, 3.0)),
}


@cache
def irradiance(environment: Environment) -> NDArray[np.float64]:
    """On a floor, by the midpoint rule, 8 places a texel or more in both directions; 2 in a smooth sky."""
    pixels = environment.pixels
    height, width = (max((2 if environment.sky else 8) * side, 256) for side in pixels.shape[:2])
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    wi = direction_of(u, v)
    weight = np.sin(np.pi * v) * np.maximum(0, wi @ environment.rotation.T @ NORMAL) * 2 * np.pi**2 / (height * width)
    return (lookup(pixels, wi) * weight[..., None]).sum((0, 1)) * environment.scale


def floor_under(environment: Environment, **more: object) -> Scene:
    """Its camera sees one point of the floor, from the side so that it shades nothing."""
    materials = {"floor": lambert(FLOOR_ALBEDO)}
    floor = Plane((0.0, 0.0, 0.0), NORMAL, "floor")
    camera = stare((0.0, 0.0, 0.0), (5.0, 1.0, -2.0))
    return Scene(**({"camera": camera, "materials": materials, "planes": [floor], "environment": environment} | more))


# Each environment by "nee" or "mis", which sample it; a texel would be met by chance too seldom.
CASES = {
    "nee": ("noise", "one texel where the ends meet", "constant"),
    "bsdf": ("noise", "gradient", "constant"),
    "mis": ("noise", "one texel", "gradient"),
}


@pytest.mark.parametrize(("estimator", "name"), [(e, name) for e in ESTIMATORS for name in CASES[e]])
def test_floor_has_the_light_of_the_integral(ctx, estimator, name):
    scene = floor_under(ENVIRONMENTS[name])
    image = rendered(ctx, scene, 1024, estimator=estimator, bounces=1)
    expected = np.multiply(FLOOR_ALBEDO, irradiance(ENVIRONMENTS[name])) / np.pi
    assert_mean(image, expected, 0.012, 2e-4)


def test_light_samples_are_averaged(ctx):
    image = rendered(ctx, floor_under(ENVIRONMENTS["noise"]), 256, light_samples=5, bounces=1)
    expected = np.multiply(FLOOR_ALBEDO, irradiance(ENVIRONMENTS["noise"])) / np.pi
    assert_mean(image, expected, 0.012, 2e-4)


def test_environment_adds_to_lights_and_ambient(ctx):
    environment = ENVIRONMENTS["noise"]
    lamp = Light((0.0, 3.0, 0.0), 0.0, power=100.0)
    image = rendered(ctx, floor_under(environment, lights=(lamp,), ambient=Ambient(0.3)), 1024, bounces=1)
    total = irradiance(environment) + 100 / (4 * np.pi * 9) * NORMAL[1] + 0.3 * np.pi
    assert_mean(image, np.multiply(FLOOR_ALBEDO, total) / np.pi, 0.012, 2e-4)


# One map for all, which takes seconds to compute.
SUNNY = Sky(sun_elevation_degrees=50.0, sun_azimuth_degrees=40.0)
BROAD = replace(SUNNY, sun_radius_degrees=15.0)


def test_sun_has_the_irradiance_that_it_says(ctx):
    """Its disc and the sky of its map together; the disc alone without the map's light."""
    environment = Environment(sky=SUNNY, rotation_degrees=25.0)
    sun = environment.sun
    assert sun is not None
    disc = np.array(sun.radiance) * np.pi * sun.one_minus_cos * (2 - sun.one_minus_cos) * np.dot(sun.direction, NORMAL)
    image = rendered(ctx, floor_under(environment), 1024, bounces=1)
    expected = np.multiply(FLOOR_ALBEDO, disc + irradiance(environment)) / np.pi
    assert_mean(image, expected, 0.01, 2e-4)
    without = rendered(ctx, floor_under(replace(environment, sky=replace(environment.sky, sun=False))), 1024, bounces=1)
    assert_mean(without, np.multiply(FLOOR_ALBEDO, irradiance(environment)) / np.pi, 0.01, 2e-4)


@pytest.mark.parametrize(("estimator", "specialised"), [("nee", True), ("mis", True), ("bsdf", False)])
def test_broad_sun_has_the_irradiance_that_it_says(ctx, estimator, specialised):
    """So broad that chance meets it: its rim, too. Its record is also read from the texture, as on GPUs."""
    environment = Environment(sky=BROAD, strength=0.02)
    sun = environment.sun
    disc = np.array(sun.radiance) * np.pi * sun.one_minus_cos * (2 - sun.one_minus_cos) * np.dot(sun.direction, NORMAL)
    settings = {"estimator": estimator, "bounces": 1, "specialised": specialised}
    image = rendered(ctx, floor_under(environment), 1024, **settings)
    assert_mean(image, np.multiply(FLOOR_ALBEDO, disc + irradiance(environment)) / np.pi, 0.012, 2e-4)


def glossy_under_a_broad_sun(ctx, estimator):
    """A floor that mirrors the rim of the sun to the camera, by a lobe about as wide as the sun."""
    environment = Environment(sky=BROAD, strength=0.02)
    normal, sun = np.array(NORMAL), np.array(environment.sun.direction)
    mirrored = 2 * (normal @ sun) * normal - sun
    scene = floor_under(environment, camera=stare((0.0, 0.0, 0.0), tuple(5 * mirrored + (0.6, 0.0, 0.6))))
    metal = {"floor": Material(albedo=1.0, metallic=1.0, roughness=0.5)}
    return rendered(ctx, replace(scene, materials=metal), 1024, estimator=estimator, bounces=1)


@cache
def by_light_sampling(ctx):
    return glossy_under_a_broad_sun(ctx, "nee").mean((0, 1), dtype=np.float64)


def test_estimators_agree_on_a_glossy_floor_under_a_broad_sun(ctx):
    for estimator in ("mis", "bsdf"):
        assert_mean(glossy_under_a_broad_sun(ctx, estimator), by_light_sampling(ctx), 0.012, 2e-4)


SUN_MUTATIONS = {
    "rim cut off": ("light/sun.glsl", "<= 2.0 * sun.one_minus_cos", "<= 1.9 * sun.one_minus_cos"),
    "chance of the sun forgotten": (
        "integrator/escape.glsl",
        "sun_light_pdf(sun, direction) * u_sun_probability",
        "sun_light_pdf(sun, direction)",
    ),
}


@pytest.mark.parametrize("name", SUN_MUTATIONS)
def test_a_planted_error_of_the_sun_is_found(ctx, monkeypatch, tmp_path, name):
    by_light_sampling(ctx)
    Planter(monkeypatch, tmp_path)(*SUN_MUTATIONS[name])
    with pytest.raises(AssertionError):
        test_estimators_agree_on_a_glossy_floor_under_a_broad_sun(ctx)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_white_sphere_vanishes_in_an_even_light(ctx, estimator):
    """The furnace: a convex surface of albedo a under radiance 1 has the radiance a."""
    materials = {"white": lambert((1.0, 0.6, 0.3))}
    scene = Scene(stare((0.0, 0.0, 0.0), (0.0, 0.5, 6.0)), materials, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "white")])
    image = rendered(ctx, replace(scene, environment=Environment(radiance=1.0)), 1024, estimator=estimator)
    assert_mean(image, (1.0, 0.6, 0.3), 0.02, 2e-4)


def test_constant_environment_is_ambient_light(ctx):
    scene = load("three-spheres-ambient")
    radiance = scene.ambient.radiance
    other = replace(scene, ambient=Ambient(), environment=Environment(radiance=radiance))
    ambient = batches(ctx, scene, 128, range(16), (24, 16))
    for estimator in ESTIMATORS:
        spp = 512 if estimator == "bsdf" else 128
        assert_agree(batches(ctx, other, spp, range(16, 32), (24, 16), estimator=estimator), ambient, 0.05)


def test_hidden_environment_lights_but_is_not_seen(ctx):
    shown = Environment(radiance=1.0)
    hidden = replace(shown, visible=False, background=(0.1, 0.2, 0.3))
    up = Camera((0.0, 1.0, 0.0), (2.0, 5.0, 2.0))
    scene = replace(floor_under(shown), camera=up)
    np.testing.assert_allclose(rendered(ctx, scene, 4, (4, 4)), 1, rtol=1e-6)
    found = rendered(ctx, replace(scene, environment=hidden), 4, (4, 4))
    np.testing.assert_allclose(found, np.broadcast_to(np.float32((0.1, 0.2, 0.3)), found.shape), rtol=1e-6)
    lit = rendered(ctx, floor_under(hidden), 256, bounces=1)
    assert_mean(lit, FLOOR_ALBEDO, 0.02, 2e-4)
    mirror = {"floor": Material(f0=1.0, roughness=0.0, albedo=0.0)}
    np.testing.assert_allclose(rendered(ctx, replace(floor_under(hidden), materials=mirror), 4), 1, rtol=1e-4)


def test_camera_sees_the_map_the_right_way_round(ctx):
    """Through a wide lens towards -z: left is left, up is up; a quarter turn shows what was at +x. Each pixel is the
    mean of 16 x 16 places in it."""
    pixels = noise(8, 16)
    places = (np.arange(32 * 16) + 0.5) / (16 * 16) - 1
    x, y = np.meshgrid(places, -places)
    for turn, middle in ((0.0, 0.5), (90.0, 0.75)):
        environment = Environment(image=Panorama(pixels), rotation_degrees=turn)
        camera = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), fov_degrees=90.0)
        scene = Scene(camera=camera, environment=environment)
        image = rendered(ctx, scene, 256, (32, 32))
        u, v = middle + np.arctan(x) / (2 * np.pi), 0.5 - np.arctan(y / np.hypot(1, x)) / np.pi
        expected = lookup(pixels, direction_of(u, v)).reshape(32, 16, 32, 16, 3).mean((1, 3))
        np.testing.assert_allclose(image, expected, rtol=0.005)


def test_black_and_switched_off_environments_give_nothing(ctx):
    for environment in (Environment(radiance=0.0), Environment(radiance=1.0, strength=0.0)):
        assert not rendered(ctx, floor_under(environment), 4, (4, 4)).any()


MUTATIONS = {
    "rotation left out of the density": ("vec3(c * wi.x - s * wi.z, wi.y, s * wi.x + c * wi.z)", "wi"),
    "turned the wrong way": ("vec3(c * local.x + s * local.z, local.y, c * local.z - s * local.x)", "local"),
    "texels not spread": ("+ 0.5 + square_to_tent(u);", "+ 0.5 + 0.2 * square_to_tent(u);"),
    "one row off": ("int upper = max(int(corner.y), 0);", "int upper = max(int(corner.y) - 1, 0);"),
    "choice not stretched": ("u = (chosen ? u * total : u * total - first) / (chosen ? first : second);", ""),
}


@cache
def right_floor(ctx):
    """A floor under few texels, and its radiance, which is that of a render."""
    environment = Environment(image=Panorama(noise(5, 8)), rotation_degrees=130.0)
    expected = np.multiply(FLOOR_ALBEDO, irradiance(environment)) / np.pi
    assert_mean(rendered(ctx, floor_under(environment), 1024, bounces=1), expected, 0.01, 2e-4)
    return floor_under(environment), expected


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_planted_error_is_found(ctx, monkeypatch, tmp_path, name):
    """By the light on the floor, which is right without it."""
    scene, expected = right_floor(ctx)
    Planter(monkeypatch, tmp_path)("light/environment.glsl", *MUTATIONS[name])
    with pytest.raises(AssertionError):
        assert_mean(rendered(ctx, scene, 1024, bounces=1), expected, 0.01, 2e-4)


def test_environment_counted_twice_is_found(ctx, monkeypatch, tmp_path):
    environment = ENVIRONMENTS["noise"]
    expected = np.multiply(FLOOR_ALBEDO, irradiance(environment)) / np.pi
    plant = Planter(monkeypatch, tmp_path)
    weight = "direct_emission_weight(pdf, environment.a * u_environment_probability, certain)"
    plant("integrator/escape.glsl", f"environment.rgb * {weight};", "environment.rgb;")
    with pytest.raises(AssertionError):
        assert_mean(rendered(ctx, floor_under(environment), 1024, bounces=1), expected, 0.01, 2e-4)


def spheres_under(environment: Environment) -> Scene:
    return replace(load("three-spheres"), lights=(), environment=environment)


REFERENCE_SCENES = {
    "image": spheres_under(replace(ENVIRONMENTS["noise"], rotation_degrees=40.0)),
    "one texel": spheres_under(Environment(image=Panorama(1e-2 * one_texel(16, 32) + 0.02), rotation_degrees=100.0)),
    "image with ambient light and a lamp": replace(
        load("three-spheres-ambient"), environment=replace(ENVIRONMENTS["noise"], strength=0.5)
    ),
    "hidden gradient": spheres_under(replace(ENVIRONMENTS["gradient"], visible=False)),
    "sun": spheres_under(Environment(sky=SUNNY, rotation_degrees=60.0, strength=0.02)),
    # A sun this broad occludes so much sky that a reference without this occlusion is wrong by 2.5 %.
    "broad sun": spheres_under(
        Environment(sky=replace(SUNNY, sun_radius_degrees=6.0), rotation_degrees=60.0, strength=0.02)
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", REFERENCE_SCENES)
def test_an_environment_agrees_with_the_reference(ctx, name):
    pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
    scene, size, count, spp = REFERENCE_SCENES[name], (48, 36), 16, 1024
    reference = render_reference(scene, size, spp, count, is_timed=False)
    ours = render_ours(in_long_passes(scene), size, spp, count, context=ctx)
    verdict = judge(ours.pictures, reference.pictures, alpha=0.01 / len(REFERENCE_SCENES), non_finite=ours.non_finite)
    assert verdict.outcome != "disagreement", (verdict.differing, verdict.image.pair.relative_difference)
    assert verdict.detectable_bias.max() < 0.02
