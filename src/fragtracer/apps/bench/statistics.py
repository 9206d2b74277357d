# SPDX-License-Identifier: MIT
"""Medians with their spread, and growth exponents."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

CONFIDENCE = 0.95
# Two groups of four runs that differ by chance alone lie fully apart in 2 of 70 cases.
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
    """Chance of at most ``most`` heads in ``count`` throws of a fair coin."""
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


def growth_exponent(x: ArrayLike, y: ArrayLike) -> tuple[float, float] | None:
    """p of y ~ x^p by least squares of the logarithms, and its standard error; None for fewer than
    three points."""
    log_x, log_y = np.log(np.asarray(x, np.float64)), np.log(np.asarray(y, np.float64))
    if len(log_x) < 3:
        return None
    centred = log_x - log_x.mean()
    slope = float(centred @ log_y / (centred @ centred))
    residual = log_y - log_y.mean() - slope * centred
    error = math.sqrt(float(residual @ residual) / (len(log_x) - 2) / float(centred @ centred))
    return slope, error


def write_exponent(rows: Sequence[dict[str, Any]], x: str, y: str) -> None:
    """Write the exponent of ``y`` ~ ``x`` ^ p into the last of ``rows``, its standard error behind it."""
    points = [(row[x], row[y]) for row in rows]
    measured = [
        (at, found.value) for at, found in points if isinstance(at, int) and at > 0 and isinstance(found, Estimate)
    ]
    fitted = growth_exponent([at for at, _ in measured], [value for _, value in measured])
    for row in rows:
        row["exponent"] = None
    if fitted:
        rows[-1]["exponent"] = f"{fitted[0]:.2f} ±{fitted[1]:.2f}"
