# SPDX-License-Identifier: MIT
"""Light sampling, BSDF sampling and both together converge to the same picture."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.doctor import Finding
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer

_SEEDS, _SPP, _SIZE = 16, 64, (48, 36)
_SETTINGS: dict[str, Any] = {"bounces": 3, "rays": _SPP, "adaptive": "off"}  # a pilot for each seed would take longer
_LIMIT = 4.5  # |t| of 30 degrees of freedom: one in ten thousand


def findings(context: Any) -> Iterator[Finding]:
    for name in ("three-spheres-ambient", "cornell-box"):
        means = {kind: _means(context, name, kind) for kind in ("mis", "nee", "bsdf")}
        for kind in ("nee", "bsdf"):
            t = _welch(means["mis"], means[kind])
            difference = means[kind].mean() / means["mis"].mean() - 1
            detail = f"{100 * difference:+.2f} %, |t| = {abs(t):.1f}"
            yield Finding("estimators", f"{name}: mis and {kind}", abs(t) < _LIMIT, detail)


def _means(context: Any, name: str, estimator: str) -> NDArray[np.float64]:
    """The mean of the picture for each seed."""
    with Renderer(load(name), _SIZE, context, estimator=estimator, **_SETTINGS) as renderer:
        means = []
        for seed in range(_SEEDS):
            renderer.reset(seed=seed)
            renderer.sample(_SPP)
            means.append(renderer.image().mean(dtype=np.float64))
    return np.array(means)


def _welch(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float((a.mean() - b.mean()) / np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b)))
