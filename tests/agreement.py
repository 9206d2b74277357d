# SPDX-License-Identifier: MIT
"""Tests of the mean of images: t-tests with a bound on the bias that they may miss.

Pixels are independent of each other, and so are seeds, whichever the sampler: each pixel of each
seed has its own randomisation (shaders/sampler/texture.glsl; test_convergence.py holds it to that).
Samples of one pixel are not. So the values compared here are pixels of whole images, whose scatter
between seeds gives the standard error.

All comparisons of an assertion have LEVEL as their family-wise error rate (Šidák's correction). Seeds are
fixed: on one machine a test always gives the same result.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from fragtracer.apps.compare.rendering import Rendering
from fragtracer.apps.compare.verdict import judge

LEVEL = 1e-4  # probability that a correct renderer fails an assertion, over random seeds
ROUNDING = 3e-6  # relative, of some hundred float32 operations and of the running mean

Array = NDArray[np.float64]


def critical(comparisons: int, degrees: float | Array, level: float = LEVEL) -> Array:
    """Critical |t| of ``comparisons`` two-sided tests with a family-wise error rate of ``level``."""
    alone = -np.expm1(np.log1p(-level) / comparisons)
    bound: Array = stats.t.isf(alone / 2, degrees)
    return bound


def assert_mean(images: ArrayLike, expected: ArrayLike, resolution: float, rounding: float = ROUNDING) -> None:
    """All pixels of ``images`` (..., 3) have the colour ``expected`` in the mean.

    Fails as well if the noise could hide a bias of ``resolution``, relative to ``expected``.
    """
    values = np.asarray(images, np.float64).reshape(-1, 3)
    target = np.broadcast_to(np.asarray(expected, np.float64), 3)
    error = values.std(0, ddof=1) / np.sqrt(len(values))
    tolerance = critical(3, len(values) - 1) * error + rounding * np.abs(target)
    difference = values.mean(0) - target
    assert (np.abs(difference) <= tolerance).all(), f"{values.mean(0)}, not {target} ± {tolerance}"
    assert (tolerance <= resolution * np.abs(target)).all(), f"too noisy: {tolerance} of {target}"


def assert_agree(a: ArrayLike, b: ArrayLike, resolution: float, blocks: tuple[int, int] = (4, 4)) -> None:
    """Two stacks of images (seeds, height, width, 3) have the same mean, over the whole image and over each
    of ``blocks`` (rows, columns), in each colour.

    Fails as well if the noise could hide a bias of ``resolution`` of the image mean.
    """
    first, second = (np.asarray(images, np.float64) for images in (a, b))
    _, height, width, _ = first.shape
    parts = [(slice(None), slice(None))]
    rows, columns = (np.linspace(0, n, k + 1).astype(int) for n, k in zip((height, width), blocks, strict=True))
    parts += [
        (slice(top, bottom), slice(left, right)) for top, bottom in pairwise(rows) for left, right in pairwise(columns)
    ]
    failed, noisy = [], ""
    for part in parts:
        difference, error, degrees = _welch(first[:, *part], second[:, *part])
        size = np.abs(second[:, *part].mean((0, 1, 2)))
        tolerance = critical(3 * len(parts), degrees) * error + ROUNDING * size
        if part == parts[0] and (tolerance > resolution * size).any():
            noisy = f"too noisy: {tolerance} of {size}"
        if (np.abs(difference) > tolerance).any():
            failed.append(f"{part}: {difference} of {size} is more than {tolerance}")
    assert not failed, f"{len(failed)} of {len(parts)} regions differ; " + "\n".join(failed)
    assert not noisy, noisy


def assert_proved(ours: Rendering, reference: Rendering, level: float, margin: float = 0.02) -> None:
    """Two renderings of one scene agree: no part differs, and the mean of each colour and of each region that is
    measured well enough is equivalent within ``margin``; and images 1 % brighter or darker would be refused for their
    mean.

    ``level`` is the probability that a correct renderer is refused, and that the means of different ones are accepted.
    """
    verdict = judge(ours.pictures, reference.pictures, margin, level, ours.non_finite)
    image = verdict.image
    found = verdict.outcome, verdict.differing, image.pair.relative_difference, image.detectable_bias
    assert verdict.outcome == "agreement", found
    for factor in (0.99, 1.01):
        scaled = judge(factor * ours.pictures.astype(np.float64), reference.pictures, margin, level)
        assert scaled.image.differs.any(), (factor, *found)


def _welch(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """Difference of the means of two stacks (seeds, height, width, 3), its standard error and degrees
    of freedom, per colour. The variance of a pixel is that between its seeds, so that the image
    content does not count as noise. Where few pixels have all the noise, as at the edge of a light, there are
    few degrees of freedom (Satterthwaite 1946), and the bound is wide."""
    variances = [(stack.var(0, ddof=1) / len(stack), len(stack) - 1) for stack in (a, b)]
    total = sum(v.sum((0, 1)) for v, _ in variances)
    spread = sum((v**2).sum((0, 1)) / degrees for v, degrees in variances)
    pixels = a.shape[1] * a.shape[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        degrees = np.where(total > 0, total**2 / spread, pixels)
    return a.mean((0, 1, 2)) - b.mean((0, 1, 2)), np.sqrt(total) / pixels, degrees
