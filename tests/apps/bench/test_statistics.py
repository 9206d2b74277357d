# SPDX-License-Identifier: MIT
"""Medians, their intervals, verdicts and exponents, on numbers whose answers are known."""

import numpy as np
import pytest

from fragtracer.apps.bench.statistics import Estimate, compare, growth_exponent, inverse, median


def test_median_of_few_runs_has_their_range() -> None:
    assert median([3.0, 1.0, 2.0]) == Estimate(2.0, 1.0, 3.0, 3)
    assert median([5.0]) == Estimate(5.0, 5.0, 5.0, 1)


@pytest.mark.parametrize("runs", [6, 7, 15, 40])
def test_interval_holds_the_median_as_often_as_it_says(runs: int) -> None:
    rng = np.random.default_rng(runs)
    intervals = [median(rng.lognormal(size=runs).tolist()) for _ in range(2000)]
    held = np.mean([i.low <= 1.0 <= i.high for i in intervals])
    assert held > 0.94
    if runs == 40:
        assert held < 0.99, "the interval is wider than it needs to be"


def test_inverse_turns_the_interval_around() -> None:
    assert inverse(Estimate(2.0, 1.0, 4.0, 9), 8.0) == Estimate(4.0, 2.0, 8.0, 9)


@pytest.mark.parametrize(
    ("old", "new", "more_is_better", "verdict"),
    [
        (Estimate(10, 9, 11, 7), Estimate(14, 13, 15, 7), True, "better"),
        (Estimate(10, 9, 11, 7), Estimate(14, 13, 15, 7), False, "worse"),
        (Estimate(10, 9, 11, 7), Estimate(8, 7, 8.5, 7), True, "worse"),
        (Estimate(10, 9, 11, 7), Estimate(12, 10.9, 13, 7), True, "within the spread"),
        (Estimate(10, 10, 10, 1), Estimate(14, 14, 14, 1), True, "too few runs"),
    ],
)
def test_verdict_only_where_the_spread_allows_one(
    old: Estimate, new: Estimate, more_is_better: bool, verdict: str
) -> None:
    assert compare(old, new, more_is_better) == verdict


def test_noise_alone_is_seldom_called_a_difference() -> None:
    rng = np.random.default_rng(1)
    pairs = [[median(rng.lognormal(0, 0.2, 7).tolist()) for _ in range(2)] for _ in range(2000)]
    called = np.mean([compare(old, new, True) in ("better", "worse") for old, new in pairs])
    assert called < 0.05


def test_growth_exponent() -> None:
    x = np.array([1.0, 2.0, 4.0, 8.0])
    fitted = growth_exponent(x, 3 * x**1.5)
    assert fitted == pytest.approx((1.5, 0.0), abs=1e-6)
    assert growth_exponent([1, 2], [1, 2]) is None
