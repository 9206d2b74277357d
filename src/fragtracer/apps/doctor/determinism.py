# SPDX-License-Identifier: MIT
"""The same seed gives the same picture, bit for bit, whatever the size of a pass."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.doctor import Finding
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer


def findings(context: Any) -> Iterator[Finding]:
    first = _picture(context, rays=16)
    yield _same("repeated", first, _picture(context, rays=16))
    yield _same("in other passes", first, _picture(context, rays=5))
    other = _picture(context, rays=16, seed=1)
    yield Finding("determinism", "another seed", bool((first != other).any()), "another picture")


def _picture(context: Any, **settings: Any) -> NDArray[np.float32]:
    with Renderer(load("three-spheres-ambient"), (64, 36), context, **settings) as renderer:
        renderer.sample(32)
        return renderer.image()


def _same(subject: str, a: NDArray[np.float32], b: NDArray[np.float32]) -> Finding:
    differing = int((a != b).any(axis=2).sum())
    return Finding("determinism", subject, differing == 0, f"{differing} of {a.shape[0] * a.shape[1]} pixels differ")
