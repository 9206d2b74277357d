# SPDX-License-Identifier: MIT
"""The validated value types of the scene model."""

from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field

CONFIG = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, arbitrary_types_allowed=True)

_HUGE = 10**300  # an int beyond it stays too large as a float


def as_number(value: Any) -> Any:
    """An int or a numpy number as a float; anything else unchanged, for the field to reject."""
    if isinstance(value, int) and not isinstance(value, bool):
        return float(max(min(value, _HUGE), -_HUGE))
    return float(value) if isinstance(value, np.integer | np.floating) else value


def as_vector(value: Any) -> Any:
    """Any iterable as a tuple."""
    return value if isinstance(value, str) or not isinstance(value, Iterable) else tuple(value)


def as_color(value: Any) -> Any:
    """One number as a grey (r, g, b)."""
    return (value,) * 3 if isinstance(value, int | float | np.number) else as_vector(value)


def as_tuple(value: Any) -> Any:
    """A list as a tuple."""
    return tuple(value) if isinstance(value, list) else value


LARGEST = 3.4e38  # of a 32-bit float, which is what the shader computes with
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST), BeforeValidator(as_number)]
Triple = tuple[Number, Number, Number]
NonNegative = Annotated[float, Field(ge=0, le=LARGEST), BeforeValidator(as_number)]
Positive = Annotated[float, Field(gt=0, le=LARGEST), BeforeValidator(as_number)]
Fraction = Annotated[float, Field(ge=0, le=1), BeforeValidator(as_number)]
Vector = Annotated[Triple, BeforeValidator(as_vector)]
Reflectance = Annotated[tuple[Fraction, Fraction, Fraction], BeforeValidator(as_color)]
Scale = Annotated[Triple, BeforeValidator(as_color)]
Strength = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(as_color)]


def length(v: Triple) -> float:
    return float(np.linalg.norm(v))
