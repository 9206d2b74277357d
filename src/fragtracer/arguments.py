# SPDX-License-Identifier: MIT
"""Arguments of Python callers, refused where they come in and not where they would break something."""

import operator
from typing import Any

from fragtracer.errors import FragtracerError
from fragtracer.scene import Scene

_MOST_PIXELS = 16384  # a side


def check_scene(scene: Any) -> None:
    """Raise FragtracerError if ``scene`` is none, but perhaps the name of one."""
    if not isinstance(scene, Scene):
        mend = "" if scene is None else f", as ft.load({str(scene)!r})"
        raise FragtracerError(f"{scene!r} is no scene; give one{mend}")


def checked_size(size: Any) -> tuple[int, int]:
    """Width and height in pixels; raises FragtracerError if ``size`` is not that."""
    try:
        width, height = map(operator.index, size)
    except (TypeError, ValueError):
        width = height = 0
    if not (1 <= width <= _MOST_PIXELS and 1 <= height <= _MOST_PIXELS):
        mend = f"give width and height in pixels, each from 1 to {_MOST_PIXELS}, as (640, 480)"
        raise FragtracerError(f"size = {size!r}: {mend}")
    return width, height


def checked_spp(spp: Any) -> int:
    """Samples per pixel; raises FragtracerError if ``spp`` is no whole number, or negative."""
    try:
        count = operator.index(spp)
    except TypeError:
        count = -1
    if count < 0:
        raise FragtracerError(f"spp = {spp!r}: give a whole number of samples per pixel")
    return count
