# SPDX-License-Identifier: MIT
"""Colours of vertices and faces, of the number types that files have them in."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def fractions(columns: Sequence[NDArray[Any]]) -> tuple[NDArray[np.float32], bool]:
    """Channels (rows,) as fractions (rows, channels), and whether they are counted by whole numbers.

    Integers count to the largest of their type; where that is larger than a byte's or two bytes', and none of them is,
    they count to these. So do floating-point numbers that are whole, up to 255, and not all 0 or 1.
    """
    values = np.column_stack(columns)
    is_integer = values.dtype.kind in "iu"
    highest = values.max(initial=0)
    is_counted = is_integer or bool(1 < highest <= 255 and (values == np.floor(values)).all())
    if is_counted:
        largest = np.iinfo(values.dtype).max if is_integer else 255
        values = np.maximum(values, 0) / min(largest, next(top for top in (255, 65535, largest) if highest <= top))
    with np.errstate(over="ignore"):
        return values.astype(np.float32), is_counted
