# SPDX-License-Identifier: MIT
"""Numbers that describe a comparison and never decide it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.sides import Side
from fragtracer.display.tone import srgb_encode

_DARK = 0.01  # of the mean radiance
_WHITE_QUANTILE, _WHITE = 0.9, 0.8  # the quantile of the pixels' brightest channels that is shown as 0.8


@dataclass(frozen=True)
class Measures:
    """Errors are relative to the mean radiance of the reference's picture.

    ``rmse`` is the root mean square of the pixels' differences, ``expected_rmse`` what noise alone
    would make it. ``flip`` is the mean of NVIDIA's FLIP error of the pictures as they are shown, 0 to 1
    (Andersson et al. 2020, "FLIP: a difference evaluator for alternating images"); None without the
    package. ``ours_noise`` and ``reference_noise`` are the root mean square errors of the pictures of
    all batches, estimated from the scatter between batches.
    """

    rmse: float
    expected_rmse: float
    flip: float | None
    exposure: float  # stops
    ours_noise: float
    reference_noise: float
    ours_seconds: float
    reference_seconds: float

    @property
    def equal_time_ratio(self) -> float | None:
        """How many times as long Mitsuba renders as fragtracer to the same mean squared error; None
        where a side has no noise."""
        ours = self.ours_noise**2 * self.ours_seconds
        reference = self.reference_noise**2 * self.reference_seconds
        return reference / ours if ours > 0 and reference > 0 else None

    def error_after(self, seconds: float) -> tuple[float, float]:
        """Relative root mean square error of ours and of the reference after ``seconds`` of rendering."""
        ours = self.ours_noise * (self.ours_seconds / seconds) ** 0.5
        return ours, self.reference_noise * (self.reference_seconds / seconds) ** 0.5


def measure(ours: Side, reference: Side) -> Measures:
    """Describe the difference of two sides whose pictures have one size."""
    scale = float(reference.picture.mean(dtype=np.float64)) or 1.0
    rmse = float(np.sqrt(np.mean((ours.picture.astype(np.float64) - reference.picture) ** 2))) / scale
    ours_noise, reference_noise = _noise(ours) / scale, _noise(reference) / scale
    exposure = auto_exposure(reference.picture)
    flip = mean_flip(displayed(reference.picture, exposure), displayed(ours.picture, exposure))
    expected = float(np.hypot(ours_noise, reference_noise))
    return Measures(rmse, expected, flip, exposure, ours_noise, reference_noise, ours.seconds, reference.seconds)


def _noise(side: Side) -> float:
    """Root mean square error of ``side.picture``."""
    return float(np.sqrt(side.pictures.var(axis=0, ddof=1, dtype=np.float64).mean() / len(side.pictures)))


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
