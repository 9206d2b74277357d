# SPDX-License-Identifier: MIT
"""The error of an image against a reference that is itself noisy.

The reference is two independent images r1 and r2. Their difference measures their noise, which is subtracted from the
error of an image x that is independent of both:
E[(x - r)²] = error of x + noise of r, r = (r1 + r2) / 2, noise of r = E[(r1 - r2)²] / 4.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fragtracer.apps.bench.contenders import Contender, Image, Mitsuba, Ours, Sampling
from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.scene import Scene

_REFERENCE_SEED = 1_000_003
_TRIMMED = 0.01  # of the pixels
# By the only sampler of Mitsuba that is stratified and has no bias (docs/performance.md).
REFERENCE_SAMPLINGS = [Sampling("orthogonal", spp) for spp in (49, 25, 9)]


@dataclass(frozen=True)
class Reference:
    """Two independent images of the same scene, (height, width, 3)."""

    first: Image
    second: Image

    @property
    def weight(self) -> Image:
        """What makes a squared error relative, (height, width, 1)."""
        return relative_weight((self.first + self.second) / 2)

    def relative_mse(self, image: Image) -> float:
        """Mean squared error relative to the brightness of each pixel, the reference's noise subtracted."""
        error = (image - (self.first + self.second) / 2) ** 2 - (self.first - self.second) ** 2 / 4
        return float((error * self.weight).mean())

    def trimmed_mse(self, image: Image, other: Image) -> float:
        """:meth:`relative_mse` without the 1 % of pixels where ``image`` differs most from ``other``, one by the same
        renderer that is independent of both and of this: without caustics. By the difference from this, pixels where
        it is noisy would be left out, and their noise be subtracted all the same."""
        differs = ((image - other) ** 2 * self.weight).mean(axis=2)
        kept = differs <= np.quantile(differs, 1 - _TRIMMED)
        error = (image - (self.first + self.second) / 2) ** 2 - (self.first - self.second) ** 2 / 4
        return float((error * self.weight).mean(axis=2)[kept].mean())

    @property
    def noise(self) -> float:
        """The relative mean squared error of the reference itself."""
        return float(((self.first - self.second) ** 2 / 4 * self.weight).mean())

    def relative_bias(self, first: Image, second: Image) -> float:
        """Root of the mean squared difference in expectation between two independent images of a renderer and
        this; 0 where noise alone makes a product negative."""
        product = (first - self.first) * (second - self.second)
        return float(np.sqrt(max(0.0, (product * self.weight).mean())))


def make_reference(
    scene: Scene, seconds: float, who: Literal["both", "own", "mitsuba"] = "both", variant: str | None = None
) -> Reference:
    """Sample each of the two images for ``seconds``, one by each renderer or two by one of them."""
    images = []
    sampling = next((s for s in REFERENCE_SAMPLINGS if s.fits(scene)), REFERENCE_SAMPLINGS[-1])
    for seed, own in ((_REFERENCE_SEED, who != "mitsuba"), (_REFERENCE_SEED + 1, who == "own")):
        with Ours(scene, seed) if own else Mitsuba(scene, seed, variant, sampling) as contender:
            sample_for(contender, seconds)
            images.append(contender.image())
    return Reference(images[0], images[1])


def sample_for(contender: Contender, seconds: float) -> None:
    """Sample until its clock shows ``seconds``."""
    while contender.seconds < seconds:
        contender.sample(contender.step)
