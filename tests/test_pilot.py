# SPDX-License-Identifier: MIT
"""Pilots: few tiles speak for the whole image, also where the error is in few pixels."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer import Renderer, load
from fragtracer.sampling.allocation import LEAST_GAIN
from fragtracer.sampling.gradients import Weights
from fragtracer.sampling.pilot import (
    SAMPLES,
    SURVEY_SAMPLES,
    TILE,
    Pilot,
    Tiles,
    expected_loss,
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


def piloted(deviation: Floats, seed: int, seen: float = 1.0, is_short: bool = False) -> Pilot:
    """Of an image of WIDTH x HEIGHT."""
    survey = sampled(survey_list(WIDTH, HEIGHT).pixels, deviation, SURVEY_SAMPLES, seed, seen)
    first, every = Tiles.by(survey, WIDTH, HEIGHT)
    items = pilot_list((first if is_short else every).pixels).pixels
    both = zip(vars(survey).values(), vars(sampled(items, deviation, SAMPLES, seed + 1, seen)).values(), strict=True)
    pixels = Pixels(*(np.concatenate(part) for part in both))
    np.testing.assert_array_equal(pixels.mean[..., 3], pilot_samples(WIDTH, HEIGHT)[not is_short])
    return Pilot.of(pixels, WIDTH, HEIGHT)


def in_tiles(values: Floats) -> Floats:
    """(tiles,), row by row from below, as an image (HEIGHT, WIDTH)."""
    return np.kron(values.reshape(HEIGHT // TILE, WIDTH // TILE)[::-1], np.ones((TILE, TILE)))


@pytest.mark.parametrize(("width", "height"), [(640, 480), (37, 21), (16, 16), (128, 130)])
def test_tiles_are_whole_and_apart(width: int, height: int) -> None:
    """A quarter of them, up to 64, of which 16 come first; they begin at even rows from below, as the blocks of the
    gradient domain do."""
    survey = survey_list(width, height)
    number = tiles_of(width, height)
    y, x = np.divmod(survey.pixels, width)
    assert len({*zip((height - 1 - y) // 4, x // 4, strict=True)}) == len(survey.pixels) == 16 * number
    first, tiles = Tiles.by(Pixels(*(np.ones((16 * number, 1, n), np.float32) for n in (4, 4, 3))), width, height)
    np.testing.assert_array_equal(first.pixels, tiles.pixels[:16])
    np.testing.assert_allclose(first.weights, number / len(first.weights))
    assert tiles.pixels.shape == (min(64, -(-number // 4)), 256)
    assert len(np.unique(tiles.pixels)) == tiles.pixels.size
    np.testing.assert_allclose(tiles.weights, number / len(tiles.weights))
    y, x = np.divmod(tiles.pixels, width)
    for place in (x, height - 1 - y):
        assert (np.ptp(place, axis=1) == 15).all()
        assert (place.min(axis=1) % 16 == 0).all()
    items = pilot_list(tiles.pixels)
    np.testing.assert_array_equal(
        np.bincount(items.first), [tiles.pixels.size, *[0] * (SAMPLES - 1), tiles.pixels.size]
    )
    assert survey.first.min() == 2 * SAMPLES  # samples of their own
    some = len(pilot_list(first.pixels).pixels)
    lengths = [len(survey.pixels) + items for items in (some, len(items.pixels))]
    assert lengths == [len(samples) for samples in pilot_samples(width, height)]
    order = tiles.tiled(items.pixels.reshape(-1, 1, 1).astype(np.float32))
    assert order.shape == (2, len(tiles.pixels), 16, 16, 1)
    np.testing.assert_array_equal(tiles.tiled(items.first.reshape(-1, 1, 1)).max(axis=(1, 2, 3, 4)), [0, SAMPLES])
    np.testing.assert_array_equal(order[0, 0, ::-1, :, 0], np.sort(tiles.pixels[0]).reshape(16, 16))


def test_a_variance_that_is_no_float32_is_the_largest() -> None:
    """Of a lamp as bright as 1e20: the pilot ends, and its tiles are drawn there."""
    deviation = np.ones((HEIGHT, WIDTH))
    work = survey_list(WIDTH, HEIGHT)
    survey = sampled(work.pixels, deviation, SURVEY_SAMPLES, 0)
    survey.variance[: 40 * 16, 0, :3] = np.inf
    _, tiles = Tiles.by(survey, WIDTH, HEIGHT)
    assert np.isfinite(tiles.weights).all()
    assert (tiles.weights < 1.5).sum() >= 20
    pixels = pilot_list(tiles.pixels).pixels
    items = sampled(pixels, deviation, SAMPLES, 1)
    items.variance[..., :3] = np.inf
    assert np.isfinite(Pilot(tiles, items, (tiles, tiles)).gain())
    assert np.isfinite(Weights.of(np.full((4, 4), np.inf), 0.1).pixels).all()


def test_an_image_without_room_has_no_tiles() -> None:
    assert tiles_of(3, 90) == tiles_of(90, 15) == len(survey_list(3, 90).pixels) == len(pilot_samples(3, 90)[1]) == 0


def test_tiles_stand_for_the_image() -> None:
    """Their weighted mean is that of the image, where few tiles have most of it, which are certain to be drawn."""
    rng = np.random.default_rng(0)
    deviation = np.full(512, 0.02)
    deviation[[7, 100, 101, 480]] = 1.0
    found = []
    for seed in range(20):
        survey = sampled(survey_list(WIDTH, HEIGHT).pixels, in_tiles(rng.permutation(deviation)), SURVEY_SAMPLES, seed)
        both = Tiles.by(survey, WIDTH, HEIGHT)
        found.append([tiles.weights.sum() for tiles in both])
        assert [np.isclose(tiles.weights, 1).sum() for tiles in both] == [4, 4]
    assert np.mean(found, axis=0) == pytest.approx(512, rel=0.02)


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
    halves = pilot.items.half_difference.reshape(-1, 2, TILE**2, 3).copy()
    halves[:, 1] = -0.5 * halves[:, 0]
    items = Pixels(pilot.items.mean, pilot.items.variance, halves.reshape(-1, 1, 3))
    assert Pilot(pilot.tiles, items, pilot.drawn).rate == pytest.approx(0.2, abs=0.01)


def spotted(seed: int) -> Floats:
    """Of tiles whose deviations differ threefold, and which have it in more or fewer of their pixels."""
    rng = np.random.default_rng(seed)
    share = in_tiles(rng.uniform(size=512) ** 2)
    is_spot = np.kron(rng.random((HEIGHT // 4, WIDTH // 4)), np.ones((4, 4))) < share
    return in_tiles(rng.permutation(np.geomspace(0.1, 0.3, 512))) * np.where(is_spot, 1, 0.05)


def test_the_first_tiles_tell_how_far_off_they_are() -> None:
    """Within a third, over images of the same kind."""
    pilots = [piloted(spotted(seed), seed, is_short=True) for seed in range(24)]
    true = np.std([np.log(pilot.gain()) for pilot in pilots], ddof=1)
    assert np.mean([pilot.deviation() for pilot in pilots]) == pytest.approx(true, rel=1 / 3)


def test_the_expected_loss_is_a_mean() -> None:
    numbers = np.random.default_rng(0).normal(size=1_000_000)
    for distance, deviation in ((0.0, 0.3), (0.2, 0.3), (0.5, 0.25)):
        expected = np.maximum(0, deviation * numbers - distance).mean()
        assert expected_loss(distance, deviation) == pytest.approx(expected, rel=0.02)
    assert expected_loss(0.1, 0.0) == 0


@pytest.mark.parametrize(
    ("gain", "is_rare", "asks", "asks_in_a_large_picture"),
    [(10.0, False, False, False), (1.05, False, False, True), (0.1, False, False, False), (0.1, True, True, True)],
)
def test_a_pilot_goes_on_where_its_first_tiles_leave_too_much_open(
    gain: float, is_rare: bool, asks: bool, asks_in_a_large_picture: bool
) -> None:
    """Not where a wrong decision is unlikely, or loses less than the other tiles cost, which is less in large pictures;
    where the error is rare, the first tiles may just not have it."""
    pilot = piloted(spotted(0), 0, is_short=True)
    least = pilot.gain() / gain
    assert pilot.asks_for_more(least, is_rare, WIDTH, HEIGHT) == asks
    assert pilot.asks_for_more(least, is_rare, 8 * WIDTH, 8 * HEIGHT) == asks_in_a_large_picture
    assert not piloted(spotted(0), 0).asks_for_more(least, is_rare, WIDTH, HEIGHT)  # there are no others


@pytest.mark.parametrize("goes_on", [False, True])
def test_a_pilot_that_goes_on_has_the_same_first_tiles(monkeypatch: pytest.MonkeyPatch, goes_on: bool) -> None:
    asked = []

    def asks_for_more(pilot: Pilot, least_gain: float, is_rare: bool, *size: int) -> bool:
        asked.append((pilot, least_gain, is_rare, size))
        return goes_on

    monkeypatch.setattr(Pilot, "asks_for_more", asks_for_more)
    with Renderer(load("three-spheres"), (160, 112), guiding="off", light_tracing="off", bounces=2) as renderer:
        found = Pilot.of(renderer.pilot(), 160, 112)
    ((pilot, *said),) = asked
    assert said == [LEAST_GAIN, False, (160, 112)]
    assert len(found.tiles.weights) == (18 if goes_on else 16)
    for some, all_of_them in zip(vars(pilot.items).values(), vars(found.items).values(), strict=True):
        np.testing.assert_array_equal(some, all_of_them[: len(some)])
