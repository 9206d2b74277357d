# SPDX-License-Identifier: MIT
"""Gradient-domain path tracing: pictures from differences of neighbouring pixels, which have less noise than they.

Blocks of 2 x 2 pixels take the same random numbers, so that their paths are alike and the differences within a block
have little noise (the random-replay shift of Hua et al. 2019, A Survey on Gradient-Domain Rendering). Half of the
samples are of one tiling of the image with such blocks, half of another, shifted by a pixel both ways; so each two
neighbours are in a block of one of them. The picture is the one whose pixels and differences are nearest to those
found, by weighted least squares (Lehtinen et al. 2013, Gradient-Domain Metropolis Light Transport; Kettunen et al.
2015, Gradient-Domain Path Tracing; Rousselle et al. 2016, Image-Space Control Variates for Rendering). It is linear in
the samples, and its weights come from others; so it is unbiased. docs/sampling.md has the proof, and what it gives.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.sampling.allocation import FIRST_STAGE, WorkList
from fragtracer.sampling.pilot import SAMPLES, TILE, Tiles, others, others_pay, twice
from fragtracer.sampling.pixels import Pixels, around

Floats = NDArray[np.float64]

# Whose random numbers the samples of an item take: those of the pixel's block (film/work.glsl).
ALIGNED, SHIFTED = 0x8000, 0x80008000
LEAST_GAIN = 1.2  # in squared error, at which the pilot says that differences pay (docs/sampling.md)
_DARK = 0.7  # of the brightness of a pixel and those around it: below, it is seen as a dark dot
_MOST_DARK = 3e-4  # of the pixels that may be such dots (docs/sampling.md)
_DECORRELATIONS = (0.05, 0.1, 0.2, 0.4, 0.8)
_NEIGHBOURS = 5  # pixels, a side of the square around one
_SMOOTH = 0.1065  # of a pixel's variance for each neighbour in a row: a Gaussian of half a pixel
_LEAST_VARIANCE = 0.01  # of the median
_REMAINDER = 1e-3  # of what is to be found, that the solution may miss
_ROUNDING = 1e-6  # relative, of a running mean in float32


@dataclass(frozen=True)
class Gradients:
    """What a pilot says of differences: they divide the mean squared relative error of 128 samples by ``gain``, where
    neighbours are taken to have a correlation of 1 - ``decorrelation``. The share ``dark`` of the pixels comes out much
    darker than they and the pixels around them are: beside rare bright samples, of which differences take as much away
    there as they put elsewhere."""

    gain: float
    decorrelation: float
    dark: float = 0.0

    @property
    def pays(self) -> bool:
        return self.gain >= LEAST_GAIN and self.dark <= _MOST_DARK


UNKNOWN = Gradients(1.0, 0.2)  # of a picture that is too small for a pilot


@dataclass(frozen=True)
class Weights:
    """Of the squares that :func:`reconstruct` makes small: of the pixels, (..., height, width), and of the differences
    of neighbours in a row, (..., height, width - 1), and in a column, (..., height - 1, width).

    ``least`` is a lower bound of the eigenvalues of the equations divided by their diagonal, whose upper one is 2.
    """

    pixels: Floats
    rows: Floats
    columns: Floats
    least: float

    @staticmethod
    def of(variance: Floats, decorrelation: float) -> "Weights":
        """The inverse variances that follow from those of single samples, (..., height, width), where neighbours have
        the correlation 1 - ``decorrelation`` > 0: those of pixels are means of twice as many samples as differences.
        """
        largest = float(np.finfo(np.float32).max)  # in the place of what overflows
        smooth = _smooth(_smooth(np.nan_to_num(variance, nan=largest, posinf=largest), -1), -2)
        median = float(np.median(smooth[smooth > 0])) if smooth.any() else 1.0
        deviation = np.sqrt(smooth + _LEAST_VARIANCE * median)

        def inverse(one: Floats, other: Floats) -> Floats:
            return np.asarray(1 / ((one - other) ** 2 + 2 * decorrelation * one * other))

        rows = inverse(deviation[..., 1:], deviation[..., :-1])
        columns = inverse(deviation[..., 1:, :], deviation[..., :-1, :])
        # The largest weight of a difference, over the inverse variance of one of its pixels, is 1 / spread.
        spread = decorrelation * (2 - decorrelation)
        return Weights(2 / deviation**2, rows, columns, spread / (spread + 2))


def reconstruct(aligned: Floats, shifted: Floats, weights: Weights) -> Floats:
    """The pictures whose pixels are nearest to the mean of two, and whose differences to those that these have within
    their blocks.

    Parameters
    ----------
    aligned, shifted
        (channels, ..., height, width), row 0 at the bottom. Blocks of ``aligned`` begin at even rows and columns, those
        of ``shifted`` at odd ones.
    weights
        Of the squares of what is missed, alike for all channels.

    Returns
    -------
    float64 array (channels, ..., height, width)
        By as many steps of the Chebyshev semi-iteration (Saad 2003, Iterative Methods for Sparse Linear Systems,
        algorithm 12.1) as leave a thousandth. Each step is linear in what is given, and leaves a picture alone whose
        differences are the given ones: the result has no bias, however many steps there are.
    """
    solve = partial(_reconstructed, weights=weights, shares=_Shares.of_weights(weights))
    with ThreadPoolExecutor(max(1, min(len(aligned), os.cpu_count() or 1))) as pool:
        return np.stack(list(pool.map(solve, aligned, shifted)))


@dataclass(frozen=True)
class _Shares:
    """The equations, divided by their ``diagonal`` (..., height, width): a pixel less its neighbours, each times its
    share ``of`` it. By axis: the share that the second of two neighbours has of the first, and the other way round."""

    diagonal: Floats
    of: dict[int, tuple[Floats, Floats]]

    @staticmethod
    def of_weights(weights: Weights) -> "_Shares":
        by_axis = {-1: weights.rows, -2: weights.columns}
        diagonal = weights.pixels.copy()
        for axis, of_pairs in by_axis.items():
            for side in _sides(diagonal, axis):
                side += of_pairs
        of = {}
        for axis, of_pairs in by_axis.items():
            first, second = _sides(diagonal, axis)
            of[axis] = of_pairs / first, of_pairs / second
        return _Shares(diagonal, of)


def _reconstructed(aligned: Floats, shifted: Floats, weights: Weights, shares: _Shares) -> Floats:
    """:func:`reconstruct` for one channel."""
    picture = (aligned + shifted) / 2
    missed = []
    for axis, weight in ((-1, weights.rows), (-2, weights.columns)):
        is_shifted = np.arange(weight.shape[axis]) % 2 == 1
        is_shifted = is_shifted if axis == -1 else is_shifted[:, None]
        found = np.where(is_shifted, np.diff(shifted, axis=axis), np.diff(aligned, axis=axis))
        missed.append(weight * (found - np.diff(picture, axis=axis)))
    residual = -_divergence(*missed) / shares.diagonal
    centre, radius = (2 + weights.least) / 2, (2 - weights.least) / 2
    condition = np.sqrt(2 / weights.least)
    steps = int(np.ceil(np.log(2 / _REMAINDER) / np.log((condition + 1) / (condition - 1))))
    rate, change, product = radius / centre, residual / centre, np.empty_like(residual)
    for _ in range(steps):
        picture += change
        residual -= change
        for axis, (of_second, of_first) in shares.of.items():
            first, second = _sides(change, axis)
            to_first, to_second = _sides(residual, axis)
            buffer, _ = _sides(product, axis)
            to_first += np.multiply(of_second, second, out=buffer)
            to_second += np.multiply(of_first, first, out=buffer)
        before, rate = rate, 1 / (2 * centre / radius - rate)
        change *= rate * before
        change += np.multiply(residual, 2 * rate / radius, out=product)
    return picture


def _divergence(rows: Floats, columns: Floats) -> Floats:
    """What flows into each pixel, less what flows out, of flows to the neighbours on the left and below."""
    *batch, height, _ = rows.shape
    result = np.zeros((*batch, height, columns.shape[-1]))
    for flow, axis in ((rows, -1), (columns, -2)):
        first, second = _sides(result, axis)
        first += flow
        second -= flow
    return result


def _sides(image: Floats, axis: int) -> tuple[Floats, Floats]:
    """The first and the second of all pairs of neighbours along an axis, as views."""
    return (image[..., :-1], image[..., 1:]) if axis == -1 else (image[..., :-1, :], image[..., 1:, :])


def picture(aligned: Pixels, shifted: Pixels, weights: Weights) -> Pixels:
    """Of the films of the two tilings, row 0 at the top; with the half-difference of the picture itself."""
    channels = [
        np.concatenate([film.mean[..., :3], film.centred_half_difference()], axis=2).transpose(2, 0, 1)[:, ::-1]
        for film in (aligned, shifted)
    ]
    found = reconstruct(channels[0], channels[1], weights)[:, ::-1].transpose(1, 2, 0)
    mean, halves = found[..., :3], found[..., 3:]
    counts = [film.mean[..., 3:].astype(np.float64) for film in (aligned, shifted)]
    count = counts[0] + counts[1]
    share = counts[1] / np.maximum(count, 1)
    variance = aligned.variance + (shifted.variance - aligned.variance) * share
    variance[..., 3] = aligned.variance[..., 3] + shifted.variance[..., 3]
    halves = halves + mean * (count % 2) / np.maximum(count, 1)  # as Pixels has it of an odd number
    parts = np.concatenate([mean, count], axis=2), variance, halves
    return Pixels(*(part.astype(np.float32) for part in parts))


def film_weights(variance: NDArray[np.floating[Any]], decorrelation: float) -> Weights:
    """Those of a film of single pixels with a ``variance`` between samples (height, width, 3), row 0 at the top."""
    return Weights.of(variance.mean(axis=2, dtype=np.float64)[::-1], decorrelation)


def pilot_list(pixels: NDArray[np.int64]) -> WorkList:
    """Items whose samples say whether differences pay: two of each pixel of a pilot's tiles, (tiles, TILE²), one for
    each tiling of the image; their samples follow those of all other items."""
    items = twice(pixels)
    numbers = np.repeat(np.array([ALIGNED, SHIFTED], np.uint32), TILE**2)
    return WorkList(items, np.full_like(items, 3 * SAMPLES), np.resize(numbers, len(items)))


@dataclass(frozen=True)
class GradientPilot:
    """What the samples of :func:`pilot_list` say: ``items`` (items, 1) of ``tiles``, by their half-differences, which
    are linear in the samples as the picture is. The weights are those of a picture, from the ``variance`` (tiles, rows,
    columns) of single samples that are not these (:meth:`.Tiles.variance`). Point sets of half the size are less well
    stratified; what that loses is the ``rate`` of :class:`.Pilot`."""

    items: Pixels
    tiles: Tiles
    variance: Floats
    rate: float

    def found(self) -> Gradients:
        """The best decorrelation, and what comes of it."""
        gains = self._gains(self.tiles)
        return Gradients(float(gains.max()), self._decorrelation, self._dark(self.tiles))

    def asks_for_more(self, least_gain: float, width: int, height: int) -> bool:
        """Whether samples of the other tiles, too, would be worth more than they cost in a picture of that size, which
        is made from differences if their gain is ``least_gain`` and dark dots are few."""
        if others_pay(lambda tiles: float(self._gains(tiles).max()), least_gain, self.tiles, width, height):
            return True
        if self._gains(self.tiles).max() < least_gain or not others(self.tiles, width, height):
            return False
        return abs(self._dark(self.tiles) - _MOST_DARK) < 2 * self.tiles.deviation(self._dark)

    def _gains(self, tiles: Tiles) -> Floats:
        """By decorrelation, with these weights of the tiles."""
        plain, *made = np.average(self._errors, axis=1, weights=tiles.weights)
        return np.asarray(plain / np.array(made) * self.rate)

    @cached_property
    def _errors(self) -> Floats:
        """The mean squared relative errors of each tile, (1 + decorrelations, tiles): of single pixels, and of what is
        made of their differences."""
        halves = self.tiles.tiled(self.items.half_difference).astype(np.float64)
        aligned, shifted = np.moveaxis(halves, -1, 1)
        made = [reconstruct(aligned, shifted, self._weights(one)) for one in _DECORRELATIONS]
        pictures = np.stack([halves.mean(axis=0), *(np.moveaxis(channels, 0, -1) for channels in made)])
        squares = np.square(pictures / self._brightness[..., None])
        return np.asarray(squares.mean(axis=(2, 3, 4)) + _ROUNDING**2)

    def _dark(self, tiles: Tiles) -> float:
        """The share of dark dots, with these weights of the tiles."""
        return float(tiles.mean(self._dots))

    @cached_property
    def _dots(self) -> Floats:
        """1 where a dark dot is in what is made of the tiles themselves, and 0 elsewhere, (tiles, rows, columns)."""
        single = self.tiles.tiled(self.items.mean)[..., :3].mean(axis=-1, dtype=np.float64)
        made = reconstruct(single[:1], single[1:], self._weights(self._decorrelation))[0]
        before = single.mean(axis=0)
        expected = np.minimum(before, [around(tile, _NEIGHBOURS) for tile in before])
        is_dark = (made < _DARK * expected) & (before >= self._brightness)
        return np.asarray(is_dark, np.float64)

    @cached_property
    def _decorrelation(self) -> float:
        """The best one."""
        return _DECORRELATIONS[int(self._gains(self.tiles).argmax())]

    def _weights(self, decorrelation: float) -> Weights:
        return Weights.of(self.variance, decorrelation)

    @cached_property
    def _brightness(self) -> Floats:
        return self.tiles.bright(self.tiles.tiled(self.items.mean).mean(axis=0))


def decision(choice: str, found: Gradients | None, is_on: bool) -> str:
    """Whether pictures are made from differences, and why, where a pilot has found that, or has not begun."""
    if choice != "auto":
        return f"{choice}: as asked for"
    if found is None:
        return f"off: there are no more than {FIRST_STAGE} samples per pixel"
    said = f"at equal samples it divides the squared error by {found.gain:.2f}"
    if not is_on and found.gain >= LEAST_GAIN:
        return "off: bright samples are so rare that differences would leave dark dots beside them"
    return f"on: {said}" if is_on else f"off: {said}, < {LEAST_GAIN:g}"


def _smooth(values: Floats, axis: int) -> Floats:
    """A little, along one axis; at the edge as if the last pixel was repeated."""
    smooth = values.copy()
    one, other = _sides(values, axis)
    for side, change in zip(_sides(smooth, axis), (other - one, one - other), strict=True):
        side += _SMOOTH * change
    return smooth
