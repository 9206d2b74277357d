# SPDX-License-Identifier: MIT
"""The kinds of value that the scene model is made of, each checked when it is given."""

from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field

CONFIG = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, arbitrary_types_allowed=True)


def as_triple(value: Any) -> Any:
    if isinstance(value, str) or not isinstance(value, Iterable):
        return value
    return tuple(float(v) if isinstance(v, int | np.number) and not isinstance(v, bool) else v for v in value)


def as_color(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (float(value),) * 3
    return as_triple(value)


def as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Triple = tuple[float, float, float]
NonNegative = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Vector = Annotated[Triple, BeforeValidator(as_triple)]
Reflectance = Annotated[tuple[Fraction, Fraction, Fraction], BeforeValidator(as_color)]
Strength = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(as_color)]


def length(v: Triple) -> float:
    return float(np.linalg.norm(v))
