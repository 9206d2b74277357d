# SPDX-License-Identifier: MIT
"""Mitsuba's records, made alike in scalar and vectorised variants."""

from typing import Any


def empty_direction_sample(mi: Any, dr: Any) -> Any:
    """A ``DirectionSample3f`` with density 0, which ``dr.zeros`` cannot make in scalar variants."""
    if dr.is_jit_v(mi.Float):
        return dr.zeros(mi.DirectionSample3f)
    ds = mi.DirectionSample3f()
    ds.pdf, ds.delta = 0, False
    return ds
