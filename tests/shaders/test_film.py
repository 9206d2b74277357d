# SPDX-License-Identifier: MIT
"""film/film.glsl: the running mean and variance of a pixel, against float64."""

import moderngl
import numpy as np
import pytest

from fragtracer.probe import probe

from . import Floats

SAMPLES = 1 << 16
_WIDTH = 1024
# Eight samples a round, since llvmpipe lets a shader loop 65,535 times in all.
_ADD = "film_add(film, texelFetch(u_samples, ivec2(i % {0} + {1}, int(pixel) * {2} + i / {0}), 0).rgb);"
BODY = f"""
    Film film = Film(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0, 0u);
    for (int i = 0; i < {SAMPLES}; i += 8) {{
        {" ".join(_ADD.format(_WIDTH, k, SAMPLES // _WIDTH) for k in range(8))}
    }}
    mean = film.mean; variance = film.variance; half_difference = film.half_difference;
    counts = vec3(film.count, film.non_finite, film.next);"""


def accumulate(ctx: moderngl.Context, samples: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Mean, variance and half-difference (pixels, 3), and counts of finite, other and all samples, of samples
    (pixels, SAMPLES, 3) taken one after the other."""
    texels = np.zeros((*samples.shape[:2], 4), np.float32)
    texels[..., :3] = samples
    texture = ctx.texture((_WIDTH, texels[..., 0].size // _WIDTH), 4, texels.tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    try:
        result = probe(
            ctx,
            ["film/film.glsl", "probe/samples.glsl"],
            BODY,
            {"pixel": np.arange(len(samples))},
            {"mean": 3, "variance": 3, "half_difference": 3, "counts": 3},
            generated={"probe/samples.glsl": "uniform highp sampler2D u_samples;"},
            resources={"u_samples": texture},
        )
    finally:
        texture.release()
    mean, variance, half_difference, counts = (values.astype(np.float64) for values in result.values())
    return mean, variance, half_difference, counts


@pytest.fixture(scope="module")
def radiance() -> Floats:
    """Of pixels from dark to bright, some with rare and very bright samples."""
    rng = np.random.default_rng(1)
    even = rng.random((4, SAMPLES, 3))
    dim = 1e-5 * rng.exponential(size=(4, SAMPLES, 3))
    bright = 1e4 * (1 + 0.1 * rng.normal(size=(4, SAMPLES, 3)))
    rare = rng.exponential(size=(4, SAMPLES, 3)) * np.where(rng.random((4, SAMPLES, 1)) < 1e-3, 1000, 0.1)
    return np.concatenate([even, dim, bright, rare]).astype(np.float32)


def test_random_samples(ctx: moderngl.Context, radiance: Floats) -> None:
    """Each update rounds the mean by up to half a unit in its last place, and the next n dilute that as
    they do samples: a standard deviation of sqrt(n / 3) 2^-23 / sqrt(12), here 5e-6, of which five."""
    mean, variance, half_difference, counts = accumulate(ctx, radiance)
    exact = radiance.astype(np.float64)
    halves = exact[:, ::2].mean(axis=1), exact[:, 1::2].mean(axis=1)
    np.testing.assert_allclose(half_difference, (halves[0] - halves[1]) / 2, atol=2.5e-5 * exact.mean(), rtol=2.5e-5)
    np.testing.assert_allclose(mean, exact.mean(axis=1), rtol=2.5e-5)
    np.testing.assert_allclose(variance, exact.var(axis=1), rtol=2.5e-5)
    assert (counts == (SAMPLES, 0, SAMPLES)).all()
    # Rounding has no preferred direction.
    error = mean / exact.mean(axis=1) - 1
    assert abs(error.mean()) < 5 * 5.1e-6 / np.sqrt(error.size)


def test_samples_that_are_not_finite_are_counted_apart(ctx: moderngl.Context, radiance: Floats) -> None:
    spoilt = radiance[:4].copy()
    rng = np.random.default_rng(2)
    bad = rng.random(spoilt.shape[:2]) < 0.1
    bad[1] = True
    bad[2] = False
    bad[3, 1:] = True
    channel = rng.integers(0, 3, spoilt.shape[:2])
    values = rng.choice(np.float32([np.nan, np.inf, -np.inf]), spoilt.shape[:2])
    pixel, sample = np.nonzero(bad)
    spoilt[pixel, sample, channel[bad]] = values[bad]
    mean, variance, _, counts = accumulate(ctx, spoilt)
    others = bad.sum(axis=1)
    np.testing.assert_array_equal(counts, np.column_stack([SAMPLES - others, others, np.full(4, SAMPLES)]))
    for i in (0, 2, 3):
        finite = spoilt[i][~bad[i]].astype(np.float64)
        np.testing.assert_allclose(mean[i], finite.mean(axis=0), rtol=2.5e-5)
        np.testing.assert_allclose(variance[i], finite.var(axis=0), rtol=2.5e-5)
    assert not mean[1].any()
    assert not variance[1].any()


def test_a_constant_stays_exact(ctx: moderngl.Context) -> None:
    """However often it is added, and however bad it is to write in binary."""
    constants = np.float32([0.1, 1 / 3, 1e-20, 1.2345678e10, 0.99999994, 3e38, 0.0, 16777217])
    samples = np.broadcast_to(constants[:, None, None], (len(constants), SAMPLES, 3))
    mean, variance, _, counts = accumulate(ctx, samples)
    np.testing.assert_array_equal(mean, np.broadcast_to(constants[:, None], mean.shape))
    assert not variance.any()
    assert (counts == (SAMPLES, 0, SAMPLES)).all()


def test_film_is_loaded_from_its_textures(ctx: moderngl.Context) -> None:
    """Each value from the place where the program writes it (out_mean, out_variance, out_half_difference)."""
    texels = np.arange(3 * 3 * 4, dtype=np.float32).reshape(3, 3, 1, 4)
    textures = [ctx.texture((3, 1), 4, t.tobytes(), dtype="f4") for t in texels]
    body = """
        Film film = film_load(ivec2(int(x), 0), 7u);
        mean = film.mean; variance = film.variance; half_difference = film.half_difference;
        counts = vec3(film.count, film.non_finite, film.next);"""
    result = probe(
        ctx,
        ["film/film.glsl"],
        body,
        {"x": np.arange(3)},
        {"mean": 3, "variance": 3, "half_difference": 3, "counts": 3},
        resources=dict(zip(("u_film_mean", "u_film_variance", "u_film_half_difference"), textures, strict=True)),
    )
    for texture in textures:
        texture.release()
    np.testing.assert_array_equal(result["mean"], texels[0, :, 0, :3])
    np.testing.assert_array_equal(result["variance"], texels[1, :, 0, :3])
    np.testing.assert_array_equal(result["half_difference"], texels[2, :, 0, :3])
    np.testing.assert_array_equal(result["counts"][:, :2], texels[:2, :, 0, 3].T)
    np.testing.assert_array_equal(result["counts"][:, 2], 7 + texels[:2, :, 0, 3].sum(axis=0))


def test_a_marked_pixel_stays_marked(ctx: moderngl.Context) -> None:
    """Whatever is added to it: finite samples, others, another film. Its next samples are numbered from the first."""
    texel = np.float32([0.5, 0.5, 0.5, -1.0])
    textures = [ctx.texture((1, 1), 4, texel.tobytes(), dtype="f4") for _ in range(3)]
    body = """
        Film film = film_load(ivec2(0), 7u);
        Film other = Film(vec3(1.0), vec3(0.0), vec3(0.0), 1.0, 0.0, 0u);
        film_add(film, vec3(1.0));
        film_add(film, vec3(1.0 / zero));
        film_merge(film, other);
        film_merge(other, film);
        mean = film.mean; variance = film.variance; half_difference = film.half_difference;
        counts = vec3(film.count, film.non_finite, film.next); whole = other.count + other.non_finite;"""
    outputs = {"mean": 3, "variance": 3, "half_difference": 3, "counts": 3, "whole": 1}
    names = ("u_film_mean", "u_film_variance", "u_film_half_difference")
    resources = dict(zip(names, textures, strict=True))
    result = probe(ctx, ["film/film.glsl"], body, {"zero": np.zeros(1)}, outputs, resources=resources)
    for texture in textures:
        texture.release()
    for name in ("mean", "variance", "half_difference"):
        np.testing.assert_array_equal(result[name], np.full((1, 3), 0.5, np.float32))
    np.testing.assert_array_equal(result["counts"], [[-1, -1, 9]])
    assert result["whole"] < 1  # so that a film into which it is merged is known to lack samples


def test_merged_films_are_one(ctx: moderngl.Context) -> None:
    """Of parts whose lengths differ, as one film has it that met all their samples."""
    body = """
        Film whole = Film(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0, 0u), merged = whole;
        for (int part = 0; part < 5; part++) {
            Film film = Film(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0, whole.next);
            for (int i = 0; i < 3 * part; i++) {
                vec3 radiance = vec3(x + 0.1 * float(i), exp(0.2 * float(i - part)), x * float(part));
                if (i == 4) radiance.b = 1.0 / u_zero;
                film_add(film, radiance);
                film_add(whole, radiance);
            }
            film_merge(merged, film);
        }
        mean = merged.mean - whole.mean; variance = merged.variance - whole.variance;
        half_difference = merged.half_difference - whole.half_difference;
        counts = vec3(merged.count - whole.count, merged.non_finite - whole.non_finite, whole.count);"""
    result = probe(
        ctx,
        ["film/film.glsl", "probe/zero.glsl"],
        body,
        {"x": np.linspace(0, 3, 7)},
        {"mean": 3, "variance": 3, "half_difference": 3, "counts": 3},
        generated={"probe/zero.glsl": "uniform float u_zero;"},
    )
    for name in ("mean", "half_difference"):
        np.testing.assert_allclose(result[name], 0, atol=1e-5)
    np.testing.assert_allclose(result["variance"], 0, atol=1e-4)
    np.testing.assert_array_equal(result["counts"], np.tile([0, 0, 27], (7, 1)))
