# SPDX-License-Identifier: MIT
"""The map of how much the split-sum approximation differs from the path-traced truth, with its legend."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.measures import relative
from fragtracer.apps.compare.pictures import diverging, round_limit
from fragtracer.apps.compare.verdict import Means
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.panels import maps
from fragtracer.apps.viewer.panels.widgets import units


def relative_blocks(ours: Sequence[Means], truth: Sequence[Means]) -> NDArray[np.float64]:
    """(ours - truth) / truth of the blocks' means over all colours, (rows, columns)."""
    a, b = (np.mean([means["blocks"].mean(axis=(0, 3)) for means in side], axis=0) for side in (ours, truth))
    return relative(a - b, b)


def draw(area: Area, x: float, ours: Sequence[Means], truth: Sequence[Means]) -> None:
    """Cover what lies right of ``x`` with the blocks, in the colour of their difference, and say the scale."""
    if not ours or not truth:
        return
    values = relative_blocks(ours, truth)
    limit = round_limit(values)
    maps.draw_blocks(area, x, diverging(values, limit))
    text = f"blue −{limit:.0%}, red +{limit:.0%} of the truth; all in all {of_picture(ours, truth):+.1%}"
    maps.label(x + units(12), area.y + units(34), text)


def of_picture(ours: Sequence[Means], truth: Sequence[Means]) -> float:
    """The relative difference of the whole picture."""
    a, b = (float(np.mean([means["image"] for means in side])) for side in (ours, truth))
    return (a - b) / max(b, 1e-30)
