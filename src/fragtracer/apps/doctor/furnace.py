# SPDX-License-Identifier: MIT
"""Furnace test: a closed room whose walls emit, with a known solution."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from fragtracer.apps.doctor import Finding
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer

_ANSWER = 0.5


def findings(context: Any) -> Iterator[Finding]:
    for estimator in ("mis", "bsdf"):
        with Renderer(load("furnace"), (48, 48), context, estimator=estimator, sampler="hash") as renderer:
            renderer.sample(256)
            image, error = renderer.image(), renderer.standard_error()
            bad = renderer.non_finite_samples()
        tolerance = 4 * float(np.sqrt((error.astype(np.float64) ** 2).mean() / (48 * 48))) + 1e-6
        mean = float(image[..., 0].mean(dtype=np.float64))
        passed = abs(mean - _ANSWER) < tolerance and bad == 0
        yield Finding("furnace", f"estimator {estimator}", passed, f"{mean:.5f} ± {tolerance:.5f}, {bad} not finite")
