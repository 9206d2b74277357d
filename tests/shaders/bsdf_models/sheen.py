# SPDX-License-Identifier: MIT
"""A sheen over Cook-Torrance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Direction, Filmed
from ..domains import Grazing, Reflections
from .cook_torrance import COOK_TORRANCE, cook_torrance, float32_tolerance
from .model import WHITE, Delta, Model


@dataclass(frozen=True)
class Sheened(Filmed):
    """Of BSDF_SHEEN."""

    sheen_color: Direction = (0.0, 0.0, 0.0)
    sheen_roughness: float = 1.0


def sheen_factors(m: Sheened, wo: Floats, wi: Floats) -> tuple[Floats, Floats]:
    """f |cos_i| of the sheen (..., 3), and the factor of the base (..., 1)."""
    albedos = [bsdf_oracle.sheen_albedo(m.sheen_roughness, w[..., 2:]) for w in (wo, wi)]
    most = np.maximum(*albedos)
    lobe = bsdf_oracle.sheen_lobe(m.sheen_roughness, wo, wi)[..., None]
    return lobe / np.maximum(most, 1) * m.sheen_color, 1 - max(m.sheen_color) * np.minimum(most, 1)


def sheen_shares(m: Sheened, wo: Floats) -> tuple[Floats, Floats]:
    """Estimates of what the sheen and the base reflect (...,)."""
    white = np.minimum(1, bsdf_oracle.sheen_albedo(m.sheen_roughness, wo[..., 2]))
    r = bsdf_oracle.interface_reflectance(m, wo[..., 2])
    base = (r + np.asarray(m.diffuse) * (1 - r) * (1 - np.asarray(m.f0))) @ bsdf_oracle.REC_709
    return white * (m.sheen_color @ bsdf_oracle.REC_709), (1 - max(m.sheen_color) * white) * base


def sheen_probability(m: Sheened, wo: Floats) -> Floats:
    sheen, base = sheen_shares(m, wo)
    return sheen / np.maximum(sheen + base, 1e-300)


def sheen_eval(m: Sheened, wo: Floats, wi: Floats) -> Floats:
    sheen, kept = sheen_factors(m, wo, wi)
    return sheen + kept * cook_torrance("SMITH").value(m, wo, wi)


def sheen_pdf(m: Sheened, wo: Floats, wi: Floats) -> Floats:
    chance = sheen_probability(m, wo)
    return chance / (2 * np.pi) + (1 - chance) * bsdf_oracle.bsdf_pdf(m, wo, wi)


def sheen_deltas(m: Sheened, wo: Floats) -> Sequence[Delta]:
    """Of a mirror below the sheen."""
    return [
        Delta(d.wi, d.value * sheen_factors(m, wo, d.wi)[1], d.chance * (1 - sheen_probability(m, wo)))
        for d in cook_torrance("SMITH").deltas(m, wo)
    ]


def sheen_largest_weight(m: Sheened, cosine: Floats) -> Floats:
    """The larger one of sheen and base alone, each divided by its chance; D is at most (2 + 1 / alpha) / 2 pi."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, o = sheen_probability(m, wo)[:, None], np.maximum(wo[:, 2:], 1e-3)
    masked = 4 * o * (1 + bsdf_oracle.sheen_lambda(m.sheen_roughness, o))
    with np.errstate(divide="ignore", invalid="ignore"):
        sheen = (2 + m.sheen_roughness**-2) / masked * m.sheen_color / chance
        return np.fmax(sheen, np.where(chance < 1, cook_torrance("SMITH").largest_weight(m, cosine) / (1 - chance), 0))


def sheen_tolerance(m: Sheened, wo: Floats, wi: Floats) -> Floats:
    """What the exponent 1 / alpha makes of rounding the half vector."""
    return float32_tolerance(m, wo, wi) + 4e-7 / (m.sheen_roughness**2 * np.linalg.norm(wo + wi, axis=-1))


def sheened(name: str, alpha: float, color: Direction, roughness: float) -> Sheened:
    m = COOK_TORRANCE[name]
    return Sheened(m.diffuse, alpha, m.f0, m.f90, sheen_color=color, sheen_roughness=roughness)


RED = (0.8, 0.2, 0.1)
GRAZING = Grazing()
SHEEN = Model(
    "SHEEN",
    {
        "cloth": [sheened("lambert", 1.0, RED, roughness) for roughness in (0.1, 0.3, 1.0)],
        "over plastic": [sheened("plastic", 0.3, RED, roughness) for roughness in (0.15, 0.6)],
        "over a mirror": [sheened("gold", 0.0, RED, 0.4)],
        "velvet": [Sheened(sheen_color=RED, sheen_roughness=0.5)],
    },
    sheen_eval,
    sheen_pdf,
    sheen_largest_weight,
    {"GEOMETRY_TERM": "GEOMETRY_SMITH"},
    sheen_deltas,
    domain=lambda m, wo: GRAZING if m.alpha in (0.0, 1.0) else Reflections(m.alpha, wo),
    tolerance=sheen_tolerance,
    whitest=[
        replace(m, sheen_color=WHITE, sheen_roughness=roughness)
        for m in (sheened("white dielectric", 0.0, WHITE, 1.0), Sheened(WHITE), sheened("white metal", 0.0, WHITE, 1.0))
        for roughness in (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 0.8, 1.0)
    ],
    scene_materials=[
        scene.Material(albedo=(0.1, 0.02, 0.02), roughness=0.8, sheen_color=RED, sheen_roughness=0.5),
        scene.Material(
            albedo=0.3, metallic=0.5, roughness=0.5, sheen_color=0.9, sheen_roughness=0.2, coat=0.5, coat_roughness=0.3
        ),
    ],
)
