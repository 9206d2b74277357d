# SPDX-License-Identifier: MIT
"""shape/sphere_reflection.glsl: places on a sphere where light is reflected."""

import moderngl
import numpy as np
import pytest

from fragtracer.probe import probe

from .directions import random_directions


@pytest.mark.parametrize("low", [-3.0, -1.0])
def test_light_is_reflected_where_angles_are_alike(ctx: moderngl.Context, low: float) -> None:
    """From 0.1 % of the radius above a sphere to a hundred radii away, wherever neither end hides the other."""
    rng = np.random.default_rng(1)
    a, b = (
        (random_directions(rng, 20_000) * (1 + 10 ** rng.uniform(low, 2, (20_000, 1)))).astype(np.float32)
        for _ in range(2)
    )
    body = "normal = sphere_reflection_normal(a, b);"
    found = probe(ctx, ["shape/sphere_reflection.glsl"], body, {"a": a, "b": b}, {"normal": 3})
    normal = found["normal"].astype(np.float64)
    is_seen = np.linalg.norm(normal, axis=1) > 0
    to_a, to_b = a - normal, b - normal
    to_a, to_b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (to_a, to_b))
    # Each sees the place of the other's reflection, or the sphere is between the two.
    assert np.abs(np.linalg.norm(normal[is_seen], axis=1) - 1).max() < 1e-6
    cosines = (to_a * normal).sum(1), (to_b * normal).sum(1)
    assert min(cosine[is_seen].min() for cosine in cosines) > -1e-3
    mirrored = 2 * cosines[0][:, None] * normal - to_a
    # A direction is known no better than the place, which is float32, allows.
    distance = np.linalg.norm(np.stack([a - normal, b - normal]), axis=2).min(axis=0)
    assert (np.linalg.norm(mirrored - to_b, axis=1) * np.minimum(distance, 1))[is_seen].max() < 5e-6
    along = np.clip(-(a * (b - a)).sum(1) / np.square(b - a).sum(1), 0, 1)[:, None]
    nearest = np.linalg.norm(a + along * (b - a), axis=1)
    assert (is_seen == (nearest > 1))[np.abs(nearest - 1) > 1e-4].all()
