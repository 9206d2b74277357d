# SPDX-License-Identifier: MIT
"""Films of disjoint samples of the same pixels, joined."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fragtracer.sampling.pixels import Pixels

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Moments:
    """What :class:`Pixels` are, in float64: the mean, the variance and the half-difference (height, width, 3), and the
    numbers of samples that were finite and that were not (height, width, 1)."""

    mean: Floats
    variance: Floats
    half_difference: Floats
    count: Floats
    non_finite: Floats

    @staticmethod
    def of(pixels: Pixels) -> "Moments":
        mean, variance = pixels.mean.astype(np.float64), pixels.variance.astype(np.float64)
        half_difference = pixels.half_difference.astype(np.float64)
        return Moments(mean[..., :3], variance[..., :3], half_difference, mean[..., 3:], variance[..., 3:])

    def merged(self, other: "Moments") -> "Moments":
        """All samples of both (Chan, Golub and LeVeque 1979, Updating Formulae and a Pairwise Algorithm for Computing
        Sample Variances, equations 2.1)."""
        count = self.count + other.count
        share = np.divide(other.count, count, out=np.zeros_like(count), where=count > 0)
        delta = other.mean - self.mean
        mean = self.mean + delta * share
        spread = np.square(delta) * share * (1 - share)
        variance = self.variance + (other.variance - self.variance) * share + spread
        half_difference = self.half_difference + (other.half_difference - self.half_difference) * share
        return Moments(mean, variance, half_difference, count, self.non_finite + other.non_finite)

    def pixels(self) -> Pixels:
        """In float32, as a film has them."""
        mean = np.concatenate([self.mean, self.count], axis=2)
        variance = np.concatenate([self.variance, self.non_finite], axis=2)
        return Pixels(*(image.astype(np.float32) for image in (mean, variance, self.half_difference)))
