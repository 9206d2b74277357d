# SPDX-License-Identifier: MIT
"""Dynamic resolution keeps frames within their budget."""

from itertools import pairwise

import numpy as np

from fragtracer.apps.viewer.dynamic_resolution import DynamicResolution


def test_dynamic_resolution_fits_one_sample_per_pixel_into_the_budget() -> None:
    resolution = DynamicResolution(target=0.033, overhead=0.013)
    for rate in (1e5, 1e6, 1e7, 1e8, 1e9):
        width, height = resolution.size((1280, 720), rate)
        assert width * height <= rate * 0.02 * 1.01 or width == 80
    assert resolution.size((1280, 720), 1e9) == (1280, 720)
    assert resolution.rays((1280, 720), 1e9, 16) == 16


def test_dynamic_resolution_does_not_flicker_between_two_sizes() -> None:
    resolution = DynamicResolution(target=0.033, overhead=0.013)
    rng = np.random.default_rng(1)
    sizes = [resolution.size((1280, 720), 5e6 * rng.uniform(0.93, 1.07)) for _ in range(200)]
    changes = sum(a != b for a, b in pairwise(sizes))
    assert changes <= 2


def test_dynamic_resolution_lowers_light_samples_before_resolution_and_nothing_where_all_fits() -> None:
    full, budget = (1000, 500), DynamicResolution(target=0.033, overhead=0.013).budget
    needed = 500_000 / budget  # paths per second for one per pixel
    assert DynamicResolution(overhead=0.013).choose(full, 2 * needed, 7, 8) == (full, 8), "fast enough for all"
    half = DynamicResolution(overhead=0.013, level=0)
    assert half.choose(full, needed / 2, 8, 8) == (full, 3), "(1 + 8) / 2 rays a vertex are affordable"
    size, light_samples = DynamicResolution(overhead=0.013).choose(full, needed / 45, 8, 8)
    assert light_samples == 1
    assert size[0] < full[0]


def test_dynamic_resolution_does_not_flicker_between_two_numbers_of_light_samples() -> None:
    resolution, rng, chosen = DynamicResolution(target=0.033, overhead=0.013), np.random.default_rng(1), 8
    counts = []
    for _ in range(200):  # rays per second for four light samples, more or less
        rate = 5 * 500_000 / resolution.budget * rng.uniform(0.93, 1.07) / (1 + chosen)
        _, chosen = resolution.choose((1000, 500), rate, chosen, 8)
        counts.append(chosen)
    assert sum(a != b for a, b in pairwise(counts)) <= 2
