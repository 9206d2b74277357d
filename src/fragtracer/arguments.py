# SPDX-License-Identifier: MIT
"""Arguments of Python callers, refused where they come in and not where they would break something."""

import operator
import re
from numbers import Real
from typing import Any

from fragtracer.errors import FragtracerError
from fragtracer.scene import Scene

_MOST_PIXELS = 16384  # a side
_LAST_FIRST_SAMPLE = 2**32 - 2**24  # before the most that a film has, all with numbers of 32 bits


def check_scene(scene: Any) -> None:
    """Raise FragtracerError if ``scene`` is none, but perhaps the name of one."""
    if not isinstance(scene, Scene):
        mend = "" if scene is None else f", as ft.load({str(scene)!r})"
        raise FragtracerError(f"{scene!r} is no scene; give one{mend}")


def checked_size(size: Any, most: int = _MOST_PIXELS) -> tuple[int, int]:
    """Width and height in pixels, at most so many; raises FragtracerError if ``size`` is not that."""
    try:
        width, height = map(operator.index, size)
    except (TypeError, ValueError):
        width = height = 0
    if not (1 <= width <= most and 1 <= height <= most):
        mend = f"give width and height in pixels, each from 1 to {most}, as (640, 480)"
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


def checked_first_sample(number: Any) -> int:
    """The number of a first sample; raises FragtracerError if it is none."""
    try:
        first = operator.index(number)
    except TypeError:
        first = -1
    if not 0 <= first <= _LAST_FIRST_SAMPLE or first % 2:
        raise FragtracerError(
            f"first_sample = {number!r}: give an even number from 0 to {_LAST_FIRST_SAMPLE}; samples belong to two "
            "streams in turns"
        )
    return first


def checked_seconds(seconds: Any) -> float:
    """A time; raises FragtracerError if ``seconds`` is none, or negative."""
    if not (isinstance(seconds, Real) and float(seconds) >= 0):
        raise FragtracerError(f"seconds = {seconds!r}: give a number of seconds, not negative")
    return float(seconds)


def checked_bytes(size: Any) -> float:
    """A number of bytes, from that or a text as "5MB"; raises FragtracerError if ``size`` is none of these."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?(kB|MB)", size, re.IGNORECASE) if isinstance(size, str) else None
    if match:
        return float(match[1]) * {"kb": 1e3, "mb": 1e6}[match[2].lower()]
    if not (isinstance(size, Real) and float(size) > 0):
        raise FragtracerError(f"size limit {size!r}: give a number of kB or MB, as 5MB, or of bytes")
    return float(size)
