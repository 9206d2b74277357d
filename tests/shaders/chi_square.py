# SPDX-License-Identifier: MIT
"""Pearson's chi² test of samples against the density that they should have.

The level of a test is that of all its comparisons together (Šidák 1967, Rectangular Confidence
Regions for the Means of Multivariate Normal Distributions); seeds are fixed, so a test that passed
goes on passing until the shader changes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from . import Floats
from .domains import Domain

LEVEL = 1e-3  # chance that a test fails although all its samplers are right
_SMALLEST = 10.0  # expected samples in a cell; cells with fewer count together as one


@dataclass(frozen=True)
class Fit:
    """How samples agree with a density."""

    p: float  # chance of a worse agreement
    mass: float  # integral of the density over the domain
    missing: float  # fraction of samples that are none, or outside the domain
    samples: int

    @property
    def lost(self) -> float:
        """What mass and missing samples lack to 1, in standard errors and the tolerance of the quadrature."""
        error = np.sqrt(self.missing * (1 - self.missing) / self.samples)
        return abs(1 - self.mass - self.missing) / (error + 2e-5)


def fit(
    domain: Domain,
    points: Floats,
    pdf: Callable[[Floats], Floats],
    missing: int = 0,
    cells: tuple[int, int] = (12, 8),
    order: tuple[int, int] = (8, 16),
) -> Fit:
    """Compare ``points`` (n, k), and ``missing`` further samples that are none, with ``pdf``."""
    inside = cell_integrals(domain, pdf, cells, order)
    total = len(points) + missing
    counts = _count(*domain.locate(np.asarray(points, np.float64)), cells)
    outside = total - counts.sum()
    observed = np.append(counts, outside)
    expected = total * np.append(inside, max(0.0, 1 - inside.sum()))
    return Fit(chi_square(observed, expected), float(inside.sum()), float(outside / total), total)


def cell_integrals(
    domain: Domain, pdf: Callable[[Floats], Floats], cells: tuple[int, int], order: tuple[int, int]
) -> Floats:
    """Integral of ``pdf`` over each cell, by Gauss-Legendre nodes in the domain's own coordinates."""
    points, weights = nodes(domain, cells, order)
    values = np.asarray(pdf(points), np.float64) * weights
    return values.reshape(cells[0], order[0], cells[1], order[1]).sum(axis=(1, 3)).ravel()


def nodes(domain: Domain, cells: tuple[int, int], order: tuple[int, int]) -> tuple[Floats, Floats]:
    """Points (n, k) of the domain and weights (n,): sum(weight * f(point)) integrates f over it."""
    (s, weights_s), (t, weights_t) = (_composite(c, o) for c, o in zip(cells, order, strict=True))
    points, measure = domain.place(np.repeat(s, len(t)), np.tile(t, len(s)))
    return points, measure * np.outer(weights_s, weights_t).ravel()


def chi_square(observed: Floats, expected: Floats) -> float:
    """The p-value of counts against those expected, of as many samples."""
    few = expected < _SMALLEST
    observed = np.append(observed[~few], observed[few].sum())
    expected = np.append(expected[~few], expected[few].sum())
    if expected[-1] < _SMALLEST:  # too few even together: join them to the cell with the fewest
        least = np.argmin(expected[:-1])
        observed[least] += observed[-1]
        expected[least] += expected[-1]
        observed, expected = observed[:-1], expected[:-1]
    return float(stats.chi2.sf(((observed - expected) ** 2 / expected).sum(), len(expected) - 1))


def assert_uniform(samples: Mapping[str, Floats], cells: int = 256) -> None:
    """Each column of numbers, or of pairs (n, 2) of them, is uniform in [0, 1)."""
    p_values = {}
    for name, values in samples.items():
        assert values.min() >= 0, name
        assert values.max() < 1, name
        if values.ndim == 1:
            counts = _count(values, np.zeros(len(values)), (cells, 1))
        else:
            side = int(np.sqrt(cells))
            counts = _count(values[:, 0], values[:, 1], (side, side))
        p_values[name] = chi_square(counts, np.full(len(counts), len(values) / len(counts)))
    assert_likely(p_values)


def assert_fits(fits: Mapping[str, Fit]) -> None:
    """All samplers have their density, and where it integrates to less than 1, the rest are no samples."""
    lost = {name: f"mass {f.mass:.5f}, missing {f.missing:.5f}" for name, f in fits.items() if f.lost > 5}
    assert not lost, lost
    assert_likely({name: f.p for name, f in fits.items()})


def assert_likely(p_values: Mapping[str, float]) -> None:
    """No p-value is below the level of its share of the test."""
    level = 1 - (1 - LEVEL) ** (1 / len(p_values))
    failed = {name: p for name, p in p_values.items() if not p >= level}
    assert not failed, f"p below {level:.2g}: {failed}"


def _count(s: Floats, t: Floats, cells: tuple[int, int]) -> Floats:
    """Samples in each cell, those outside the unit square left out."""
    inside = (s >= 0) & (s < 1)
    if not inside.all():
        s, t = s[inside], t[inside]
    column = np.minimum((t * cells[1]).astype(np.int64), cells[1] - 1)
    row = (s * cells[0]).astype(np.int64)
    return np.bincount(row * cells[1] + column, minlength=cells[0] * cells[1]).astype(np.float64)


def _composite(cells: int, order: int) -> tuple[Floats, Floats]:
    """Nodes and weights for [0, 1], a Gauss-Legendre rule in each of ``cells`` equal parts."""
    x, w = np.polynomial.legendre.leggauss(order)
    return ((np.arange(cells)[:, None] + (x + 1) / 2) / cells).ravel(), np.tile(w / 2 / cells, cells)
