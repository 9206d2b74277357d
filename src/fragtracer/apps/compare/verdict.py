# SPDX-License-Identifier: MIT
"""From two stacks of pictures to a verdict: agreement, disagreement, or too noisy to say.

The pictures are compared at three scales: as a whole, in 4 x 4 regions and in about 144 blocks, in
each colour. Each scale has a third of the level α, so that the whole picture, where a small bias of
everything shows, does not pay for the number of blocks, where a large error in one place shows.

- *Disagreement* (exit status 1): a part differs. The probability that any part of two correct renderers
  does is α. A difference smaller than the margin counts too.
- *Agreement* (0): no part differs, and every colour of the whole picture and of every region that was
  measured well enough is equivalent within the margin, at level α again. All of them must be, which
  needs no correction for their number (Berger 1982, "Multiparameter hypothesis testing and
  acceptance sampling"). A region is measured well enough if all such regions of two equal
  renderers pass with a probability of at least 95 %; darker and noisier ones are not asked.
- *Inconclusive* (2): no part differs, but the noise leaves room for a bias as large as the margin.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer.apps.compare import statistics
from fragtracer.apps.compare.statistics import POWER, Floats, Pair

ALPHA = 0.01
MARGIN = 0.01
REGIONS = 4

Outcome = Literal["agreement", "disagreement", "inconclusive"]
Means = Mapping[str, Floats]
EXIT_STATUS: dict[Outcome, int] = {"agreement": 0, "disagreement": 1, "inconclusive": 2}


@dataclass(frozen=True)
class Scale:
    """The tests of one grid of parts; arrays are (rows, columns, 3). ``level`` is that of one test."""

    pair: Pair
    level: float

    @cached_property
    def p(self) -> Floats:
        """Of the difference test."""
        return statistics.difference_p(self.pair)

    @cached_property
    def z(self) -> Floats:
        """The difference as a standard normal deviate, positive where ours is brighter."""
        return statistics.z_scores(self.pair, self.p)

    @property
    def critical(self) -> float:
        """The magnitude of ``z`` from which on one test finds a difference."""
        return -NormalDist().inv_cdf(self.level / 2)

    @property
    def differs(self) -> NDArray[np.bool_]:
        return np.asarray(self.p < self.level)

    @property
    def lit(self) -> NDArray[np.bool_]:
        """Where the two means are not both exactly 0."""
        return np.asarray((self.pair.ours != 0) | (self.pair.reference != 0))

    @property
    def detectable_bias(self) -> Floats:
        """The smallest relative bias of each mean that its difference test finds with a probability of 95 %."""
        return statistics.detectable_bias(self.pair, self.level)

    @property
    def noise_z(self) -> Floats:
        """One-dimensional: the standard normal deviates of the parts whose noise is more than ten times what counts
        as rounding. If nothing differs, they are of the standard normal distribution."""
        noisy = self.pair.relative_error > 10 * statistics.ROUNDING
        return statistics.z_scores(self.pair, statistics.difference_p(self.pair, rounding=0))[noisy]


@dataclass(frozen=True)
class Verdict:
    """The outcome of all tests at the level ``alpha`` and with the equivalence margin ``margin``.

    ``spp_factor`` is how many times as many samples would probably give a verdict that is not
    "inconclusive"; 1 where this one is not.
    """

    image: Scale
    regions: Scale
    blocks: Scale
    margin: float
    alpha: float
    non_finite: int = 0

    @property
    def scales(self) -> tuple[Scale, ...]:
        return self.image, self.regions, self.blocks

    @property
    def comparisons(self) -> int:
        return sum(scale.p.size for scale in self.scales)

    @property
    def differing(self) -> int:
        """The number of parts and colours that differ."""
        return sum(int(scale.differs.sum()) for scale in self.scales)

    @property
    def judged_regions(self) -> NDArray[np.bool_]:
        """The regions and colours that are tested for equivalence, (rows, columns, 3); black ones among them."""
        return np.asarray(self._provable_regions <= self.margin)

    @property
    def _provable_regions(self) -> Floats:
        """The smallest margin that all regions of equal renderers prove with a probability of 95 %."""
        power = 1 - (1 - POWER) / self.regions.p.size
        return statistics.provable_margin(self.regions.pair, self.alpha, power)

    @property
    def equivalent_image(self) -> NDArray[np.bool_]:
        """Per colour."""
        return np.asarray(statistics.equivalence_p(self.image.pair, self.margin)[0, 0] < self.alpha)

    @property
    def equivalent_regions(self) -> NDArray[np.bool_]:
        return np.asarray(statistics.equivalence_p(self.regions.pair, self.margin) < self.alpha)

    @property
    def outcome(self) -> Outcome:
        if self.differing or self.non_finite:
            return "disagreement"
        proved = self.equivalent_image.all() and self.equivalent_regions[self.judged_regions].all()
        return "agreement" if proved else "inconclusive"

    @property
    def exit_status(self) -> int:
        return EXIT_STATUS[self.outcome]

    @property
    def detectable_bias(self) -> Floats:
        """The smallest relative bias of the whole picture's mean that the difference test finds with
        a probability of 95 %, per colour (3,)."""
        return np.asarray(self.image.detectable_bias[0, 0])

    @property
    def judged_share(self) -> tuple[int, int]:
        """How many regions and colours are tested for equivalence, of how many that are not black."""
        return int((self.judged_regions & self.regions.lit).sum()), int(self.regions.lit.sum())

    @property
    def block_biases(self) -> tuple[float, float]:
        """The detectable bias of the median and of the worst of the blocks and colours that are not black."""
        biases = self.blocks.detectable_bias[self.blocks.lit]
        return (float(np.median(biases)), float(biases.max())) if biases.size else (0.0, 0.0)

    @property
    def provable_margin(self) -> Floats:
        """The smallest margin that equal renderers prove with a probability of 95 %, per colour (3,)."""
        return np.asarray(statistics.provable_margin(self.image.pair, self.alpha)[0, 0])

    @property
    def spp_factor(self) -> float:
        if self.outcome != "inconclusive":
            return 1.0
        left = self.margin - np.minimum(np.abs(self.image.pair.relative_difference[0, 0]), self.margin / 2)
        factors = (self.provable_margin / left)[np.isfinite(self.provable_margin)]  # not of a colour that is black
        return max(1.5, float(np.max(factors, initial=0.0)) ** 2)

    def spp_factor_for(self, judged: float, block_bias: float) -> float:
        """How many times as many samples would probably have the share ``judged`` of the regions and colours that
        are not black tested for equivalence, and the median block detect ``block_bias``."""
        margins = self._provable_regions[self.regions.lit]
        region = float(np.quantile(margins, judged, method="higher")) / self.margin if margins.size else 0.0
        return max(region, self.block_biases[0] / block_bias) ** 2


def judge(
    ours: ArrayLike,
    reference: ArrayLike,
    margin: float = MARGIN,
    alpha: float = ALPHA,
    non_finite: int = 0,
) -> Verdict:
    """Compare two stacks of independent pictures.

    Parameters
    ----------
    ours, reference
        Finite linear radiance, (batches, height, width, 3), at least two batches each; height, width
        alike.
    margin
        The relative difference up to which means count as equal, above 0 and below 1.
    alpha
        Level of the difference tests together, and of the equivalence tests.
    non_finite
        Samples of ours that were NaN or infinite and are not in the pictures; any is a disagreement.
    """
    stacks = [np.asarray(stack, np.float64) for stack in (ours, reference)]
    shapes = [stack.shape for stack in stacks]
    if shapes[0][1:] != shapes[1][1:] or stacks[0].ndim != 4 or shapes[0][3] != 3:
        raise ValueError(f"the pictures must be (batches, height, width, 3) of one size, not {shapes[0]}, {shapes[1]}")
    if not all(np.isfinite(stack).all() for stack in stacks):
        raise ValueError("the pictures must be finite")
    return judge_means(scale_means(stacks[0]), scale_means(stacks[1]), margin, alpha, non_finite)


def scale_means(pictures: ArrayLike) -> Means:
    """All that :func:`judge` looks at: for each scale the means of its parts of (batches, height, width, 3)
    pictures, as float64 (batches, rows, columns, 3)."""
    stack = np.asarray(pictures)
    height, width = stack.shape[1:3]
    grids = {
        "image": (1, 1),
        "regions": (min(REGIONS, height), min(REGIONS, width)),
        "blocks": statistics.block_grid(width, height),
    }
    return {name: statistics.part_means(stack, rows, columns) for name, (rows, columns) in grids.items()}


def judge_means(
    ours: Means, reference: Means, margin: float = MARGIN, alpha: float = ALPHA, non_finite: int = 0
) -> Verdict:
    """:func:`judge` for pictures of which only the :func:`scale_means` are left."""
    if not (0 < margin < 1 and 0 < alpha < 0.5):
        raise ValueError(f"margin = {margin} must lie between 0 and 1, alpha = {alpha} between 0 and 0.5")
    scales = {}
    for name in ours:
        pair = Pair.of(ours[name], reference[name])
        level = statistics.sidak(statistics.sidak(alpha, len(ours)), pair.ours.size)
        scales[name] = Scale(pair, level)
    return Verdict(**scales, margin=margin, alpha=alpha, non_finite=non_finite)
