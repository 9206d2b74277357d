# SPDX-License-Identifier: MIT
"""The map of how much the split-sum approximation differs from the path-traced truth, with its legend."""

from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from fragtracer.compare.measures import relative
from fragtracer.compare.pictures import diverging, round_limit
from fragtracer.compare.verdict import Means
from fragtracer.viewer.layout import Area
from fragtracer.viewer.panels import significance
from fragtracer.viewer.panels.widgets import units


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
    colors = diverging(values, limit) / 255
    rows, columns = values.shape
    canvas = imgui.get_background_draw_list()
    canvas.push_clip_rect(imgui.ImVec2(x, area.y), imgui.ImVec2(area.x + area.width, area.y + area.height), True)
    for row in range(rows):
        top, bottom = (round(area.y + area.height * k / rows) for k in (row, row + 1))
        for column in range(columns):
            left, right = (round(area.x + area.width * k / columns) for k in (column, column + 1))
            r, g, b = map(float, colors[row, column])
            color = imgui.get_color_u32(imgui.ImVec4(r, g, b, 1.0))
            canvas.add_rect_filled(imgui.ImVec2(left, top), imgui.ImVec2(right, bottom), color)
    canvas.pop_clip_rect()
    text = f"blue −{limit:.0%}, red +{limit:.0%} of the truth; all in all {of_picture(ours, truth):+.1%}"
    significance.label(x + units(12), area.y + units(34), text)


def of_picture(ours: Sequence[Means], truth: Sequence[Means]) -> float:
    """The relative difference of the whole picture."""
    a, b = (float(np.mean([means["image"] for means in side])) for side in (ours, truth))
    return (a - b) / max(b, 1e-30)
