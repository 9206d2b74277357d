# SPDX-License-Identifier: MIT
"""Pilots: samples that are in no picture, and say whether adaptive sampling pays.

A survey of some pixels all over the image tells where the error is. By that, tiles of pixels are drawn, each of which
stands for as many as its probability says (Horvitz and Thompson 1952, A Generalization of Sampling Without Replacement
from a Finite Universe); so that few tiles speak for the whole image also where few pixels have the error. The samples
of the pilot proper are of all pixels of these tiles: of some of them first, and of the others where those leave too
much open.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fragtracer.sampling.allocation import BLOCK, FIRST_STAGE, MOST_STAGES, WorkList, block_order, shares
from fragtracer.sampling.pixels import DARK, Pixels, around, bright

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

TILE = 16  # pixels, a side
STREAM = MOST_STAGES  # of random numbers (shaders/sampler/stream.glsl)
SAMPLES = 64  # of each item
SURVEY_SAMPLES = 32  # of each item of a survey
_MOST_TILES, _LEAST_PART = 64, 4  # of the image's tiles one in so many at most, so that it costs little
_FIRST_TILES = 16  # of those that are drawn
_PICTURE = 10  # times the samples of the first stage: what a picture is taken to have, when its pilot costs too much
_SURVEYED = (TILE // BLOCK) ** 2  # pixels of a tile
_SMOOTH = 5  # pixels, a side of the square over which the variance is averaged
_LARGEST = 1e30  # of a relative variance, and in the place of one that overflows a float32
_ROUNDING = 1e-6  # relative, of a running mean in float32


def tiles_of(width: int, height: int) -> int:
    """Number of all tiles of an image; what is left over above and on the right is in none."""
    return (width // TILE) * (height // TILE)


def pilot_samples(width: int, height: int) -> tuple[Counts, Counts]:
    """Of all items of a pilot, (items, 1), those of the survey first: of one that ends with its first tiles, and of one
    that goes on."""
    surveyed, drawn = tiles_of(width, height) * _SURVEYED, _drawn(tiles_of(width, height))

    def items(tiles: int) -> Counts:
        return np.repeat([SURVEY_SAMPLES, SAMPLES], [surveyed, 2 * tiles * TILE**2])[:, None]

    return items(min(_FIRST_TILES, drawn)), items(drawn)


def _drawn(tiles: int) -> int:
    """Of so many tiles, one at least if there is one."""
    return min(-(-tiles // _LEAST_PART), _MOST_TILES)


def survey_list(width: int, height: int) -> WorkList:
    """One pixel of each block of 4 x 4, tile by tile; their samples follow those of the pilot proper."""
    side = TILE // BLOCK
    y, x = np.divmod(np.arange(_SURVEYED), side)
    tiles = np.arange(tiles_of(width, height))
    pixels = _pixels(tiles, BLOCK * y + BLOCK // 2, BLOCK * x + BLOCK // 2, width, height).reshape(-1)
    return WorkList(pixels, np.full_like(pixels, 2 * SAMPLES))


@dataclass(frozen=True)
class Tiles:
    """Some tiles of an image.

    ``pixels`` (tiles, TILE²) are the numbers of theirs, row by row from the top of the image, in the order of blocks
    from the lowest row of a tile; ``weights`` (tiles,) say for how many tiles each stands. Their rows and columns begin
    at multiples of ``TILE``, counted from below.
    """

    pixels: Counts
    weights: Floats

    @staticmethod
    def by(survey: Pixels, width: int, height: int) -> tuple["Tiles", "Tiles"]:
        """Some drawn by what a survey has found, (items, 1), and more, of which those are the first: a third of their
        probability is even, a third in proportion to the deviation of a sample, relative to the brightness, and a third
        to its square. Both stand for the image."""
        variance = survey.variance[..., :3].mean(axis=2, dtype=np.float64).reshape(-1, _SURVEYED)
        brightness = np.maximum(bright(survey.mean), 1e-30).reshape(-1, _SURVEYED)
        relative = np.nan_to_num((variance / brightness**2).mean(axis=1), nan=_LARGEST, posinf=_LARGEST)
        shares_of = (values / max(values.mean(), 1e-30) for values in (np.sqrt(relative), relative))
        wanted = 1 + sum(shares_of, np.zeros_like(relative))
        most = _drawn(len(relative))
        least = min(most, _FIRST_TILES)
        chance = _chances(wanted, most)
        rng = np.random.default_rng(0)
        order = np.lexsort((rng.permutation(len(chance)), chance))
        tiles = order[_systematic(chance[order], rng)]
        weights = 1 / chance[tiles]
        of_first = _chances(_chances(wanted, least)[tiles] * weights, least)
        is_first = _systematic(of_first, rng)
        first, others = np.flatnonzero(is_first), np.flatnonzero(~is_first)
        y, x = np.divmod(block_order(TILE, TILE), TILE)
        pixels = _pixels(tiles[np.concatenate([first, others])], y, x, width, height)
        return (
            Tiles(pixels[:least], (weights / of_first)[first]),
            Tiles(pixels, np.concatenate([weights[first], weights[others]])),
        )

    def mean(self, values: Floats) -> Floats:
        """Of the image, where ``values`` (..., tiles, rows, columns) are those of the tiles' pixels."""
        return np.average(values.mean(axis=(-2, -1)), axis=-1, weights=self.weights)

    def tiled(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """(times, tiles, TILE, TILE, channels), the lowest row first, of (items, 1, channels), which are each tile's
        pixels so many times, tile by tile."""
        place, (channels,) = np.argsort(block_order(TILE, TILE)), values.shape[2:]
        of_tiles = values.reshape(len(self.pixels), -1, TILE**2, channels)[:, :, place]
        return np.moveaxis(of_tiles.reshape(len(self.pixels), -1, TILE, TILE, channels), 1, 0)

    def variance(self, items: Pixels) -> Floats:
        """Between samples, in the mean of the colours, (tiles, rows, columns), of ``items`` in the order of
        :meth:`tiled`."""
        return np.asarray(self.tiled(items.variance)[..., :3].mean(axis=(0, -1), dtype=np.float64))

    def bright(self, color: NDArray[np.floating]) -> Floats:
        """Brightness, (tiles, rows, columns), of colours; see :func:`fragtracer.sampling.pixels.bright`."""
        brightness = color[..., :3].mean(axis=-1, dtype=np.float64)
        return np.asarray(np.maximum(brightness, np.maximum(DARK * self.mean(brightness), 1e-30)))

    def deviation(self, found: Callable[["Tiles"], float]) -> float:
        """The standard deviation of what is found by the weights of an even number of tiles: by leaving each out for
        the next one, which was drawn by about the same chance (Jones 1974, Jackknife Estimation of Functions of Stratum
        Means)."""
        without = []
        for tile in range(len(self.weights)):
            weights = self.weights.copy()
            weights[tile ^ 1] += weights[tile]
            weights[tile] = 0
            without.append(found(replace(self, weights=weights)))
        one, other = np.reshape(without, (-1, 2)).T
        return float(np.sqrt(((one - other) ** 2 / 4).sum()))


def _systematic(chance: Floats, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Which are drawn by systematic sampling: at equal distances along the sum of the chances, from a place that is
    drawn, so that things have their share that are next to each other."""
    places = np.cumsum(np.concatenate([[rng.random()], chance]))
    return np.asarray(np.diff(np.floor(places + 1e-9)) > 0)


def _chances(wanted: Floats, most: int) -> Floats:
    """Probabilities in proportion to what is wanted, together ``most``, and each at most 1."""
    is_certain = np.zeros(len(wanted), bool)
    while True:
        left = most - is_certain.sum()
        chance = np.where(is_certain, 1.0, wanted * left / max(wanted[~is_certain].sum(), 1e-30))
        if (chance <= 1.0).all():
            return chance
        is_certain |= chance >= 1.0


def _pixels(tiles: Counts, rows: Counts, columns: Counts, width: int, height: int) -> Counts:
    """Numbers of pixels, (tiles, pixels), of the same places in tiles; rows from below."""
    y, x = np.divmod(tiles[:, None], max(1, width // TILE))
    return np.asarray((height - 1 - TILE * y - rows) * width + TILE * x + columns)


def pilot_list(pixels: Counts) -> WorkList:
    """Two items of each pixel of tiles, (tiles, TILE²), tile by tile: first come all its pixels, then all once more."""
    first = np.repeat([0, SAMPLES], TILE**2)
    return WorkList(twice(pixels), np.tile(first, len(pixels)))


def twice(pixels: Counts) -> Counts:
    """Those of each tile, (tiles, pixels), one after the other and then once more."""
    return np.repeat(pixels[:, None], 2, axis=1).reshape(-1)


@dataclass(frozen=True)
class Pilot:
    """What a pilot has found: ``items`` (items, 1), those of :func:`pilot_list`, of ``tiles``: the first of those that
    were ``drawn``, or all, which are given in this order."""

    tiles: Tiles
    items: Pixels
    drawn: tuple[Tiles, Tiles]

    @staticmethod
    def of(samples: Pixels, width: int, height: int) -> "Pilot":
        """``samples`` are the items of :func:`survey_list`, and then those of the tiles that follow from them, or of
        the first of these."""
        surveyed = tiles_of(width, height) * _SURVEYED
        survey, items = (
            Pixels(*(values[part] for values in vars(samples).values()))
            for part in (slice(surveyed), slice(surveyed, None))
        )
        first, every = drawn = Tiles.by(survey, width, height)
        return Pilot(first if len(items.mean) == 2 * first.pixels.size else every, items, drawn)

    def gain(self) -> float:
        """By how much adaptive sampling lowers the mean squared relative error at equal samples.

        One half of the items plans, the other tells what that is worth, so that chance is not taken for a difference
        between pixels. Both together say how much faster than 1 / n the squared error falls: a plan gives up some of
        that, which is taken for the square of it (docs/sampling.md).
        """
        return self._gain(self.tiles)

    def _gain(self, tiles: Tiles) -> float:
        """With these weights of the tiles."""
        deviation = np.sqrt(self._squares)
        planned = [shares(one / tiles.mean(one)) for one in deviation]
        left = (tiles.mean(self._squares[1] / planned[0]) + tiles.mean(self._squares[0] / planned[1])) / 2
        return float(tiles.mean(self._squares.mean(axis=0)) / left * self._rate(tiles) ** 2)

    def asks_for_more(self, least_gain: float, is_rare: bool, width: int, height: int) -> bool:
        """Whether samples of the other tiles, too, would be worth more than they cost in a picture of that size, where
        all that matters is whether the gain is ``least_gain``. That these tiles have found less means nothing where the
        error ``is_rare``, since others may have it."""
        asks = others_pay(self._gain, least_gain, self.tiles, width, height)
        return asks or (is_rare and self.gain() < least_gain and others(self.tiles, width, height) > 0)

    def deviation(self) -> float:
        """The standard deviation of the logarithm of the gain."""
        return self.tiles.deviation(lambda tiles: math.log(self._gain(tiles)))

    @cached_property
    def rate(self) -> float:
        """Twice the squared error of all samples over that of half of them, at most 1: 1 for independent samples, and
        less for stratified ones."""
        return self._rate(self.tiles)

    def _rate(self, tiles: Tiles) -> float:
        def error(halves: Floats) -> float:
            return float(tiles.mean(np.square(halves).mean(axis=-1)).mean()) + _ROUNDING**2

        return min(1.0, 2 * error(self._halves.mean(axis=0)) / error(self._halves))

    @cached_property
    def _halves(self) -> Floats:
        """The half-differences, relative to the brightness, (2, tiles, rows, columns, 3)."""
        return self.tiles.tiled(self.items.half_difference) / self._brightness[..., None]

    @cached_property
    def _squares(self) -> Floats:
        """The smooth squared relative error of each half of the items, (2, tiles, rows, columns)."""
        mean = self.tiles.tiled(self.items.mean)
        variance, half_difference = self.tiles.tiled(self.items.variance), self.tiles.tiled(self.items.half_difference)
        error = np.array(
            [
                [Pixels(*tile).standard_error().mean(axis=2, dtype=np.float64) for tile in zip(*half, strict=True)]
                for half in zip(mean, variance, half_difference, strict=True)
            ]
        )
        squares = np.nan_to_num((error / self._brightness) ** 2, nan=_LARGEST, posinf=_LARGEST) + _ROUNDING**2
        return np.array([[around(tile, _SMOOTH) for tile in half] for half in squares])

    @cached_property
    def _brightness(self) -> Floats:
        return self.tiles.bright(self.tiles.tiled(self.items.mean).mean(axis=0))


def others(tiles: Tiles, width: int, height: int) -> int:
    """How many more are drawn of an image than these."""
    return _drawn(tiles_of(width, height)) - len(tiles.weights)


def others_pay(gain: Callable[[Tiles], float], least_gain: float, tiles: Tiles, width: int, height: int) -> bool:
    """Whether 2 x :data:`SAMPLES` samples of each pixel of the other tiles, too, would be worth more than they cost in
    a picture of that size, where all that matters is whether a ``gain``, which these tell by their weights, is
    ``least_gain``.

    What a wrong decision loses is taken to be the ratio of both, and the logarithm of the gain to be normally
    distributed. The picture is taken to have :data:`_PICTURE` times the samples of the first stage.
    """
    left = others(tiles, width, height)
    if not left:
        return False
    cost = 2 * SAMPLES * left * TILE**2 / (_PICTURE * FIRST_STAGE * width * height)
    distance = abs(math.log(gain(tiles) / least_gain))
    return expected_loss(distance, tiles.deviation(lambda some: math.log(gain(some)))) > cost


def expected_loss(distance: float, deviation: float) -> float:
    """The mean of max(0, x), where x is normally distributed about -``distance`` with that ``deviation``."""
    if deviation == 0:
        return 0.0
    z = distance / deviation
    density = math.exp(-z * z / 2) / math.sqrt(2 * math.pi)
    return deviation * density - distance * math.erfc(z / math.sqrt(2)) / 2
