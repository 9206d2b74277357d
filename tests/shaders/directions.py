# SPDX-License-Identifier: MIT
"""Unit vectors for the tests, rounded to float32 as the shader will see them."""

import numpy as np
from numpy.typing import NDArray


def direction(degrees: float, turns: float = 0.3) -> tuple[float, float, float]:
    """At an angle to the normal."""
    theta, phi = np.radians(degrees), 2 * np.pi * turns
    x, y, z = np.float32([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]).tolist()
    return x, y, z


def random_directions(rng: np.random.Generator, count: int) -> NDArray[np.float32]:
    """Uniform over the sphere, (count, 3)."""
    v = rng.normal(size=(count, 3))
    return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)


def upper_directions(rng: np.random.Generator, count: int) -> NDArray[np.float32]:
    """Uniform over the upper hemisphere, (count, 3)."""
    v = random_directions(rng, count)
    v[:, 2] = np.abs(v[:, 2])
    return v
