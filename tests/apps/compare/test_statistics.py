# SPDX-License-Identifier: MIT
"""The tests of means, on numbers whose distribution is known."""

import numpy as np
import pytest
from scipy import stats

from fragtracer.apps.compare import statistics
from fragtracer.apps.compare.statistics import Pair

BATCHES = 16
RUNS = 40_000


def normal_pairs(bias: float = 0.0, deviations: tuple[float, float] = (0.02, 0.05)) -> Pair:
    """RUNS independent comparisons of unequal variances, the reference's mean being 1."""
    rng = np.random.default_rng(1)
    ours, reference = (rng.normal(1, deviation, (BATCHES, RUNS)) for deviation in deviations)
    return Pair.of(ours + bias, reference)


def within(found: np.ndarray, rate: float) -> bool:
    """Whether the share of true values may come from ``rate``, with an error once in 10,000 tests."""
    return abs(found.mean() - rate) < stats.norm.isf(5e-5) * np.sqrt(rate * (1 - rate) / found.size)


def typical(values: np.ndarray) -> float:
    """The root mean square: these values follow variances, of which the mean is unbiased."""
    return float(np.sqrt(np.mean(values**2)))


def test_part_means_are_those_of_the_pixels():
    stack = np.random.default_rng(0).random((2, 7, 10, 3))
    parts = statistics.part_means(stack, 3, 4)
    assert parts.shape == (2, 3, 4, 3)
    assert parts[1, 0, 0] == pytest.approx(stack[1, :2, :2].mean((0, 1)))
    assert parts[1, 2, 3] == pytest.approx(stack[1, 4:, 7:].mean((0, 1)))
    assert statistics.part_means(stack, 1, 1)[:, 0, 0] == pytest.approx(stack.mean((1, 2)))


@pytest.mark.parametrize(
    ("size", "grid"), [((320, 180), (9, 16)), ((240, 240), (12, 12)), ((1, 1), (1, 1)), ((3, 5), (5, 3))]
)
def test_blocks_are_nearly_square(size, grid):
    assert statistics.block_grid(*size) == grid


def test_difference_test_is_welchs():
    rng = np.random.default_rng(2)
    ours, reference = rng.normal(1, 0.1, (12, 50)), rng.normal(1.02, 0.3, (20, 50))
    pair = Pair.of(ours, reference)
    expected = stats.ttest_ind(ours, reference, equal_var=False)
    assert pair.degrees() == pytest.approx(expected.df)
    assert statistics.difference_p(pair, rounding=0) == pytest.approx(expected.pvalue)
    signs = np.sign(statistics.z_scores(pair, expected.pvalue))
    assert np.array_equal(signs, np.sign(expected.statistic))


@pytest.mark.parametrize("level", [0.1, 0.01, 0.001])
def test_false_positives_come_at_the_stated_rate(level):
    assert within(statistics.difference_p(normal_pairs()) < level, level)


def test_z_scores_of_equal_means_are_standard_normal():
    pair = normal_pairs()
    z = statistics.z_scores(pair, statistics.difference_p(pair, rounding=0))
    assert stats.kstest(z, "norm").pvalue > 1e-4


@pytest.mark.parametrize("level", [0.01, 3e-5])
def test_detectable_bias_is_found_with_the_stated_power(level):
    bias = typical(statistics.detectable_bias(normal_pairs(), level))
    assert (statistics.difference_p(normal_pairs(bias)) < level).mean() == pytest.approx(0.95, abs=0.01)


def test_provable_margin_is_proved_with_the_stated_power():
    margin = typical(statistics.provable_margin(normal_pairs(), 0.01))
    assert (statistics.equivalence_p(normal_pairs(), margin) < 0.01).mean() == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("sign", [-1, 1])
def test_means_a_margin_apart_pass_for_equal_at_the_stated_rate_at_most(sign):
    proved = statistics.equivalence_p(normal_pairs(sign * 0.1), 0.1) < 0.01
    assert within(proved, 0.01)


def test_nothing_is_equal_when_noise_is_larger_than_the_margin():
    assert not (statistics.equivalence_p(normal_pairs(deviations=(0.2, 0.2)), 0.05) < 0.01).any()


def test_without_noise_equal_is_equal_and_different_different():
    steady = np.ones((4, 6)) * [1.0, 1.0, 1.0, 0.0, 0.0, 5.0]
    other = np.ones((4, 6)) * [1.0, 1.000009, 1.0001, 0.0, 1.0, 0.0]
    pair = Pair.of(other, steady)
    assert statistics.difference_p(pair).tolist() == [1, 1, 0, 1, 0, 0]
    assert (statistics.equivalence_p(pair, 0.01) < 0.01).tolist() == [True, True, True, True, False, False]
    assert np.isfinite(statistics.z_scores(pair, statistics.difference_p(pair))).all()
    assert pair.relative_difference[3:].tolist() == [0, np.inf, -1]


def test_noise_on_one_side_alone():
    rng = np.random.default_rng(3)
    pair = Pair.of(np.ones((BATCHES, RUNS)), rng.normal(1, 0.01, (BATCHES, RUNS)))
    assert pair.degrees() == pytest.approx(np.full(RUNS, BATCHES - 1))
    assert within(statistics.difference_p(pair, rounding=0) < 0.01, 0.01)


def test_rounding_noise_is_no_difference():
    rng = np.random.default_rng(4)
    pair = Pair.of(1 + rng.normal(0, 1e-9, (BATCHES, 100)), 1 + 5e-6 + rng.normal(0, 1e-9, (BATCHES, 100)))
    assert (statistics.difference_p(pair) == 1).all()


@pytest.mark.parametrize("width", [0.5, 1.0, 2.0])
def test_skewed_samples_make_no_more_false_positives_than_stated(width):
    """Means of a few lognormal values each, of which the larger widths are mostly outliers."""
    rng = np.random.default_rng(5)
    ours, reference = (rng.lognormal(0, width, (BATCHES, 4, 10_000)).mean(1) for _ in range(2))
    found = statistics.difference_p(Pair.of(ours, reference)) < 0.01
    assert within(found, 0.01) or found.mean() < 0.01


def test_sidak_keeps_the_level_of_all_together():
    assert 1 - (1 - statistics.sidak(0.01, 500)) ** 500 == pytest.approx(0.01)


def test_one_batch_is_refused():
    with pytest.raises(ValueError, match="two batches"):
        Pair.of(np.ones((1, 3)), np.ones((4, 3)))
