# SPDX-License-Identifier: MIT
"""The map of where our picture differs from Mitsuba's by more than noise, with its legend."""

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from fragtracer.apps.compare.pictures import diverging
from fragtracer.apps.compare.words import exact
from fragtracer.apps.viewer.finding import Finding
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.panels import maps
from fragtracer.apps.viewer.panels.maps import DARK, INK, LIGHT, packed
from fragtracer.apps.viewer.panels.widgets import units

_LIMIT = 6.0  # of z, at the ends of the legend
_SAYS = {
    "agreement": "equal within {margin}",
    "disagreement": "{differing} of {comparisons} tests find a difference",
    "inconclusive": "no difference found; too noisy for {margin}",
}


def draw(area: Area, x: float, finding: Finding | None, progress: str) -> None:
    """Cover the picture right of ``x`` with blocks coloured by their largest |z|, and draw a legend."""
    lines = [progress]
    if finding is not None:
        maps.draw_blocks(area, x, diverging(clearest(finding), _LIMIT), np.any(finding.differs, axis=2))
        said = vars(finding) | {"margin": exact(finding.margin)}
        lines.insert(0, _SAYS[finding.outcome].format(**said))
    _legend(area, x, finding, lines)


def clearest(finding: Finding) -> NDArray[np.float64]:
    """The z-score of each block in the channel where it is largest in magnitude, (rows, columns)."""
    largest = np.abs(finding.z).argmax(axis=2)[..., None]
    return np.take_along_axis(finding.z, largest, axis=2)[..., 0]


def _legend(area: Area, x: float, finding: Finding | None, lines: list[str]) -> None:
    line = imgui.get_text_line_height_with_spacing()
    width, pad = units(310), units(10)
    height = (len(lines) + (3 if finding else 0)) * line + 2 * pad
    right, top = min(max(x, area.x) + pad + width, area.x + area.width - pad), area.y + units(40)
    bottom = top + height
    canvas = imgui.get_background_draw_list()
    corners = imgui.ImVec2(right - width, bottom - height), imgui.ImVec2(right, bottom)
    canvas.add_rect_filled(*corners, packed(*DARK, 0.88), units(4))
    left, y = right - width + pad, bottom - height + pad
    for text in lines:
        canvas.add_text(imgui.ImVec2(left, y), packed(*LIGHT), text)
        y += line
    if finding is not None:
        _ramp(canvas, left, y + units(4), width - 2 * pad, finding.critical)


def _ramp(canvas: imgui.ImDrawList, left: float, top: float, width: float, limit: float) -> None:
    """The colour scale of z, with marks at the critical value."""
    steps = 48
    height = units(10)
    colors = diverging(np.linspace(-_LIMIT, _LIMIT, steps), _LIMIT) / 255
    for k, (r, g, b) in enumerate(colors):
        a, c = (round(left + width * i / steps) for i in (k, k + 1))
        canvas.add_rect_filled(imgui.ImVec2(a, top), imgui.ImVec2(c, top + height), packed(r, g, b))
    line = imgui.get_text_line_height_with_spacing()
    for z, text in ((-limit, f"−{limit:.1f}"), (0.0, "0"), (limit, f"+{limit:.1f}")):
        x = left + width * (z / _LIMIT + 1) / 2
        if z:
            canvas.add_line(imgui.ImVec2(x, top - 2), imgui.ImVec2(x, top + height + 2), packed(*INK), 2.0)
        half = imgui.calc_text_size(text).x / 2
        canvas.add_text(imgui.ImVec2(x - half, top + height + units(2)), packed(*LIGHT), text)
    words = "z of a block: blue darker, red brighter than Mitsuba"
    canvas.add_text(imgui.ImVec2(left, top + height + line), packed(1, 1, 1, 0.7), words)
