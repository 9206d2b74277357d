# SPDX-License-Identifier: MIT
"""light/environment.glsl and sun.glsl: the map, its sampler, and the density that belongs to both."""

from typing import Literal

import moderngl
import numpy as np
import pytest

from fragtracer.packing import PackedScene, pack
from fragtracer.packing.environment import environment_tables
from fragtracer.probe import probe
from fragtracer.scene import (
    Camera,
    Environment,
    Gradient,
    Light,
    Material,
    Panorama,
    RenderSettings,
    Scene,
    Sky,
    Sphere,
)
from fragtracer.scene.environment import direction_of, lookup, place_of

from . import Floats
from .chi_square import assert_fits, fit
from .directions import direction
from .domains import Box
from .scene_probe import scene_probe

ENVIRONMENT = ["light/environment.glsl"]
SAMPLE = "LightSample s = environment_light_sample(u); wi = s.wi; radiance = s.radiance; pdf = s.pdf;"
SAMPLED = {"wi": 3, "radiance": 3, "pdf": 1}
SOLID_ANGLE = 2 * np.pi**2  # of the unit square of places, times sin(theta)


def noise(height: int, width: int, seed: int = 0) -> Floats:
    """Pixels from 1e-4 to 1e4, of colours of their own."""
    rng = np.random.default_rng(seed)
    return (10 ** rng.uniform(-4, 4, (height, width, 1)) * rng.random((height, width, 3))).astype(np.float32)


def one_texel(height: int, width: int, row: int, column: int, floor: float = 0.0) -> Floats:
    """A small sun."""
    pixels = np.full((height, width, 3), floor, np.float32)
    pixels[row, column] = (1000.0, 800.0, 500.0)
    return pixels


MAPS = {
    "noise": noise(7, 10),
    "one texel": one_texel(8, 16, 3, 5),
    "one texel where both ends meet": one_texel(8, 16, 3, 0),
    "one texel at the zenith": one_texel(8, 16, 0, 15),
    "one texel at the nadir": one_texel(9, 5, 8, 2),
    "one bright texel in a dim sky": one_texel(8, 16, 2, 9, 0.05),
    "one texel in all": noise(1, 1),
    "one column": noise(6, 1),
    "one row": noise(1, 6),
    "wider than a texture": noise(3, 5000),
}


def packed_map(pixels: Floats, estimator: Literal["mis", "nee"] = "mis", **changes: float) -> PackedScene:
    scene = Scene(camera=Camera(), environment=Environment(image=Panorama(pixels), **changes))
    return pack(scene, RenderSettings(estimator=estimator), 64, 64)


def weight_map(pixels: Floats, is_compensated: bool = True) -> Floats:
    """The density of places that the sampler should have, in float64: one channel, its mean over the texels 1."""
    tables = environment_tables(Panorama(pixels), is_compensated)
    weights: Floats = tables.texels[:, 3].astype(np.float64).reshape(*pixels.shape[:2], 1)
    return weights / weights.mean()


@pytest.mark.parametrize("is_compensated", [False, True])
@pytest.mark.parametrize("name", MAPS)
def test_weights_are_luminance_times_sine(name: str, is_compensated: bool) -> None:
    """What it is above the mean over all directions, and their share, where light samples have help."""
    pixels = MAPS[name]
    height = len(pixels)
    luminance = (pixels.astype(np.float64) @ (0.2126, 0.7152, 0.0722))[..., None]
    sines = np.broadcast_to(np.sin(np.pi * (np.arange(height) + 0.5) / height)[:, None, None], luminance.shape)
    mean = (luminance * sines).sum() / sines.sum()
    above = np.maximum(luminance - mean, 0) * sines
    tables = environment_tables(Panorama(pixels), is_compensated)
    share = above.sum() / (luminance * sines).sum() if is_compensated else 1.0
    is_even = is_compensated and (luminance == luminance[0, 0]).all()
    assert tables.sampled == pytest.approx(0.0 if is_even else share, rel=1e-6)
    weights = above if tables.sampled and is_compensated else luminance * sines
    rounding = 1e-3 if tables.texels.dtype == np.float16 else 1e-6
    expected = weights / weights.mean()
    found = weight_map(pixels, is_compensated)
    np.testing.assert_allclose(found, expected, rtol=rounding, atol=1e-6 * mean / above.mean() if above.any() else 0)


