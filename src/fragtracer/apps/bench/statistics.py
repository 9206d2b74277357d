# SPDX-License-Identifier: MIT
"""Medians with their spread, and growth exponents."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

CONFIDENCE = 0.95
# Two groups of four runs that measure the same lie fully apart in 2 of 70 cases.
_FEWEST_RUNS = 4


@dataclass(frozen=True)
class Estimate:
    """A median over ``runs`` measurements and the interval from ``low`` to ``high`` that holds the
    true median with 95 % confidence; with fewer than 6 runs, the interval is their whole range."""

    value: float
    low: float
    high: float
    runs: int

    @property
    def spread(self) -> float:
        """Half the interval over the median; 0 for a median of 0."""
        return (self.high - self.low) / (2 * abs(self.value)) if self.value else 0.0


def median(values: Sequence[float]) -> Estimate:
    """The median of at least one measurement, its interval from order statistics (which assumes
    nothing of their distribution)."""
    ordered = sorted(values)
    count = len(ordered)
    outside = 0
    while 1 - 2 * _binomial_tail(count, outside) >= CONFIDENCE:
        outside += 1
    cut = max(outside - 1, 0)
    return Estimate(float(np.median(ordered)), ordered[cut], ordered[count - 1 - cut], count)


def _binomial_tail(count: int, most: int) -> float:
    """Probability of at most ``most`` heads in ``count`` throws of a fair coin."""
    return float(sum(math.comb(count, k) for k in range(min(most, count) + 1)) / 2**count)


def inverse(estimate: Estimate, scale: float = 1.0) -> Estimate:
    """``scale`` over a positive quantity: from seconds to a rate, and back."""
    return Estimate(scale / estimate.value, scale / estimate.high, scale / estimate.low, estimate.runs)


def scaled(estimate: Estimate, factor: float) -> Estimate:
    """A positive ``factor`` times a quantity."""
    return Estimate(estimate.value * factor, estimate.low * factor, estimate.high * factor, estimate.runs)


def compare(old: Estimate, new: Estimate, more_is_better: bool) -> str:
    """ "better" or "worse" where both have enough runs and their intervals lie apart; else why not."""
    if min(old.runs, new.runs) < _FEWEST_RUNS:
        return "too few runs"
    if new.low <= old.high and old.low <= new.high:
        return "within the spread"
    return "better" if (new.value > old.value) == more_is_better else "worse"


def slope(x: ArrayLike, y: ArrayLike) -> tuple[float, float] | None:
    """b of y = a + b x by least squares, and its standard error; None for fewer than three points."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    if len(x) < 3:
        return None
    centred = x - x.mean()
    b = float(centred @ y / (centred @ centred))
    residual = y - y.mean() - b * centred
    return b, math.sqrt(float(residual @ residual) / (len(x) - 2) / float(centred @ centred))


def growth_exponent(x: ArrayLike, y: ArrayLike) -> tuple[float, float] | None:
    """p of y ~ x^p by least squares of the logarithms, and its standard error; None for fewer than
    three points."""
    return slope(np.log(x), np.log(y))


def write_exponent(rows: Sequence[dict[str, Any]], x: str, y: str) -> None:
    """Write the exponent of ``y`` ~ ``x`` ^ p into the last of ``rows``, its standard error behind it."""
    _write_fit(rows, "exponent", growth_exponent(*_measured(rows, x, y)), 2)


def write_growth(rows: Sequence[dict[str, Any]], x: str, y: str) -> None:
    """Write b of ``y`` = a + b log10(``x``) into the last of ``rows``, its standard error behind it."""
    at, found = _measured(rows, x, y)
    _write_fit(rows, "growth", slope(np.log10(at), found), 1)


def _measured(rows: Sequence[dict[str, Any]], x: str, y: str) -> tuple[list[int], list[float]]:
    points = [(row[x], row[y]) for row in rows]
    measured = [(at, y.value) for at, y in points if isinstance(at, int) and at > 0 and isinstance(y, Estimate)]
    return [at for at, _ in measured], [value for _, value in measured]


def _write_fit(rows: Sequence[dict[str, Any]], column: str, fit: tuple[float, float] | None, digits: int) -> None:
    for row in rows:
        row[column] = None
    if fit:
        rows[-1][column] = f"{fit[0]:.{digits}f} ±{fit[1]:.{digits}f}"
