# SPDX-License-Identifier: MIT
"""The tests of two stacks of independent pictures: are their means different, are they equivalent?

Pure arithmetic: nothing is rendered here. A stack is (batches, height, width, 3), and the picture of
each batch is an independent estimate of the same radiance. The values that are tested are means of
parts of a picture, one for each batch. They need no assumption about samples or pixels, which a
low-discrepancy sampler or a wide filter would break, and by the central limit theorem they are much
nearer to normal than samples are: fireflies (samples that are rare and very bright) widen the error
bars instead of being taken for differences. The exception is light that one renderer finds so rarely
that a part of the picture may miss it in every batch; more samples per pixel mend that.

References
----------
- Welch 1947, "The generalization of 'Student's' problem when several different population variances
  are involved"; the degrees of freedom: Satterthwaite 1946, "An approximate distribution of
  estimates of variance components".
- Šidák 1967, "Rectangular confidence regions for the means of multivariate normal distributions".
- Schuirmann 1987, "A comparison of the two one-sided tests procedure and the power approach for
  assessing the equivalence of average bioavailability"; for a ratio of means: Sasabuchi 1988, "A
  multivariate test with composite hypotheses determined by linear inequalities".
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

POWER = 0.95
ROUNDING = 1e-5  # relative; smaller differences are what float32 arithmetic leaves, noise or not
_LEAST_P = 1e-300  # keeps z-scores finite, at 37


def sidak(level: float, comparisons: int) -> float:
    """The level of one of ``comparisons`` tests that together err with probability ``level`` (Šidák 1967)."""
    return float(-np.expm1(np.log1p(-level) / comparisons))


def part_means(stack: ArrayLike, rows: int, columns: int) -> Floats:
    """Means over ``rows`` x ``columns`` parts of (batches, h, w, 3) pictures, (batches, rows, columns, 3).

    Parts differ by at most one pixel in height and width.
    """
    values = np.asarray(stack, np.float64)
    for axis, parts in ((1, rows), (2, columns)):
        starts = np.arange(parts) * values.shape[axis] // parts
        sizes = np.diff(starts, append=values.shape[axis])
        values = np.add.reduceat(values, starts, axis) / np.expand_dims(sizes, tuple(range(1, 4 - axis)))
    return values


def block_grid(width: int, height: int) -> tuple[int, int]:
    """Rows and columns of nearly square blocks of pixels, about 144 of them."""
    size = max(1.0, (width * height / 144) ** 0.5)
    return max(1, round(height / size)), max(1, round(width / size))


@dataclass(frozen=True)
class Pair:
    """Mean and squared standard error of the mean of both renderers, and the degrees of freedom of the latter.

    The four arrays have one shape, that of the parts which were measured.
    """

    ours: Floats
    reference: Floats
    ours_error2: Floats
    reference_error2: Floats
    ours_degrees: int
    reference_degrees: int

    @classmethod
    def of(cls, ours: Floats, reference: Floats) -> "Pair":
        """Of two arrays of measurements, the first axis of each being its batches (at least two)."""
        if min(len(ours), len(reference)) < 2:
            raise ValueError(f"each renderer needs at least two batches, not {len(ours)} and {len(reference)}")
        a, b = (batches.var(axis=0, ddof=1) / len(batches) for batches in (ours, reference))
        return cls(ours.mean(axis=0), reference.mean(axis=0), a, b, len(ours) - 1, len(reference) - 1)

    @property
    def error(self) -> Floats:
        """Standard error of the difference of the means."""
        return np.sqrt(self.ours_error2 + self.reference_error2)

    @property
    def relative_error(self) -> Floats:
        """:attr:`error` relative to the reference, infinite where only the reference is black."""
        return _ratio(self.error, self.reference)

    @property
    def relative_difference(self) -> Floats:
        """(ours - reference) / reference, infinite where only the reference is black."""
        return _ratio(self.ours - self.reference, self.reference)

    def degrees(self, scale: float = 1.0) -> Floats:
        """Of freedom, of the difference ours - scale · reference (Satterthwaite 1946)."""
        a, b = self.ours_error2, scale**2 * self.reference_error2
        with np.errstate(invalid="ignore", divide="ignore"):
            both = 1 / ((a / (a + b)) ** 2 / self.ours_degrees + (b / (a + b)) ** 2 / self.reference_degrees)
        return np.where(a + b > 0, both, self.ours_degrees + self.reference_degrees)


def _ratio(a: Floats, b: Floats) -> Floats:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where((a == 0) & (b == 0), 0.0, a / b)


def difference_p(pair: Pair, rounding: float = ROUNDING) -> Floats:
    """Two-sided p-values of Welch's t-test that the means differ.

    A difference counts from ``rounding`` (relative to the larger mean) on. Where neither renderer varies, p
    is 1 up to there and 0 beyond.
    """
    least = rounding * np.maximum(np.abs(pair.ours), np.abs(pair.reference))
    excess = np.maximum(0, np.abs(pair.ours - pair.reference) - least)
    return 2 * _upper_tail(excess, pair.error, pair.degrees(), at_zero=0.5)


def z_scores(pair: Pair, p: Floats) -> Floats:
    """``p`` as deviates of the standard normal distribution with the sign of ours - reference, at most 37."""
    from scipy import stats

    return np.asarray(np.sign(pair.ours - pair.reference) * stats.norm.isf(np.maximum(p, _LEAST_P) / 2))


def equivalence_p(pair: Pair, margin: float) -> Floats:
    """p-values of the two one-sided tests that the relative difference lies within ±``margin``.

    Small where it does; the larger one of both tests. The ratio of the means is tested in its linear form,
    ours - (1 ± margin) · reference, so that the noise of the reference counts as well (Sasabuchi 1988).
    """
    tails = []
    for sign in (-1, 1):
        scale = 1 + sign * margin
        distance = sign * (scale * pair.reference - pair.ours)
        error = np.sqrt(pair.ours_error2 + scale**2 * pair.reference_error2)
        tails.append(_upper_tail(distance, error, pair.degrees(scale), at_zero=0.0))
    return np.maximum(*tails)


def _upper_tail(distance: Floats, error: Floats, degrees: Floats, at_zero: float) -> Floats:
    """P(T > distance / error) of Student's t. Without any error: 0 or 1, and ``at_zero`` at distance 0."""
    from scipy import stats

    with np.errstate(invalid="ignore", divide="ignore"):
        tail = stats.t.sf(distance / error, degrees)
    exact = np.where(distance > 0, 0.0, np.where(distance < 0, 1.0, at_zero))
    return np.asarray(np.where(error > 0, tail, exact))


def detectable_bias(pair: Pair, level: float) -> Floats:
    """The smallest relative bias that :func:`difference_p` falls below ``level`` for with :data:`POWER`."""
    return _noncentrality(pair, level / 2, 1 - POWER) * pair.relative_error + ROUNDING


def provable_margin(pair: Pair, level: float, power: float | Floats = POWER) -> Floats:
    """The smallest margin that :func:`equivalence_p` falls below ``level`` for with ``power`` if nothing differs."""
    return _noncentrality(pair, level, (1 - power) / 2) * pair.relative_error


def _noncentrality(pair: Pair, level: float, miss: float | Floats) -> Floats:
    """How many standard errors apart means must be for a one-sided t-test at ``level`` to miss it with the
    probability ``miss``: the normal approximation of noncentral t of Johnson and Welch 1940, "Applications
    of the non-central t-distribution"."""
    from scipy import stats

    critical = stats.t.isf(level, pair.degrees())
    spread = np.sqrt(1 + critical**2 / (2 * pair.degrees()))
    return np.asarray(critical * (1 - 1 / (4 * pair.degrees())) + stats.norm.isf(miss) * spread)
