# SPDX-License-Identifier: MIT
"""Numbers that describe a comparison and never decide it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.relative_error import efficiency, relative_weight
from fragtracer.apps.compare.rendering import Rendering
from fragtracer.display.tone import srgb_encode

_DARK = 0.01  # of the mean radiance
_WHITE_QUANTILE, _WHITE = 0.9, 0.8  # the quantile of the pixels' brightest channels that is shown as 0.8


@dataclass(frozen=True)
class Measures:
    """Errors are relMSE (:mod:`.relative_error`), relative to the mean of both images.

    ``relative_mse`` is that of one image against the other. ``ours_relative_mse`` and ``reference_relative_mse`` are
    the variances of the two images, the means of all batches, estimated from the scatter between batches. ``flip`` is
    the mean of NVIDIA's FLIP error of the images as they are shown, 0 to 1 (Andersson et al. 2020, "FLIP: a
    difference evaluator for alternating images"); None without the package.
    """

    relative_mse: float
    ours_relative_mse: float
    reference_relative_mse: float
    flip: float | None
    exposure: float  # stops
    ours_seconds: float
    reference_seconds: float

    @property
    def expected_relative_mse(self) -> float:
        """What noise alone would make :attr:`relative_mse`."""
        return self.ours_relative_mse + self.reference_relative_mse

    @property
    def efficiencies(self) -> tuple[float | None, float | None]:
        """1 / (relMSE · s) of ours and of the reference; None for an image without noise."""
        ours = efficiency(self.ours_relative_mse, self.ours_seconds)
        return ours, efficiency(self.reference_relative_mse, self.reference_seconds)

    @property
    def efficiency_ratio(self) -> float | None:
        """Efficiency of ours over that of the reference; None where an image has no noise."""
        ours, reference = self.efficiencies
        return ours / reference if ours and reference else None


def measure(ours: Rendering, reference: Rendering) -> Measures:
    """Describe the difference of two renderings of one size."""
    images = [rendering.picture.astype(np.float64) for rendering in (ours, reference)]
    weight = relative_weight((images[0] + images[1]) / 2)
    mse = float(((images[0] - images[1]) ** 2 * weight).mean())
    variances = [float((_variance(rendering) * weight).mean()) for rendering in (ours, reference)]
    exposure = auto_exposure(reference.picture)
    flip = mean_flip(displayed(reference.picture, exposure), displayed(ours.picture, exposure))
    return Measures(mse, variances[0], variances[1], flip, exposure, ours.seconds, reference.seconds)


def _variance(rendering: Rendering) -> NDArray[np.float64]:
    """Squared standard error of the mean of the batches, (h, w, 3)."""
    return np.asarray(rendering.pictures.var(axis=0, ddof=1, dtype=np.float64) / len(rendering.pictures))


def relative(change: NDArray[np.floating], truth: NDArray[np.floating]) -> NDArray[np.float64]:
    """``change`` over ``truth``, which counts as 1 % of its mean where it is darker."""
    return np.asarray(change / np.maximum(truth, max(_DARK * truth.mean(), 1e-30)))


def auto_exposure(picture: NDArray[np.float32]) -> float:
    """Stops that show all but the brightest tenth of the pixels below 80 % of white; 0 for a black picture."""
    bright = float(np.quantile(picture.max(axis=2), _WHITE_QUANTILE))
    return float(np.log2(_WHITE / bright)) if bright > 0 else 0.0


def displayed(picture: NDArray[np.float32], exposure: float) -> NDArray[np.float32]:
    """``picture`` as sRGB values in [0, 1], clipped, after ``exposure`` stops."""
    return srgb_encode(np.clip(picture * np.float32(2.0**exposure), 0, 1))


def mean_flip(reference: NDArray[np.float32], test: NDArray[np.float32]) -> float | None:
    """Mean FLIP error of two sRGB pictures at 67 pixels per degree, the package's own setting."""
    try:
        from flip_evaluator import evaluate
    except ImportError:
        return None
    return float(evaluate(reference, test, "LDR", applyMagma=False)[1])