def test_an_even_sky_is_left_to_bsdf_sampling() -> None:
    """Also one of a little gradient. It stays in the tables, for rays that meet it; sampled alone it is a light."""
    pixels = np.repeat(Gradient(1.0, 0.7, 0.6).pixels, 2, axis=1)
    packed = packed_map(pixels)
    assert packed.features["HAS_ENVIRONMENT"] == 1
    assert packed.uniforms["u_light_count"] == packed.uniforms["u_environment_probability"] == 0
    assert packed_map(pixels, "nee").uniforms["u_environment_probability"] == 1


def test_a_small_sun_in_an_even_sky_is_a_light() -> None:
    """Which is a twentieth of the light, and would be met by chance too seldom."""
    pixels = np.ones((64, 128, 3), np.float32)
    pixels[20, 30] = 300.0
    tables = environment_tables(Panorama(pixels), True)
    assert 0.03 < tables.sampled < 0.06
    assert packed_map(pixels).uniforms["u_environment_probability"] == 1
    assert tables.texels[20 * 128 + 30, 3] == pytest.approx(tables.texels[:, 3].sum(), rel=1e-3)


def test_light_samples_that_a_sky_does_not_need_go_to_its_sun() -> None:
    """And to no lamp. A tenth of the probability is spread evenly over all three."""
    sky = Environment(sky=Sky(sun_elevation_degrees=30))
    ball = Sphere((0.0, 0.0, 0.0), 1.0, "grey")
    lamp = Light((0.0, 3.0, 0.0), 0.0, power=2000.0)
    scene = Scene(Camera(), {"grey": Material()}, spheres=[ball], environment=sky, lights=[lamp])
    found = {}
    for estimator in ("mis", "nee"):
        uniforms = pack(scene, RenderSettings(estimator=estimator), 8, 8).uniforms
        found[estimator] = np.array([uniforms[f"u_{name}_probability"] for name in ("sun", "environment")]) - 0.1 / 3
    mis, nee = found["mis"], found["nee"]
    assert 0.1 < nee.sum() < 0.9
    assert mis.sum() == pytest.approx(nee.sum(), abs=1e-6)
    assert mis[1] == pytest.approx(nee[1] * environment_tables(sky.source, True).sampled, abs=1e-6)


@pytest.mark.parametrize("name", MAPS)
def test_lookup_and_density_are_those_of_the_description(ctx: moderngl.Context, name: str) -> None:
    pixels = MAPS[name]
    height, width, _ = pixels.shape
    rng = np.random.default_rng(1)
    places = np.concatenate([rng.random((4000, 2)), np.stack([rng.random(500), rng.random(500) / height], -1)])
    wi = direction_of(*places.T).astype(np.float32)
    turned = Environment(radiance=1.0, rotation_degrees=50).rotation
    packed = packed_map(pixels, rotation_degrees=50, strength=3.0)
    body = "vec4 r = environment_radiance_pdf(wi); radiance = r.rgb; pdf = r.a;"
    world = (wi @ turned.T).astype(np.float32)
    got = scene_probe(ctx, packed, ENVIRONMENT, body, {"wi": world}, {"radiance": 3, "pdf": 1})
    wi = world.astype(np.float64) @ turned
    # A rounded direction is off by 2e-7 of a turn; the map's steepest slope says what that may change.
    slope = 3e-7 * (width + height) * pixels.max()
    np.testing.assert_allclose(got["radiance"], 3 * lookup(pixels, wi), rtol=1e-5, atol=3 * slope)
    sines = np.hypot(wi[:, 0], wi[:, 2])
    density = weight_map(pixels)
    expected = lookup(density, wi)[:, 0] / SOLID_ANGLE
    slope = 3e-7 * (width + height) * density.max() / SOLID_ANGLE
    np.testing.assert_allclose(got["pdf"] * sines, expected, rtol=1e-5, atol=slope)


