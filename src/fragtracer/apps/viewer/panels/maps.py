# SPDX-License-Identifier: MIT
"""What maps over the picture share: coloured blocks, and labels that are legible on any background."""

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.panels.widgets import units

INK = (0.10, 0.10, 0.12, 1.0)
DARK = (0.08, 0.085, 0.095)  # behind text
LIGHT = (1.0, 1.0, 1.0, 0.92)  # text


def packed(r: float, g: float, b: float, a: float = 1.0) -> int:
    """A colour as imgui's draw lists take it."""
    return imgui.get_color_u32(imgui.ImVec4(float(r), float(g), float(b), float(a)))


def draw_blocks(area: Area, x: float, colors: NDArray[np.uint8], framed: NDArray[np.bool_] | None = None) -> None:
    """Cover the picture right of ``x`` with ``colors`` (rows, columns, 3), and frame some of the blocks."""
    canvas = imgui.get_background_draw_list()
    canvas.push_clip_rect(imgui.ImVec2(x, area.y), imgui.ImVec2(area.x + area.width, area.y + area.height), True)
    rows, columns, _ = colors.shape
    for row in range(rows):
        top, bottom = (round(area.y + area.height * k / rows) for k in (row, row + 1))
        for column in range(columns):
            left, right = (round(area.x + area.width * k / columns) for k in (column, column + 1))
            color = packed(*colors[row, column] / 255)
            canvas.add_rect_filled(imgui.ImVec2(left, top), imgui.ImVec2(right, bottom), color)
            if framed is not None and framed[row, column]:
                inner = imgui.ImVec2(left + 2, top + 2), imgui.ImVec2(right - 2, bottom - 2)
                canvas.add_rect(*inner, packed(*INK), 0.0, 2.0)
    canvas.pop_clip_rect()


def label(x: float, y: float, text: str, to_the_left: bool = False) -> None:
    """A label over the picture that begins at ``x``, or with ``to_the_left`` ends there."""
    canvas = imgui.get_background_draw_list()
    size = imgui.calc_text_size(text)
    left = x - size.x if to_the_left else x
    pad = units(5)
    corners = imgui.ImVec2(left - pad, y - pad / 2), imgui.ImVec2(left + size.x + pad, y + size.y + pad / 2)
    canvas.add_rect_filled(*corners, packed(*DARK, 0.7), units(3))
    canvas.add_text(imgui.ImVec2(left, y), packed(*LIGHT), text)
