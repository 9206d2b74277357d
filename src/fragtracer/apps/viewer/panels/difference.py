# SPDX-License-Identifier: MIT
"""The map of the difference of the split-sum approximation from the path-traced reference, with its legend."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.measures import relative
from fragtracer.apps.compare.pictures import diverging, round_limit
from fragtracer.apps.compare.verdict import Means
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.panels import maps
from fragtracer.apps.viewer.panels.widgets import units


def relative_blocks(ours: Sequence[Means], reference: Sequence[Means]) -> NDArray[np.float64]:
    """(ours - reference) / reference of the blocks' means over all channels, (rows, columns)."""
    a, b = (np.mean([means["blocks"].mean(axis=(0, 3)) for means in side], axis=0) for side in (ours, reference))
    return relative(a - b, b)


def draw(area: Area, x: float, ours: Sequence[Means], reference: Sequence[Means]) -> None:
    """Cover the picture right of ``x`` with blocks coloured by their difference, and draw a label with the scale."""
    if not ours or not reference:
        return
    values = relative_blocks(ours, reference)
    limit = round_limit(values)
    maps.draw_blocks(area, x, diverging(values, limit))
    text = f"blue −{limit:.0%}, red +{limit:.0%} of the reference; whole picture {of_picture(ours, reference):+.1%}"
    maps.label(x + units(12), area.y + units(34), text)


def of_picture(ours: Sequence[Means], reference: Sequence[Means]) -> float:
    """The relative difference of the whole picture."""
    a, b = (float(np.mean([means["image"] for means in side])) for side in (ours, reference))
    return (a - b) / max(b, 1e-30)