@pytest.mark.parametrize("name", MAPS)
def test_samples_have_their_density(ctx: moderngl.Context, name: str) -> None:
    """Places are spread as the piecewise bilinear density says, which integrates to 1; each quarter of a texel is
    a cell, in which that density is smooth."""
    pixels = MAPS[name]
    height, width, _ = pixels.shape
    packed = packed_map(pixels)
    u = np.random.default_rng(2).random((1 << 18, 2), np.float32)
    got = scene_probe(ctx, packed, ENVIRONMENT, SAMPLE, {"u": u}, SAMPLED)
    assert np.abs(np.linalg.norm(got["wi"], axis=1) - 1).max() < 1e-6
    assert (got["pdf"] > 0).all()

    def pdf(places: Floats) -> Floats:
        wi = direction_of(*places.T)
        found = scene_probe(ctx, packed, ENVIRONMENT, "pdf = environment_radiance_pdf(wi).a;", {"wi": wi}, {"pdf": 1})[
            "pdf"
        ]
        return found * SOLID_ANGLE * np.hypot(wi[:, 0], wi[:, 2])

    cells = (2 * width, 2 * height) if width < 100 else (2 * 50, 2 * height)
    order = (4, 4) if width < 100 else (600, 4)
    places = np.clip(place_of(got["wi"]), 0, 1 - 1e-12)
    assert_fits({name: fit(Box(), places, pdf, cells=cells, order=order)})


@pytest.mark.parametrize("name", MAPS)
def test_a_sample_is_what_a_path_in_its_direction_finds(ctx: moderngl.Context, name: str) -> None:
    pixels = MAPS[name]
    packed = packed_map(pixels, rotation_degrees=-77)
    u = np.random.default_rng(3).random((1 << 14, 2), np.float32)
    body = f"{SAMPLE} vec4 met = environment_radiance_pdf(s.wi); again = met.rgb; density = met.a;"
    got = scene_probe(ctx, packed, ENVIRONMENT, body, {"u": u}, SAMPLED | {"again": 3, "density": 1})
    steep = 3e-7 * sum(pixels.shape[:2])
    np.testing.assert_allclose(got["again"], got["radiance"], rtol=1e-5, atol=steep * pixels.max())
    sines = np.hypot(got["wi"][:, 0], got["wi"][:, 2])
    top = (got["pdf"] * sines).max()
    np.testing.assert_allclose(got["density"] * sines, got["pdf"] * sines, rtol=1e-5, atol=steep * top)


def test_irradiance_by_sampling_is_that_by_integration(ctx: moderngl.Context) -> None:
    """The mean of radiance times cosine over the density is the integral: sin(theta), rotation and all."""
    pixels = noise(16, 32, seed=4)
    packed = packed_map(pixels, "nee", rotation_degrees=130)
    x, z, y = direction(35)
    normal = np.array([x, y, z])
    u = np.random.default_rng(5).random((1 << 20, 2), np.float32)
    body = "LightSample s = environment_light_sample(u); e = s.radiance * max(0.0, dot(s.wi, n)) / s.pdf;"
    inputs = {"u": u, "n": np.broadcast_to(normal, (len(u), 3))}
    e = scene_probe(ctx, packed, ENVIRONMENT, body, inputs, {"e": 3})["e"]
    expected = irradiance(pixels, normal @ Environment(radiance=1.0, rotation_degrees=130).rotation)
    error = e.std(axis=0) / np.sqrt(len(e))
    assert (np.abs(e.mean(axis=0) - expected) <= 4.5 * error).all()
    assert (error < 0.004 * expected).all()


