# SPDX-License-Identifier: MIT
"""The relative error and the efficiency that comparisons and benchmarks report.

relMSE is the squared error of each pixel over its squared brightness, averaged over pixels and colours; efficiency is
1 / (relMSE · seconds), which does not depend on the number of samples of a Monte Carlo estimate.
"""

import numpy as np
from numpy.typing import NDArray

from fragtracer.sampling.pixels import bright

Floats = NDArray[np.float64]


def relative_weight(image: NDArray[np.floating]) -> Floats:
    """What makes a squared error relative: 1 / brightness² of each pixel of ``image`` (h, w, 3), as (h, w, 1).

    The brightness is the mean of the colours, at least a tenth of the mean of all; that of a black image counts as 1.
    """
    brightness = bright(image)[..., None]
    return np.asarray(1 / np.where(brightness > 0, brightness, 1.0) ** 2)


def efficiency(relative_mse: float, seconds: float) -> float | None:
    """1 / (relMSE · seconds), None where there is no error."""
    return 1 / (relative_mse * seconds) if relative_mse > 0 else None
