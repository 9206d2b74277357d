# SPDX-License-Identifier: MIT
"""What samples say of pixels: the mean, and how far it may be from the truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

_NEIGHBOURS = 11  # pixels, a side of the square that tells by how much stratification lowers the variance
DARK = 0.1  # of the mean brightness


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
        mean, degrees = self.mean[..., :3].astype(np.float64), self.mean[..., 3:].astype(np.float64) - 1
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            independent = np.where(degrees > 0, self.variance[..., :3] / degrees, 0)
            relative = np.where(mean > 0, independent / mean, 0)
            smooth = np.where(mean > 0, around(relative, 3) * mean, independent)
            halves = np.where(degrees > 0, self.centred_half_difference() ** 2, 0)
            factor = around(halves.sum(axis=2), _NEIGHBOURS) / around(independent.sum(axis=2), _NEIGHBOURS)
            error = np.sqrt(smooth * np.where(np.isfinite(factor), factor, 1)[..., None])
        return np.where(degrees > 0, error, np.inf).astype(np.float32)

    def relative_error(self) -> float:
        """Mean standard error over mean radiance; 0 for a black image."""
        mean = float(self.mean[..., :3].mean(dtype=np.float64))
        return float(self.standard_error().mean(dtype=np.float64)) / mean if mean > 0 else 0.0

    def worst_error(self) -> float:
        """The 99th percentile of the pixels' standard error over their brightness, in the mean of the colours; pixels
        darker than a tenth of the mean brightness count as if they were that bright. 0 for a black image."""
        error = self.standard_error().mean(axis=2, dtype=np.float64)
        brightness = bright(self.mean)
        return float(np.percentile(error / brightness, 99)) if brightness.any() else 0.0

    def centred_half_difference(self) -> NDArray[np.float64]:
        """Half the difference of the means of two halves, (height, width, 3), also where one has a sample more."""
        count = self.mean[..., 3:].astype(np.float64)
        return self.half_difference - self.mean[..., :3] * (count % 2) / np.maximum(count, 1)


def bright(image: Floats) -> NDArray[np.float64]:
    """Brightness of each pixel of (height, width, 3 or 4), the mean of the colours, (height, width); that of darker
    ones is a tenth of the mean of all."""
    brightness = image[..., :3].mean(axis=2, dtype=np.float64)
    return np.asarray(np.maximum(brightness, DARK * brightness.mean()))


def around(values: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """The mean over the square of ``side`` pixels around each; the first two axes are height and width."""
    height, width = values.shape[:2]
    padded = np.pad(values, [(side // 2,) * 2] * 2 + [(0, 0)] * (values.ndim - 2), mode="edge")
    rows = np.asarray(sum(padded[k : k + height] for k in range(side)))
    return np.asarray(sum(rows[:, k : k + width] for k in range(side))) / side**2
