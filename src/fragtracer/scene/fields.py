# SPDX-License-Identifier: MIT
"""The validated value types of the scene model."""

import math
from collections.abc import Iterable
from dataclasses import fields
from typing import Annotated, Any, TypeVar, get_args

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field

CONFIG = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, arbitrary_types_allowed=True)

_HUGE = 10**300  # an int beyond it stays too large as a float


def _unboxed(value: Any) -> Any:
    """The number that an array without axes is; anything else unchanged."""
    return value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value


def as_number(value: Any) -> Any:
    """An int or a numpy number as a float, and -0 as 0; anything else unchanged, for the field to reject."""
    if type(value) is float:
        return value + 0.0
    value = _unboxed(value)
    if isinstance(value, int) and not isinstance(value, bool):
        return float(max(min(value, _HUGE), -_HUGE))
    return float(value) + 0.0 if isinstance(value, (np.integer, np.floating)) else value


def as_whole(value: Any) -> Any:
    """A numpy integer as an int; anything else unchanged."""
    value = _unboxed(value)
    return int(value) if isinstance(value, np.integer) else value


def as_vector(value: Any) -> Any:
    """Any iterable as a tuple."""
    if isinstance(value, list):
        return tuple(value)
    value = _unboxed(value)
    return value if isinstance(value, str) or not isinstance(value, Iterable) else tuple(value)


def as_color(value: Any) -> Any:
    """One number as a grey (r, g, b)."""
    value = _unboxed(value)
    return (value,) * 3 if isinstance(value, (int, float, np.number)) else as_vector(value)


def as_tuple(value: Any) -> Any:
    """A list as a tuple."""
    return tuple(value) if isinstance(value, list) else value


LARGEST = 3.4e38  # of a 32-bit float, which is what the shader computes with
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST), BeforeValidator(as_number)]
Whole = Annotated[int, BeforeValidator(as_whole)]
Triple = tuple[Number, Number, Number]
NonNegative = Annotated[float, Field(ge=0, le=LARGEST), BeforeValidator(as_number)]
Positive = Annotated[float, Field(gt=0, le=LARGEST), BeforeValidator(as_number)]
Fraction = Annotated[float, Field(ge=0, le=1), BeforeValidator(as_number)]
Vector = Annotated[Triple, BeforeValidator(as_vector)]
Point = Annotated[Vector, "a place, which moves with what it belongs to"]
Points = Annotated[tuple[Point, Point, Point], BeforeValidator(as_tuple)]
Reflectance = Annotated[tuple[Fraction, Fraction, Fraction], BeforeValidator(as_color)]
Scale = Annotated[Triple, BeforeValidator(as_color)]
Strength = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(as_color)]
T = TypeVar("T")
Many = Annotated[tuple[T, ...], BeforeValidator(as_tuple)]


def kinds_of(cls: type) -> dict[str, type]:
    """What the fields of a dataclass hold that are :data:`Many`, by name."""
    found: dict[str, type] = {}
    for field in fields(cls):
        (many, *_) = get_args(field.type) or (None,)
        if get_args(many):
            found[field.name] = get_args(many)[0]
    return found


def length(v: Triple) -> float:
    return math.hypot(*v)


def difference(u: Triple, v: Triple) -> Triple:
    return (u[0] - v[0], u[1] - v[1], u[2] - v[2])


def dot(u: Triple, v: Triple) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def cross(u: Triple, v: Triple) -> Triple:
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
