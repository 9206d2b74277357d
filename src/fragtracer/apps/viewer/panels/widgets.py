# SPDX-License-Identifier: MIT
"""Rows of a panel: a quiet label on the left, the control on the right; each returns the value."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

from imgui_bundle import imgui

from fragtracer.apps.viewer.theme import FONT_SIZE, MUTED

T = TypeVar("T")
Triple = tuple[float, float, float]
_LABEL_WIDTH = 8.1  # heights of the font
_CLAMP = imgui.SliderFlags_.always_clamp


def edited(value: T, **changes: Any) -> T:
    """``value`` with other fields, or unchanged if the scene model rejects them."""
    if all(getattr(value, name) == new for name, new in changes.items()):
        return value
    try:
        return replace(value, **changes)  # type: ignore[type-var]
    except ValueError:
        return value


def label(text: str, tip: str = "") -> None:
    """Begin a row."""
    imgui.align_text_to_frame_padding()
    imgui.text_colored(MUTED, text)
    if tip:
        imgui.set_item_tooltip(tip)
    imgui.same_line(_LABEL_WIDTH * imgui.get_font_size())
    imgui.set_next_item_width(-1)


def slider(text: str, value: float, low: float, high: float, form: str = "%.3f", log: bool = False) -> float:
    label(text)
    flags = _CLAMP | (imgui.SliderFlags_.logarithmic if log else 0)
    changed, new = imgui.slider_float(f"##{text}", value, low, high, form, flags)
    return new if changed else value


def whole(text: str, value: int, low: int, high: int, tip: str = "", log: bool = False) -> int:
    label(text, tip)
    flags = _CLAMP | (imgui.SliderFlags_.logarithmic if log else 0)
    changed, new = imgui.slider_int(f"##{text}", value, low, high, flags=flags)
    return new if changed else value


def number(text: str, value: float, speed: float, low: float, high: float, form: str = "%.3f", tip: str = "") -> float:
    """A value to drag, or to type after a double click."""
    label(text, tip)
    changed, new = imgui.drag_float(f"##{text}", value, speed, low, high, form, _CLAMP)
    return new if changed else value


def point(text: str, value: Triple, speed: float = 0.01) -> Triple:
    label(text)
    changed, new = imgui.drag_float3(f"##{text}", list(value), speed, format="%.3f")
    return (new[0], new[1], new[2]) if changed else value


def color(text: str, value: Triple, hdr: bool = False) -> Triple:
    """A linear colour; ``hdr`` allows more than 1."""
    label(text)
    flags = imgui.ColorEditFlags_.float | (imgui.ColorEditFlags_.hdr if hdr else 0)
    changed, new = imgui.color_edit3(f"##{text}", list(value), flags)
    return (max(0.0, new[0]), max(0.0, new[1]), max(0.0, new[2])) if changed else value


def choice(text: str, value: str, options: Sequence[str], tip: str = "") -> str:
    label(text, tip)
    index = options.index(value) if value in options else -1
    changed, new = imgui.combo(f"##{text}", index, list(options))
    return options[new] if changed else value


def check(text: str, value: bool) -> bool:
    label(text)
    return imgui.checkbox(f"##{text}", value)[1]


def pair(text: str, shown: str) -> None:
    """A row without a control."""
    label(text)
    imgui.text(shown)


def header(text: str) -> bool:
    """The title of a section, open at first; whether it is open."""
    return imgui.collapsing_header(text, imgui.TreeNodeFlags_.default_open)


def units(count: float) -> float:
    """``count`` pixels at the default font size, scaled to the current one, in imgui's units."""
    return count * imgui.get_font_size() / FONT_SIZE
