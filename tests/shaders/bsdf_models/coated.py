# SPDX-License-Identifier: MIT
"""A coat over a sheen over Cook-Torrance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Direction, Material
from ..domains import Reflections
from .cook_torrance import COOK_TORRANCE
from .model import WHITE, Delta, Model
from .sheen import (
    RED,
    Sheened,
    sheen_deltas,
    sheen_eval,
    sheen_largest_weight,
    sheen_pdf,
    sheen_shares,
    sheen_tolerance,
)


@dataclass(frozen=True)
class Coated(Sheened):
    """Of BSDF_COATED, whose coat has the normal of the base; without sheen."""

    coat_weight: float = 1.0
    coat_alpha: float = 0.1
    coat_f0: float = 0.04
    base_normal: Direction = (0.0, 0.0, 1.0)
    base_tangent: Direction = (1.0, 0.0, 0.0)
    geometric: Direction = (0.0, 0.0, 1.0)

    @property
    def lacquer(self) -> Material:
        """The coat alone."""
        return Material((0.0, 0.0, 0.0), self.coat_alpha, (self.coat_f0,) * 3, WHITE)

    def passed(self, w: Floats) -> Floats:
        """What the coat lets through (...,)."""
        return 1 - self.coat_weight * bsdf_oracle.interface_reflectance(self.lacquer, w[..., 2])[..., 0]


def coated_probability(m: Coated, wo: Floats) -> Floats:
    """How often the coat is sampled."""
    passed, base = m.passed(wo), sum(sheen_shares(m, wo))
    return (1 - passed) / np.maximum(1 - passed + passed**2 * base, 1e-300)


def coated_eval(m: Coated, wo: Floats, wi: Floats) -> Floats:
    base = sheen_eval(m, wo, wi) * (m.passed(wo) * m.passed(wi))[..., None]
    return base + m.coat_weight * bsdf_oracle.bsdf_eval(m.lacquer, "SMITH", wo, wi)


def coated_pdf(m: Coated, wo: Floats, wi: Floats) -> Floats:
    chance = coated_probability(m, wo)
    return chance * bsdf_oracle.bsdf_pdf(m.lacquer, wo, wi) + (1 - chance) * sheen_pdf(m, wo, wi)


def coated_deltas(m: Coated, wo: Floats) -> Sequence[Delta]:
    """Of a mirror below the coat."""
    return [
        Delta(d.wi, d.value * m.passed(wo)[:, None] ** 2, d.chance * (1 - coated_probability(m, wo)))
        for d in sheen_deltas(m, wo)
    ]


def coated_largest_weight(m: Coated, cosine: Floats) -> Floats:
    """The larger one of coat and base alone, each divided by its chance."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, passed = coated_probability(m, wo)[:, None], m.passed(wo)[:, None] * (1 - m.coat_weight * m.coat_f0)
    base = sheen_largest_weight(m, cosine) * passed
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.fmax(m.coat_weight / chance, np.where(chance < 1, base / (1 - chance), 0))


def coated_tolerance(m: Coated, wo: Floats, wi: Floats) -> Floats:
    return sheen_tolerance(m, wo, wi) + 4e-7 / (m.coat_alpha * np.linalg.norm(wo + wi, axis=-1))


def coated(name: str, alpha: float, weight: float, coat_alpha: float, f0: float = 0.04) -> Coated:
    m = COOK_TORRANCE[name]
    return Coated(m.diffuse, alpha, m.f0, m.f90, coat_weight=weight, coat_alpha=coat_alpha, coat_f0=f0)


COATED = Model(
    "COATED",
    {
        "lacquer": [coated("plastic", 0.5, 1.0, alpha) for alpha in (1e-3, 0.1, 1.0)],
        "thin": [coated("half metallic", 0.1, 0.3, 0.01, 0.1)],
        "over matte": [coated("lambert", 1.0, 1.0, 0.3)],
        "over a mirror": [coated("gold", 0.0, 1.0, 0.1), coated("gold", 0.0, 0.5, 0.5)],
        "over sheen": [replace(coated("plastic", 0.5, 0.7, 0.3), sheen_color=RED, sheen_roughness=0.5)],
    },
    coated_eval,
    coated_pdf,
    coated_largest_weight,
    {"GEOMETRY_TERM": "GEOMETRY_SMITH"},
    coated_deltas,
    domain=lambda m, wo: Reflections(min(m.alpha or 1.0, m.coat_alpha), wo),
    tolerance=coated_tolerance,
    whitest=[
        coated(name, alpha, weight, coat_alpha, f0)
        for name in ("white dielectric", "white metal")
        for alpha in (0.0, 0.5)
        for weight, f0 in ((1.0, 0.04), (0.5, 0.2))
        for coat_alpha in (1e-3, 0.1, 0.3, 1.0)
    ],
    scene_materials=[
        scene.Material(albedo=(0.8, 0.2, 0.1), roughness=0.6, metallic=0.5, coat=1.0, coat_roughness=0.2),
        scene.Material(albedo=(0.3, 0.5, 0.8), roughness=0.9, coat=0.6, coat_roughness=0.5, coat_ior=1.8),
    ],
)
