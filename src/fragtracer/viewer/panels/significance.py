# SPDX-License-Identifier: MIT
"""The map of where our picture differs from Mitsuba's by more than noise, with its legend."""

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from fragtracer.compare.pictures import diverging
from fragtracer.compare.words import exact
from fragtracer.viewer.finding import Finding
from fragtracer.viewer.layout import Area
from fragtracer.viewer.panels.widgets import units

_LIMIT = 6.0  # of z, at the ends of the legend
_INK = imgui.ImVec4(0.10, 0.10, 0.12, 1.0)
_SAYS = {
    "agreement": "equal within {margin}",
    "disagreement": "{differing} of {comparisons} tests find a difference",
    "inconclusive": "no difference found; too noisy for {margin}",
}


def draw(area: Area, x: float, finding: Finding | None, progress: str) -> None:
    """Cover what lies right of ``x`` with the blocks, in the colour of their clearest difference, and a legend."""
    clip = imgui.ImVec2(x, area.y), imgui.ImVec2(area.x + area.width, area.y + area.height)
    canvas = imgui.get_background_draw_list()
    canvas.push_clip_rect(*clip, True)
    if finding is not None:
        _blocks(canvas, area, finding)
    canvas.pop_clip_rect()
    lines = [progress]
    if finding is not None:
        said = vars(finding) | {"margin": exact(finding.margin)}
        lines.insert(0, _SAYS[finding.outcome].format(**said))
    _legend(area, x, finding, lines)


def label(x: float, y: float, text: str, to_the_left: bool = False) -> None:
    """Words that can be read over any picture; ``x`` is where they begin or, ``to_the_left``, end."""
    canvas = imgui.get_background_draw_list()
    size = imgui.calc_text_size(text)
    left = x - size.x if to_the_left else x
    pad = units(5)
    corners = imgui.ImVec2(left - pad, y - pad / 2), imgui.ImVec2(left + size.x + pad, y + size.y + pad / 2)
    canvas.add_rect_filled(*corners, _color(0.08, 0.085, 0.095, 0.7), units(3))
    canvas.add_text(imgui.ImVec2(left, y), _color(1, 1, 1, 0.92), text)


def clearest(finding: Finding) -> NDArray[np.float64]:
    """The z-score of each block in the colour in which it is largest, (rows, columns)."""
    largest = np.abs(finding.z).argmax(axis=2)[..., None]
    return np.take_along_axis(finding.z, largest, axis=2)[..., 0]


def _blocks(canvas: imgui.ImDrawList, area: Area, finding: Finding) -> None:
    z = clearest(finding)
    differs: NDArray[np.bool_] = np.any(finding.differs, axis=2)
    colors = diverging(z, _LIMIT) / 255
    rows, columns = z.shape
    frame = _color(*_INK)
    for row in range(rows):
        top, bottom = (round(area.y + area.height * k / rows) for k in (row, row + 1))
        for column in range(columns):
            left, right = (round(area.x + area.width * k / columns) for k in (column, column + 1))
            r, g, b = colors[row, column]
            canvas.add_rect_filled(imgui.ImVec2(left, top), imgui.ImVec2(right, bottom), _color(r, g, b, 1))
            if differs[row, column]:
                inner = imgui.ImVec2(left + 2, top + 2), imgui.ImVec2(right - 2, bottom - 2)
                canvas.add_rect(*inner, frame, 0.0, 2.0)


def _legend(area: Area, x: float, finding: Finding | None, lines: list[str]) -> None:
    line = imgui.get_text_line_height_with_spacing()
    width, pad = units(310), units(10)
    height = (len(lines) + (3 if finding else 0)) * line + 2 * pad
    right, top = min(max(x, area.x) + pad + width, area.x + area.width - pad), area.y + units(40)
    bottom = top + height
    canvas = imgui.get_background_draw_list()
    corners = imgui.ImVec2(right - width, bottom - height), imgui.ImVec2(right, bottom)
    canvas.add_rect_filled(*corners, _color(0.08, 0.085, 0.095, 0.88), units(4))
    left, y = right - width + pad, bottom - height + pad
    for text in lines:
        canvas.add_text(imgui.ImVec2(left, y), _color(1, 1, 1, 0.92), text)
        y += line
    if finding is not None:
        _ramp(canvas, left, y + units(4), width - 2 * pad, finding.critical)


def _ramp(canvas: imgui.ImDrawList, left: float, top: float, width: float, limit: float) -> None:
    """The colours of z, with a mark from where on a block differs, whose frame is dark."""
    steps = 48
    height = units(10)
    colors = diverging(np.linspace(-_LIMIT, _LIMIT, steps), _LIMIT) / 255
    for k, (r, g, b) in enumerate(colors):
        a, c = (round(left + width * i / steps) for i in (k, k + 1))
        canvas.add_rect_filled(imgui.ImVec2(a, top), imgui.ImVec2(c, top + height), _color(r, g, b, 1))
    line = imgui.get_text_line_height_with_spacing()
    for z, text in ((-limit, f"−{limit:.1f}"), (0.0, "0"), (limit, f"+{limit:.1f}")):
        x = left + width * (z / _LIMIT + 1) / 2
        if z:
            canvas.add_line(imgui.ImVec2(x, top - 2), imgui.ImVec2(x, top + height + 2), _color(*_INK), 2.0)
        half = imgui.calc_text_size(text).x / 2
        canvas.add_text(imgui.ImVec2(x - half, top + height + units(2)), _color(1, 1, 1, 0.92), text)
    words = "z of a block: blue darker, red brighter than Mitsuba"
    canvas.add_text(imgui.ImVec2(left, top + height + line), _color(1, 1, 1, 0.7), words)


def _color(r: float, g: float, b: float, a: float) -> int:
    return imgui.get_color_u32(imgui.ImVec4(float(r), float(g), float(b), float(a)))
