# SPDX-License-Identifier: MIT
"""Rows of a panel: a quiet label on the left, the control on the right; each returns the value."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from imgui_bundle import imgui

from fragtracer.apps.viewer.theme import FONT_SIZE, MUTED
from fragtracer.scene.fields import LARGEST

T = TypeVar("T")
Triple = tuple[float, float, float]
_LABEL_WIDTH = 8.1  # heights of the font
_CLAMP = imgui.SliderFlags_.always_clamp
_UNROUNDED = imgui.SliderFlags_.no_round_to_format
_DRAG = 0.002  # of what is looked at, for each unit of a drag
_TURN = 0.01  # of the largest component, for each unit of a drag


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
    return _shortest(new) if changed else value


def whole(text: str, value: int, low: int, high: int, tip: str = "", log: bool = False) -> int:
    label(text, tip)
    flags = _CLAMP | (imgui.SliderFlags_.logarithmic if log else 0)
    changed, new = imgui.slider_int(f"##{text}", value, low, high, flags=flags)
    return new if changed else value


def number(text: str, value: float, speed: float, low: float, high: float, form: str = "%.3f", tip: str = "") -> float:
    """A value to drag, or to type after a double click, rounded as it is shown."""
    label(text, tip)
    changed, new = imgui.drag_float(f"##{text}", value, speed, low, high, form, _CLAMP)
    return _shortest(new) if changed else value


def quantity(text: str, value: float, speed: float, low: float, unit: str, tip: str = "") -> float:
    """A value of any size, ``low`` at least, to drag, or to type with all its digits."""
    label(text, tip)
    flags = _CLAMP | _UNROUNDED
    changed, new = imgui.drag_float(f"##{text}", value, speed, low, LARGEST, f"%.4g {unit}", flags)
    return _shortest(new) if changed else value


def length(text: str, value: float, around: float, low: float = 0.0, tip: str = "") -> float:
    """A length where ``around`` metres are looked at, ``low`` of these at least."""
    return quantity(text, value, _DRAG * around, low * around, "m", tip)


def point(text: str, value: Triple, around: float) -> Triple:
    """A place where ``around`` metres are looked at."""
    return triple(text, value, _DRAG * around)


def vector(text: str, value: Triple) -> Triple:
    """A direction, or factors, of any size."""
    return triple(text, value, _TURN * max(map(abs, value)))


def triple(text: str, value: Triple, speed: float) -> Triple:
    label(text)
    changed, new = imgui.drag_float3(f"##{text}", list(value), speed, 0.0, 0.0, "%.5g", _UNROUNDED)
    return _taken_over(value, new) if changed else value


def color(text: str, value: Triple, hdr: bool = False) -> Triple:
    """A linear colour; ``hdr`` allows more than 1."""
    label(text)
    flags = imgui.ColorEditFlags_.float | (imgui.ColorEditFlags_.hdr if hdr else 0)
    changed, new = imgui.color_edit3(f"##{text}", list(value), flags)
    return at_least(0.0, value, _taken_over(value, new)) if changed else value


def at_least(low: float, before: Triple, after: Triple) -> Triple:
    """``after``, but ``low`` where it is less and is not as ``before``."""
    x, y, z = (new if new == old else max(low, new) for old, new in zip(before, after, strict=True))
    return x, y, z


def _taken_over(before: Triple, after: Sequence[float]) -> Triple:
    """What imgui made of ``before``, whose values it has as float32: those that it left are as they were."""
    with np.errstate(over="ignore"):
        x, y, z = (old if np.float32(old) == new else _shortest(new) for old, new in zip(before, after, strict=True))
    return x, y, z


def _shortest(value: float) -> float:
    """The number of the fewest digits that is ``value`` as float32."""
    return float(str(np.float32(value)))


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
