# SPDX-License-Identifier: MIT
"""Automatic exposure by a histogram of luminance.

The image is metered in cells of 4 x 4 pixels from the lower left corner, those at the right and top edges
smaller: the mean luminance (Rec. 709) of the pixels of a cell that are finite, with values clipped to between 0
and 1e30. Black cells, and those without a finite pixel, do not count. A histogram is made of the others' log2 of
luminance, with bins of 1/16 stop; the darkest and the brightest tenth of the cells are left out, as the Unreal Engine
does by default (Epic Games, "Auto exposure in Unreal Engine"), and the mean of the rest is brought to middle grey, 0.18
(Reinhard et al. 2002, "Photographic tone reproduction for digital images", section 2). shaders/display/meter.frag
computes the cells.
"""

import numpy as np
import numpy.typing as npt

from fragtracer.display.tone import BRIGHTEST, REC_709

CELL = 4  # pixels a side
MIDDLE_GREY = 0.18
TRIMMED = 0.1  # of the cells, at each end
MOST_STOPS = 64
_BINS_PER_STOP = 16
_LARGEST = 128  # stops from 1 that the histogram reaches


def cells(image: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
    """The mean luminance of each cell of a linear (h, w, 3) image, -1 where no pixel is finite."""
    height, width, _ = image.shape
    good = np.asarray(np.isfinite(image[::-1]).all(axis=2, keepdims=True))
    seen = np.clip(np.where(good, image[::-1], 0), 0, BRIGHTEST)
    luminance = seen.astype(np.float64) @ REC_709
    rows, columns = np.arange(0, height, CELL), np.arange(0, width, CELL)
    total, count = (
        np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)
        for values in (luminance, good[..., 0].astype(np.float64))
    )
    return np.where(count > 0, total / np.maximum(count, 1), -1.0)


def stops_for(luminances: npt.ArrayLike) -> float:
    """The exposure, in stops within -64 and 64, that shows an image of these cells well; 0 for a black one."""
    cell = np.asarray(luminances, np.float64)
    cell = cell[cell > 0]
    if not cell.size:
        return 0.0
    bins = np.floor((np.log2(cell) + _LARGEST) * _BINS_PER_STOP).astype(int)
    histogram = np.bincount(np.clip(bins, 0, 2 * _LARGEST * _BINS_PER_STOP - 1))
    edges = np.concatenate([[0], np.cumsum(histogram)]) / cell.size
    kept = np.diff(np.clip(edges, TRIMMED, 1 - TRIMMED))
    middle = (np.arange(len(histogram)) + 0.5) / _BINS_PER_STOP - _LARGEST
    stops = np.log2(MIDDLE_GREY) - kept @ middle / kept.sum()
    return float(np.clip(stops, -MOST_STOPS, MOST_STOPS))


def automatic_exposure(image: npt.NDArray[np.float32]) -> float:
    """:func:`stops_for` of a linear (h, w, 3) image."""
    return stops_for(cells(image))
