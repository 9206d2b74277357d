# SPDX-License-Identifier: MIT
"""What samples say of pixels: the mean, and how far it may be from the truth."""

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

_BAND = 32  # rows of a picture, whose arrays stay in the processor's cache while they are worked on
_NEIGHBOURS = 11  # pixels, a side of the square that tells by how much stratification lowers the variance
DARK = 0.1  # of the mean brightness
_DIMMEST = 1e-16  # a mean of which a deviation of a thousandth has a square that is a float32


@dataclass(frozen=True)
class Pixels:
    """What a film knows of some pixels, row 0 at the top; arrays are float32.

    ``mean`` (height, width, 4) is radiance and the number of finite samples, ``variance`` (height, width, 4) that
    between samples and the number of samples that are not finite, ``half_difference`` (height, width, 3) the mean of
    samples with alternating signs; they belong to two independent halves.
    """

    mean: Floats
    variance: Floats
    half_difference: Floats

    def standard_error(self) -> Floats:
        """Standard error of the mean, (height, width, 3); infinite below two samples.

        The variance between samples, over their number, is that of independent samples. Stratified ones do better, by a
        factor that the half-differences of the pixels around tell. Where rare samples are bright, many pixels have not
        met one yet: the variance over the mean is therefore averaged over the pixels next to each.
        """

        def of(*images: Floats) -> list[Floats]:
            return [Pixels(*images)._standard_error()]

        (error,) = in_bands(of, (self.mean, self.variance, self.half_difference), _NEIGHBOURS // 2)
        return error

    def _standard_error(self) -> Floats:
        mean, degrees = self.mean[..., :3].astype(np.float64), self.mean[..., 3:].astype(np.float64) - 1
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            independent = np.where(degrees > 0, self.variance[..., :3] / degrees, 0)
            relative = np.where(mean > 0, independent / mean, 0)
            smooth = np.where(mean > 0, around(relative, 3) * mean, independent)
            halves = np.where(degrees > 0, self.centred_half_difference() ** 2, 0)
            factor = around(color_sum(halves), _NEIGHBOURS) / around(color_sum(independent), _NEIGHBOURS)
            error = np.sqrt(smooth * np.where(np.isfinite(factor), factor, 1)[..., None])
        return np.where(degrees > 0, error, np.inf).astype(np.float32)

    def relative_error(self) -> float:
        """Mean standard error over mean radiance; 0 for a black image, and infinite where the variance overflows
        a float32 or underflows it."""
        mean = float(self.mean[..., :3].mean(dtype=np.float64))
        return _known(float(self.standard_error().mean(dtype=np.float64)) / mean, mean) if mean > 0 else 0.0

    def worst_error(self) -> float:
        """The 99th percentile of the pixels' standard error over their brightness, in the mean of the colours; pixels
        darker than a tenth of the mean brightness count as if they were that bright. 0 for a black image, and infinite
        where more than one pixel in a hundred has fewer than two samples or a variance that overflows or underflows."""
        error = self.standard_error().mean(axis=2, dtype=np.float64)
        brightness = bright(self.mean)
        if not brightness.any():
            return 0.0
        return _known(float(np.percentile(error / brightness, 99, method="higher")), float(brightness.mean()))

    def centred_half_difference(self) -> NDArray[np.float64]:
        """Half the difference of the means of two halves, (height, width, 3), also where one has a sample more."""
        count = self.mean[..., 3:].astype(np.float64)
        odd = count - 2 * np.floor(count / 2)
        return np.asarray(self.half_difference - self.mean[..., :3] * odd / np.maximum(count, 1))


def _known(error: float, mean: float) -> float:
    """A relative ``error`` of what has that ``mean``, above 0."""
    return error if error < math.inf and mean >= _DIMMEST else math.inf


def in_bands(
    function: Callable[..., Sequence[NDArray[Any]]], images: Sequence[NDArray[Any]], halo: int = 0
) -> list[NDArray[Any]]:
    """The arrays that ``function`` makes of ``images``, all of the same height, a band of rows at a time, and several
    bands at once. A row of them may depend on ``halo`` rows of the images above and below it."""
    height = len(images[0])

    def band(top: int) -> list[NDArray[Any]]:
        first, bottom = max(0, top - halo), min(height, top + _BAND)
        return [part[top - first : bottom - first] for part in function(*(i[first : bottom + halo] for i in images))]

    first_band = band(0)
    made = [np.empty((height, *part.shape[1:]), part.dtype) for part in first_band]

    def fill(top: int, parts: Sequence[NDArray[Any]]) -> None:
        for whole, part in zip(made, parts, strict=True):
            whole[top : top + _BAND] = part

    fill(0, first_band)
    if height > _BAND:
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            for _ in threads.map(lambda top: fill(top, band(top)), range(_BAND, height, _BAND)):
                pass
    return made


def color_sum(colors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of the first three channels, which numpy's own sum over the last axis takes long for."""
    return np.asarray(colors[..., 0] + colors[..., 1] + colors[..., 2])


def bright(image: Floats) -> NDArray[np.float64]:
    """Brightness of each pixel of (height, width, 3 or 4), the mean of the colours, (height, width); that of darker
    ones is a tenth of the mean of all."""
    brightness = color_sum(image.astype(np.float64)) / 3
    return np.asarray(np.maximum(brightness, DARK * brightness.mean()))


def around(values: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """The mean over the square of ``side`` pixels around each; the first two axes are height and width."""
    height, width = values.shape[:2]
    padded = np.pad(values, [(side // 2,) * 2] * 2 + [(0, 0)] * (values.ndim - 2), mode="edge")
    rows = np.asarray(sum(padded[k : k + height] for k in range(side)))
    return np.asarray(sum(rows[:, k : k + width] for k in range(side))) / side**2
