# SPDX-License-Identifier: MIT
"""Pilots: few tiles speak for the whole image, also where the error is in few pixels."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.sampling.pilot import (
    SAMPLES,
    SURVEY_SAMPLES,
    TILE,
    Pilot,
    Tiles,
    pilot_list,
    pilot_samples,
    survey_list,
    tiles_of,
)
from fragtracer.sampling.pixels import Pixels

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 512, 256  # of 512 tiles, of which 64 are drawn


def sampled(pixels: NDArray[np.int64], deviation: Floats, samples: int, seed: int, seen: float = 1.0) -> Pixels:
    """So many samples of each item, with a mean of 1 and the deviation of its pixel (HEIGHT, WIDTH), of which the share
    ``seen`` is not black."""
    rng = np.random.default_rng(seed)
    values = rng.normal(1, deviation.ravel()[pixels][:, None], (len(pixels), samples))
    values *= (rng.random(values.shape) < seen) / seen
    halves = (values * np.where(np.arange(samples) % 2, -1, 1)).mean(axis=1)
    count = np.full((len(values), 1, 1), float(samples))
    parts = values.mean(axis=1), values.var(axis=1), halves
    mean, variance, half = (np.repeat(part[:, None, None], 3, axis=2).astype(np.float32) for part in parts)
    return Pixels(*(np.concatenate([x, count], axis=2).astype(np.float32) for x in (mean, variance)), half)


def piloted(deviation: Floats, seed: int, seen: float = 1.0) -> Pilot:
    """Of an image of WIDTH x HEIGHT."""
    survey = sampled(survey_list(WIDTH, HEIGHT).pixels, deviation, SURVEY_SAMPLES, seed, seen)
    items = pilot_list(Tiles.by(survey, WIDTH, HEIGHT)).pixels
    both = zip(vars(survey).values(), vars(sampled(items, deviation, SAMPLES, seed + 1, seen)).values(), strict=True)
    pixels = Pixels(*(np.concatenate(part) for part in both))
    np.testing.assert_array_equal(pixels.mean[..., 3], pilot_samples(WIDTH, HEIGHT))
    return Pilot.of(pixels, WIDTH, HEIGHT)


def in_tiles(values: Floats) -> Floats:
    """(tiles,), row by row from below, as an image (HEIGHT, WIDTH)."""
    return np.kron(values.reshape(HEIGHT // TILE, WIDTH // TILE)[::-1], np.ones((TILE, TILE)))


@pytest.mark.parametrize(("width", "height"), [(640, 480), (37, 21), (16, 16), (128, 130)])
def test_tiles_are_whole_and_apart(width: int, height: int) -> None:
    """A quarter of them, up to 64; they begin at even rows from below, as the blocks of the gradient domain do."""
    survey = survey_list(width, height)
    number = tiles_of(width, height)
    y, x = np.divmod(survey.pixels, width)
    assert len({*zip((height - 1 - y) // 4, x // 4, strict=True)}) == len(survey.pixels) == 16 * number
    tiles = Tiles.by(Pixels(*(np.ones((16 * number, 1, n), np.float32) for n in (4, 4, 3))), width, height)
    assert tiles.pixels.shape == (min(64, -(-number // 4)), 256)
    assert len(np.unique(tiles.pixels)) == tiles.pixels.size
    np.testing.assert_allclose(tiles.weights, number / len(tiles.weights))
    y, x = np.divmod(tiles.pixels, width)
    for place in (x, height - 1 - y):
        assert (np.ptp(place, axis=1) == 15).all()
        assert (place.min(axis=1) % 16 == 0).all()
    items = pilot_list(tiles)
    first = np.repeat([0, SAMPLES], tiles.pixels.size)
    np.testing.assert_array_equal(items.first, first)
    assert survey.first.min() == 2 * SAMPLES  # samples of their own
    assert len(survey.pixels) + len(items.pixels) == len(pilot_samples(width, height))
    order = tiles.tiled(np.tile(tiles.pixels.reshape(-1, 1, 1), (2, 1, 1)).astype(np.float32))
    np.testing.assert_array_equal(order[0, 0, ::-1, :, 0], np.sort(tiles.pixels[0]).reshape(16, 16))


def test_an_image_without_room_has_no_tiles() -> None:
    assert tiles_of(3, 90) == tiles_of(90, 15) == len(survey_list(3, 90).pixels) == len(pilot_samples(3, 90)) == 0


def test_tiles_stand_for_the_image() -> None:
    """Their weighted mean is that of the image, where few tiles have most of it, which are certain to be drawn."""
    rng = np.random.default_rng(0)
    deviation = np.full(512, 0.02)
    deviation[[7, 100, 101, 480]] = 1.0
    found = []
    for seed in range(20):
        survey = sampled(survey_list(WIDTH, HEIGHT).pixels, in_tiles(rng.permutation(deviation)), SURVEY_SAMPLES, seed)
        tiles = Tiles.by(survey, WIDTH, HEIGHT)
        found.append(tiles.weights.sum())
        assert np.isclose(tiles.weights, 1).sum() == 4
    assert np.mean(found) == pytest.approx(512, rel=0.02)


@pytest.mark.parametrize(
    ("ratio", "part", "seen", "least", "most"),
    [(8.0, 4, 1.0, 1.9, 2.2), (1.0, 4, 1.0, 0.9, 1.0), (1.0, 4, 0.0025, 0.3, 0.9), (50.0, 256, 1.0, 6.8, 8.3)],
)
def test_the_gain_is_what_a_plan_is_worth(ratio: float, part: int, seen: float, least: float, most: float) -> None:
    """One in ``part`` tiles has ``ratio`` times the deviation of the others; of samples with a mean of 1, the share
    ``seen`` is not black. A plan for what chance has brought is worth less than none."""
    deviation = in_tiles(0.02 * np.where(np.arange(512) % part == 0, ratio, 1.0))
    for seed in (0, 2, 4):
        assert least < piloted(deviation, seed, seen).gain() < most


def test_the_rate_is_that_of_stratified_samples() -> None:
    """1 where the second half of the samples halves the squared error, and less where it does more."""
    pilot = piloted(np.full((HEIGHT, WIDTH), 0.1), 0)
    assert pilot.rate == pytest.approx(1, abs=0.02)
    halves = pilot.items.half_difference.copy()
    first, second = np.split(halves, 2)
    second[:] = -0.5 * first
    assert Pilot(pilot.tiles, Pixels(pilot.items.mean, pilot.items.variance, halves)).rate == pytest.approx(
        0.2, abs=0.01
    )
