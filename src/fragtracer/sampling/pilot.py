# SPDX-License-Identifier: MIT
"""Pilots: samples that are in no picture, and say whether adaptive sampling pays.

A survey of some pixels all over the image tells where the error is. By that, tiles of pixels are drawn, each of which
stands for as many as its probability says (Horvitz and Thompson 1952, A Generalization of Sampling Without Replacement
from a Finite Universe); so that few tiles speak for the whole image also where few pixels have the error. The samples
of the pilot proper are of all pixels of these tiles.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fragtracer.sampling.allocation import BLOCK, MOST_STAGES, WorkList, block_order, shares
from fragtracer.sampling.pixels import DARK, Pixels, around, bright

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

TILE = 16  # pixels, a side
STREAM = MOST_STAGES  # of random numbers (shaders/sampler/stream.glsl)
SAMPLES = 64  # of each item
SURVEY_SAMPLES = 32  # of each item of a survey
_MOST_TILES, _LEAST_PART = 64, 4  # of the image's tiles one in so many at most, so that it costs little
_SURVEYED = (TILE // BLOCK) ** 2  # pixels of a tile
_SMOOTH = 5  # pixels, a side of the square over which the variance is averaged
_ROUNDING = 1e-6  # relative, of a running mean in float32


def tiles_of(width: int, height: int) -> int:
    """Number of all tiles of an image; what is left over above and on the right is in none."""
    return (width // TILE) * (height // TILE)


def pilot_samples(width: int, height: int) -> Counts:
    """Of all items of a pilot, (items, 1), those of the survey first."""
    surveyed, items = tiles_of(width, height) * _SURVEYED, 2 * _drawn(tiles_of(width, height)) * TILE**2
    return np.repeat([SURVEY_SAMPLES, SAMPLES], [surveyed, items])[:, None]


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
    def by(survey: Pixels, width: int, height: int) -> "Tiles":
        """Drawn by what a survey has found, (items, 1): a third of their probability is even, a third in proportion to
        the deviation of a sample, relative to the brightness, and a third to its square."""
        variance = survey.variance[..., :3].mean(axis=2, dtype=np.float64).reshape(-1, _SURVEYED)
        brightness = np.maximum(bright(survey.mean), 1e-30).reshape(-1, _SURVEYED)
        relative = variance / brightness**2
        chance = _chances(relative.mean(axis=1))
        # Systematic sampling: at equal distances along the sum of the chances, from a place that is drawn, in their
        # order, so that tiles of all deviations have their share.
        rng = np.random.default_rng(0)
        order = np.lexsort((rng.permutation(len(chance)), chance))
        places = np.cumsum(np.concatenate([[rng.random()], chance[order]]))
        tiles = order[np.diff(np.floor(places + 1e-9)) > 0]
        y, x = np.divmod(block_order(TILE, TILE), TILE)
        return Tiles(_pixels(tiles, y, x, width, height), 1 / chance[tiles])

    def every(self, step: int) -> "Tiles":
        """One of so many."""
        return Tiles(self.pixels[::step], self.weights[::step])

    def mean(self, values: Floats) -> Floats:
        """Of the image, where ``values`` (..., tiles, rows, columns) are those of the tiles' pixels."""
        return np.average(values.mean(axis=(-2, -1)), axis=-1, weights=self.weights)

    def tiled(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """(times, tiles, TILE, TILE, channels), the lowest row first, of (items, 1, channels), which are all tiles'
        pixels so many times."""
        place = np.argsort(block_order(TILE, TILE))
        shape = (-1, len(self.pixels), TILE, TILE, values.shape[-1])
        return values.reshape(-1, len(self.pixels), TILE**2, values.shape[-1])[:, :, place].reshape(shape)

    def bright(self, color: NDArray[np.floating]) -> Floats:
        """Brightness, (tiles, rows, columns), of colours; see :func:`fragtracer.sampling.pixels.bright`."""
        brightness = color[..., :3].mean(axis=-1, dtype=np.float64)
        return np.asarray(np.maximum(brightness, np.maximum(DARK * self.mean(brightness), 1e-30)))


def _chances(variance: Floats) -> Floats:
    """The probability of each tile to be drawn; together as many as there are to be, and each at most 1."""
    most = _drawn(len(variance))
    shares_of = (values / max(values.mean(), 1e-30) for values in (np.sqrt(variance), variance))
    wanted = 1 + sum(shares_of, np.zeros_like(variance))
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


def pilot_list(tiles: Tiles) -> WorkList:
    """Two items of each pixel of the tiles: first come all pixels, then all once more."""
    pixels = tiles.pixels.reshape(-1)
    return WorkList(np.tile(pixels, 2), np.repeat([0, SAMPLES], len(pixels)))


@dataclass(frozen=True)
class Pilot:
    """What a pilot has found: ``items`` (items, 1), those of :func:`pilot_list`."""

    tiles: Tiles
    items: Pixels

    @staticmethod
    def of(samples: Pixels, width: int, height: int) -> "Pilot":
        """``samples`` are the items of :func:`survey_list`, and then those of the tiles that follow from them."""
        surveyed = tiles_of(width, height) * _SURVEYED
        survey, items = (
            Pixels(*(values[part] for values in vars(samples).values()))
            for part in (slice(surveyed), slice(surveyed, None))
        )
        return Pilot(Tiles.by(survey, width, height), items)

    def gain(self) -> float:
        """By how much adaptive sampling lowers the mean squared relative error at equal samples.

        One half of the items plans, the other tells what that is worth, so that chance is not taken for a difference
        between pixels. Both together say how much faster than 1 / n the squared error falls: a plan gives up some of
        that, which is taken for the square of it (docs/sampling.md).
        """
        mean = self.tiles.tiled(self.items.mean)
        variance, half_difference = self.tiles.tiled(self.items.variance), self.tiles.tiled(self.items.half_difference)
        error = np.array(
            [
                [Pixels(*tile).standard_error().mean(axis=2, dtype=np.float64) for tile in zip(*half, strict=True)]
                for half in zip(mean, variance, half_difference, strict=True)
            ]
        )
        squares = (error / self._brightness) ** 2 + _ROUNDING**2
        smooth = np.array([[around(tile, _SMOOTH) for tile in half] for half in squares])
        deviation = np.sqrt(smooth)
        planned = [shares(one / self.tiles.mean(one)) for one in deviation]
        left = (self.tiles.mean(smooth[1] / planned[0]) + self.tiles.mean(smooth[0] / planned[1])) / 2
        return float(self.tiles.mean(smooth.mean(axis=0)) / left * self.rate**2)

    @cached_property
    def rate(self) -> float:
        """Twice the squared error of all samples over that of half of them, at most 1: 1 for independent samples, and
        less for stratified ones."""
        relative = self.tiles.tiled(self.items.half_difference) / self._brightness[..., None]

        def error(halves: Floats) -> float:
            return float(self.tiles.mean(np.square(halves).mean(axis=-1)).mean()) + _ROUNDING**2

        return min(1.0, 2 * error(relative.mean(axis=0)) / error(relative))

    @cached_property
    def _brightness(self) -> Floats:
        return self.tiles.bright(self.tiles.tiled(self.items.mean).mean(axis=0))
