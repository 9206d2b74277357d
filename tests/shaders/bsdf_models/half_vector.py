# SPDX-License-Identifier: MIT
"""Cook-Torrance with the half vector's Fresnel term in the factor of the base."""

from dataclasses import dataclass, replace

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Material
from .cook_torrance import COOK_TORRANCE, cook_torrance, float32_tolerance


@dataclass(frozen=True)
class HalfVector(Material):
    """Whose base has 1 - F(wo . wh) in place of what passes the interface."""

    half_vector: int = 1


def half_vector_eval(m: HalfVector, wo: Floats, wi: Floats) -> Floats:
    cosine = np.linalg.norm(wo + wi, axis=-1) / 2
    base = np.asarray(m.diffuse) * (1 - bsdf_oracle.fresnel(m.f0, m.f90, cosine)) * wi[..., 2:] / np.pi
    if m.alpha == 0:
        return base
    return base + bsdf_oracle.bsdf_eval(replace(m, diffuse=(0.0, 0.0, 0.0)), "SMITH", wo, wi)


def half_vector_largest_weight(m: HalfVector, cosine: Floats) -> Floats:
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance = bsdf_oracle.specular_probability(m, wo)[:, None]
    with np.errstate(divide="ignore"):
        return np.maximum(np.maximum(m.f0, m.f90) / chance, np.asarray(m.diffuse) / (1 - chance))


def half_vector_tolerance(m: HalfVector, wo: Floats, wi: Floats) -> Floats:
    """As without, and what rounding the half vector makes of 1 - F where that is little."""
    size = np.linalg.norm(wo + wi, axis=-1)
    passed = 1 - bsdf_oracle.fresnel(m.f0, m.f90, size / 2).max(axis=-1)
    return float32_tolerance(m, wo, wi) + 1e-6 / np.maximum(passed * size, 1e-30)


HALF_VECTOR = replace(
    cook_torrance("SMITH"),
    materials={
        name: [HalfVector(m.diffuse, alpha, m.f0, m.f90) for alpha in (0.0, 0.01, 0.5)]
        for name, m in COOK_TORRANCE.items()
        if name in ("plastic", "half metallic")
    },
    value=half_vector_eval,
    largest_weight=half_vector_largest_weight,
    tolerance=half_vector_tolerance,
    whitest=[],
    lossless=[],
    makes_energy=True,
    scene_materials=[
        scene.Material(albedo=(0.8, 0.6, 0.4), roughness=0.2, diffuse_factor="half-vector"),
        scene.Material(albedo=(0.8, 0.6, 0.4), roughness=0.6, metallic=0.3, diffuse_factor="half-vector"),
    ],
)
