# SPDX-License-Identifier: MIT
"""What rough coats pass, as the coefficients that shaders/bsdf/rough_plastic.glsl evaluates."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene.microfacets import fresnel, internal_reflectance, rough_interface

ROUGHNESSES = 33  # evenly from 0 to 1, where a texture says how rough the coat is
LEAST_ALPHA = 1e-4  # of bsdf/ggx.glsl
_RIDGE = 1e-5  # keeps coefficients small where powers are nearly the same


def basis(alpha: float, ior: float, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """The functions (n, 7) of ``cosine`` (n,) whose sum is fitted: what a smooth coat passes at about the angle to a
    visible facet, times powers 0 to 4 of alpha over the cosine of that, ``cosine`` and its sine."""
    facet = (cosine + np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2)) / 2
    powers = [(alpha / facet) ** i for i in range(5)] + [cosine, np.sqrt(1 - cosine**2)]
    return np.stack(powers, axis=1) * (1 - fresnel(facet, ior))[:, None]


@lru_cache(maxsize=256)
def coat(alpha: float, ior: float) -> dict[str, Any]:
    """The record of a coat: a fit to what it passes that errs by less than 0.1 % of the light that arrives, and what it
    does not reflect within."""
    alpha = max(alpha, LEAST_ALPHA)
    ends = (1 - np.cos(np.pi * np.arange(1, 25) / 24)) / 2  # crowded towards 0 and 1
    cosine = np.concatenate([ends, ends**2])
    _, passed = rough_interface(alpha, ior, cosine)
    weights = 1 / (passed + 0.1)
    matrix = basis(alpha, ior, cosine) * weights[:, None]
    ridge = _RIDGE**2 * len(cosine) * np.eye(matrix.shape[1])
    found = np.linalg.solve(matrix.T @ matrix + ridge, matrix.T @ (passed * weights))
    return {"facets": found[:4], "angles": found[4:], "leaving": 1 - internal_reflectance(alpha, ior)}
