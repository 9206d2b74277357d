# SPDX-License-Identifier: MIT
"""Pictures for the tests of this folder, none of them rendered."""

from collections.abc import Callable

import numpy as np
import pytest

from fragtracer.apps.compare.rendering import OURS, REFERENCE, Rendering
from fragtracer.apps.compare.run import Comparison, compare_renderings
from fragtracer.scene import Scene

BATCHES, HEIGHT, WIDTH = 16, 36, 48


def noisy(rng: np.random.Generator, deviation: float = 0.02, batches: int = BATCHES) -> np.ndarray:
    """A stack of pictures of a gradient with normal noise, whose deviation is relative."""
    scene = np.linspace(0.2, 1.0, WIDTH)[:, None] * np.array([1.0, 0.8, 0.5])
    return scene * rng.normal(1, deviation, (batches, HEIGHT, WIDTH, 3))


@pytest.fixture
def compared() -> Callable[..., Comparison]:
    """Makes a comparison in which ours is ``factor`` as bright, the pictures having ``deviation`` of noise."""

    def make(factor: float = 1.0, deviation: float = 0.02, non_finite: int = 0) -> Comparison:
        rng = np.random.default_rng(7)
        ours, reference = (noisy(rng, deviation).astype(np.float32) for _ in range(2))
        first = Rendering(OURS, ours * np.float32(factor), 64, 0.5, 2.0, "a device", non_finite)
        second = Rendering(REFERENCE, reference, 64, 0.25, 3.0, "a variant")
        return compare_renderings(Scene(name="test <scene>"), first, second)

    return make