def irradiance(pixels: Floats, normal: Floats, fineness: int = 24) -> Floats:
    """On a surface of ``normal``, by the midpoint rule on ``fineness`` places a texel in both directions."""
    height, width, _ = pixels.shape
    v = (np.arange(height * fineness) + 0.5) / (height * fineness)
    u = (np.arange(width * fineness) + 0.5) / (width * fineness)
    total = np.zeros(3)
    for row in v:
        wi = direction_of(u, np.full_like(u, row))
        cosine = np.maximum(0, wi @ normal)[:, None]
        total += (lookup(pixels, wi) * cosine).sum(0) * np.sin(np.pi * row)
    return total * SOLID_ANGLE / (len(u) * len(v))


def test_gradient_irradiance_has_its_closed_form() -> None:
    """Of horizon + (zenith - horizon) cos(theta): pi (horizon + (zenith - horizon) 2 / 3)."""
    gradient = Gradient(zenith=4.0, horizon=1.0, ground=0.5)
    found = irradiance(np.repeat(gradient.pixels, 4, axis=1), np.array([0.0, 1.0, 0.0]), 4)
    np.testing.assert_allclose(found, np.pi * (1 + 3 * 2 / 3), rtol=1e-3)


def test_tree_chooses_each_texel_with_its_share() -> None:
    """Although its sums are float32 and the texels from 1 to 1e12: products of the choices are the shares."""
    rng = np.random.default_rng(6)
    pixels = (10 ** rng.uniform(0, 12, (300, 517, 1)) * np.ones(3)).astype(np.float32)
    tables = environment_tables(Panorama(pixels), False)
    width, height = tables.size
    share = np.ones((1, 1))
    first = 0
    for level in range(tables.levels, 0, -1):
        columns, rows = (-(-side // 2**level) for side in tables.size)
        nodes = tables.tree[first : first + rows * columns].reshape(rows, columns, 2, 2).astype(np.float64)
        chosen = nodes / nodes.sum(axis=(2, 3), keepdims=True) * share[..., None, None]
        share = chosen.swapaxes(1, 2).reshape(2 * rows, 2 * columns)
        below = [-(-side // 2 ** (level - 1)) for side in tables.size]
        share = share[: below[1], : below[0]]
        first += rows * columns
    weights = tables.texels[:, 3].astype(np.float64).reshape(height, width)
    assert share.sum() == pytest.approx(1, abs=1e-12)
    np.testing.assert_allclose(share, weights / weights.sum(), rtol=2e-6)
    assert tables.density == pytest.approx(width * height / (SOLID_ANGLE * weights.sum()), rel=1e-12)


def test_half_floats_are_used_where_they_are_exact() -> None:
    exact = np.ldexp(np.random.default_rng(7).integers(0, 256, (4, 8, 3)), -3).astype(np.float32)
    assert environment_tables(Panorama(exact), True).texels.dtype == np.float16
    assert environment_tables(Panorama(exact * np.float32(1 / 3)), True).texels.dtype == np.float32


def test_huge_and_tiny_radiances_are_held(ctx: moderngl.Context) -> None:
    for scale in (1e-30, 1e30):
        pixels = noise(4, 6) * np.float32(scale)
        got = scene_probe(ctx, packed_map(pixels), ENVIRONMENT, SAMPLE, {"u": np.full((1, 2), 0.3)}, SAMPLED)
        assert np.isfinite(got["radiance"]).all()
        assert (got["pdf"] > 0).all()


def test_extreme_numbers_choose_texels_that_shine(ctx: moderngl.Context) -> None:
    """0 and the largest number below 1, where rounding would leave the map or step on a black texel."""
    ends = np.array([0.0, 1 - 2.0**-23, 1 - 2.0**-24])
    u = np.stack(np.meshgrid(ends, ends), -1).reshape(-1, 2)
    for name in ("one texel", "one texel at the nadir", "noise"):
        got = scene_probe(ctx, packed_map(MAPS[name]), ENVIRONMENT, SAMPLE, {"u": u}, SAMPLED)
        assert np.isfinite(got["wi"]).all()
        assert np.isfinite(got["pdf"]).all()


@pytest.mark.parametrize("width", [1, 3, 8192])
def test_one_texel_beyond_either_end_is_the_other_end(ctx: moderngl.Context, width: int) -> None:
    """The farthest place that a sample has, rounded: in a map this wide its tent reaches a whole texel out."""
    pixels = noise(2, width)
    places = np.array([(-0.5, 0.5), (width + 0.5, 0.5), (width + 0.5, 1.5)], np.float32)
    body = "radiance = environment_bilinear(place).rgb * u_environment_scale;"
    got = scene_probe(ctx, packed_map(pixels), ENVIRONMENT, body, {"place": places}, {"radiance": 3})["radiance"]
    np.testing.assert_allclose(got, pixels[[0, 0, 1], [-1, 0, 0]], rtol=1e-5)


def test_angles_in_turns(ctx: moderngl.Context) -> None:
    angle = np.linspace(-np.pi, np.pi, 10001)
    v = np.stack([np.cos(angle), np.sin(angle)], -1).astype(np.float32)
    got = probe(ctx, ["core/math.glsl"], "a = turns_of(v);", {"v": v * np.float32(7)}, {"a": 1})["a"].astype(np.float64)
    exact = np.arctan2(*v.T[::-1].astype(np.float64)) / (2 * np.pi)
    assert np.abs((got - exact + 0.5) % 1 - 0.5).max() < 1.2e-7


def test_sun_is_sampled_uniformly_over_its_disc(ctx: moderngl.Context) -> None:
    center = np.array(direction(40))
    cosine = np.cos(np.radians(0.2666))
    one_minus_cos = 2 * np.sin(np.radians(0.2666) / 2) ** 2
    u = np.random.default_rng(8).random((1 << 18, 2), np.float32)
    body = """
        SunLight sun = SunLight(c, k, vec3(1.0, 2.0, 3.0));
        LightSample s = sun_light_sample(sun, u); wi = s.wi; said = s.pdf; radiance = s.radiance;
        far_off = float(s.distance == INFINITE_DISTANCE && s.primitive == NO_PRIMITIVE && !s.delta);
        pdf = sun_light_pdf(sun, wi); beside = sun_light_pdf(sun, far);"""
    across = np.cross(center, (0, 0, 1)) / np.linalg.norm(np.cross(center, (0, 0, 1)))
    far = center * cosine + across * np.sqrt(1 - cosine**2) * 1.002
    inputs = {"u": u, "c": np.broadcast_to(center, (len(u), 3)), "k": np.full(len(u), one_minus_cos)}
    inputs["far"] = np.broadcast_to(far, (len(u), 3))
    outputs = {"wi": 3, "said": 1, "radiance": 3, "far_off": 1, "pdf": 1, "beside": 1}
    got = probe(ctx, ["light/sun.glsl"], body, inputs, outputs)
    assert not got["beside"].any()
    assert (got["radiance"] == (1, 2, 3)).all()
    assert got["far_off"].all()
    np.testing.assert_allclose(got["said"], 1 / (2 * np.pi * one_minus_cos), rtol=1e-6)
    assert (got["pdf"] > 0).mean() > 0.999  # float32 puts some on the rim beside it
    np.testing.assert_allclose(got["pdf"][got["pdf"] > 0], 1 / (2 * np.pi * one_minus_cos), rtol=1e-6)
    wi = got["wi"].astype(np.float64)
    off = wi - center
    radius = np.sqrt((off**2).sum(1) / (2 * one_minus_cos))
    up = np.cross(across, center)
    places = np.stack([radius**2, np.arctan2(off @ up, off @ across) / (2 * np.pi) % 1], -1)
    assert_fits({"disc": fit(Box(), np.clip(places, 0, 1 - 1e-9), lambda p: np.ones(len(p)), cells=(20, 20))})
