# SPDX-License-Identifier: MIT
"""film/pixel_filter.glsl: offsets with the density of the filter."""

from collections.abc import Callable

import moderngl
import numpy as np
import pytest

from fragtracer.probe import probe

from . import Floats
from .chi_square import assert_fits, fit
from .domains import Box, Domain, GaussianPlane

SIGMA = 0.5


def box(points: Floats) -> Floats:
    return np.ones(len(points))


def tent(points: Floats) -> Floats:
    return np.prod(1 - np.abs(points), axis=1)


def gaussian(points: Floats) -> Floats:
    return np.exp(-(points**2).sum(1) / (2 * SIGMA**2)) / (2 * np.pi * SIGMA**2)


# Density, domain and variance of each coordinate.
FILTERS: dict[str, tuple[Callable[[Floats], Floats], Domain, float]] = {
    "BOX": (box, Box(0.5), 1 / 12),
    "TENT": (tent, Box(1.0), 1 / 6),
    "GAUSSIAN": (gaussian, GaussianPlane(SIGMA), SIGMA**2),
}
REACH = {"BOX": 0.5, "TENT": 1.0, "GAUSSIAN": np.inf}


def offsets(ctx: moderngl.Context, name: str, u: Floats) -> Floats:
    defines = {"PIXEL_FILTER": f"PIXEL_FILTER_{name}"}
    includes = ["film/pixel_filter.glsl"]
    result = probe(ctx, includes, "offset = pixel_filter_sample(u);", {"u": u}, {"offset": 2}, defines)
    return result["offset"].astype(np.float64)


@pytest.mark.parametrize("name", FILTERS)
def test_offsets_have_the_density_of_the_filter(ctx: moderngl.Context, name: str) -> None:
    density, domain, variance = FILTERS[name]
    offset = offsets(ctx, name, np.random.default_rng(1).random((1 << 20, 2), np.float32))
    assert_fits({name: fit(domain, offset, density)})
    moments = np.array([offset.mean(0), (offset**2).mean(0) - variance, [(offset[:, 0] * offset[:, 1]).mean()] * 2])
    errors = np.array([offset.std(0), (offset**2).std(0), [(offset[:, 0] * offset[:, 1]).std()] * 2]) / np.sqrt(1 << 20)
    assert (np.abs(moments) < 4.5 * errors).all()


@pytest.mark.parametrize("name", FILTERS)
def test_offsets_of_extreme_numbers(ctx: moderngl.Context, name: str) -> None:
    ends = np.float32([0, 2**-24, 0.25, 0.5, 0.5 - 2**-25, 0.75, 1 - 2**-24])
    offset = offsets(ctx, name, np.stack(np.meshgrid(ends, ends), -1).reshape(-1, 2))
    assert np.isfinite(offset).all()
    assert np.abs(offset).max() <= {"BOX": 0.5, "TENT": 1.0, "GAUSSIAN": 3.0}[name]


@pytest.mark.parametrize("name", FILTERS)
def test_pixels_have_the_share_of_their_filter(ctx: moderngl.Context, name: str) -> None:
    """Of what is seen at a place in the picture, in the mean over the numbers that choose the pixel."""
    density, _, _ = FILTERS[name]
    places, count = np.float32([[4.5, 4.5], [4.02, 4.9], [4.3, 5.6], [4.75, 4.25]]), 1 << 18
    inputs = {
        "place": np.repeat(places, count, axis=0),
        "u": np.random.default_rng(2).random((4 * count, 2), np.float32),
    }
    defines = {"PIXEL_FILTER": f"PIXEL_FILTER_{name}"}
    body = "found = pixel_filter_pixel(place, u);"
    found = probe(ctx, ["film/pixel_filter.glsl"], body, inputs, {"found": 3}, defines)["found"].astype(np.float64)
    pixels = np.stack(np.meshgrid(np.arange(10), np.arange(10)), -1).reshape(-1, 2)
    for place, some in zip(places.astype(np.float64), found.reshape(4, count, 3), strict=True):
        weight = some[0, 2]
        np.testing.assert_allclose(some[:, 2], weight, rtol=1e-5)
        number = np.round(some[:, 1] * 10 + some[:, 0]).astype(np.int64)
        share = weight * np.bincount(number, minlength=100) / count
        expected = density(pixels + 0.5 - place) * (
            np.abs(pixels + 0.5 - place).max(axis=1) < {"BOX": 0.5, "TENT": 1}.get(name, 9)
        )
        error = np.sqrt(weight * expected / count)
        assert (np.abs(share - expected) <= 5 * error + 1e-6).all()
