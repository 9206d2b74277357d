# SPDX-License-Identifier: MIT
"""Cook-Torrance over a base that transmits diffusely."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Direction, Material
from ..domains import Sides
from .cook_torrance import COOK_TORRANCE, cook_torrance, float32_tolerance, white_materials
from .model import WHITE, Delta, Model


@dataclass(frozen=True)
class Translucent(Material):
    """Of BSDF_TRANSLUCENT; ``diffuse`` is what its base does not transmit."""

    transmitted: Direction = WHITE


def translucent(name: str, alpha: float, factor: float, color: Direction = WHITE) -> Translucent:
    """Of the material of this ``name``, with white or black in the place of its base's share of it."""
    m = COOK_TORRANCE[name]
    diffuse, transmitted = ((1 - factor) * np.array(m.diffuse), factor * np.array(color) * (max(m.diffuse) > 0))
    return Translucent(tuple(diffuse), alpha, m.f0, m.f90, tuple(transmitted))


def raised(wi: Floats) -> Floats:
    """Directions, and the mirror images of those below the surface."""
    return wi * np.where(wi[..., 2:] < 0, (1, 1, -1), 1)


def translucent_probability(m: Translucent, wo: Floats) -> Floats:
    """How often transmission is sampled."""
    r = bsdf_oracle.interface_reflectance(m, wo[..., 2])
    base = (1 - r) * (1 - np.asarray(m.f0))
    reflected, transmitted = ((part @ bsdf_oracle.REC_709) for part in (r + m.diffuse * base, m.transmitted * base))
    return transmitted / np.maximum(reflected + transmitted, 1e-300)


def translucent_eval(m: Translucent, wo: Floats, wi: Floats) -> Floats:
    """That of the reflecting base, and below its mirror image in another colour."""
    reflected = cook_torrance("SMITH").value(m, wo, raised(wi))
    transmitted = bsdf_oracle.bsdf_eval_diffuse(replace(m, diffuse=m.transmitted), wo, raised(wi))
    return np.where(wi[..., 2:] < 0, transmitted, reflected)


def translucent_pdf(m: Translucent, wo: Floats, wi: Floats) -> Floats:
    chance = translucent_probability(m, wo)
    reflected = (1 - chance) * bsdf_oracle.bsdf_pdf(m, wo, raised(wi))
    return np.where(wi[..., 2] < 0, -chance * wi[..., 2] / np.pi, reflected)


def translucent_deltas(m: Translucent, wo: Floats) -> Sequence[Delta]:
    """Of a mirror over the base."""
    kept = 1 - translucent_probability(m, wo)
    return [replace(d, chance=d.chance * kept) for d in cook_torrance("SMITH").deltas(m, wo)]


def translucent_largest_weight(m: Translucent, cosine: Floats) -> Floats:
    """The larger one of what is transmitted and what is reflected alone, each divided by its chance."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, passed = translucent_probability(m, wo)[:, None], 1 - bsdf_oracle.interface_reflectance(m, wo[:, 2])
    with np.errstate(divide="ignore", invalid="ignore"):
        reflected = np.where(chance < 1, cook_torrance("SMITH").largest_weight(m, cosine) / (1 - chance), 0)
        return np.fmax(np.where(chance > 0, m.transmitted * passed / chance, 0), reflected)


TRANSLUCENT = Model(
    "TRANSLUCENT",
    {
        "leaf": [translucent("plastic", alpha, 0.4, (0.5, 0.8, 0.1)) for alpha in (0.1, 0.5, 1.0)],
        "paper": [translucent("lambert", 1.0, factor, (0.9, 0.8, 0.6)) for factor in (0.5, 1.0)],
        "half metallic": [translucent("half metallic", 0.3, 0.6, (0.4, 0.3, 0.5))],
        "glossy": [translucent("plastic", 0.0, 0.5, (0.2, 0.5, 0.8)), translucent("diamond", 0.0, 1.0)],
        "black": [Translucent(transmitted=(0.0, 0.0, 0.0))],
    },
    translucent_eval,
    translucent_pdf,
    translucent_largest_weight,
    {"GEOMETRY_TERM": "GEOMETRY_SMITH"},
    translucent_deltas,
    transmits=True,
    domain=lambda m, wo: Sides(m.alpha, None, wo),
    tolerance=lambda m, wo, wi: float32_tolerance(m, wo, raised(wi)),
    whitest=[
        Translucent(tuple(kept), alpha, m.f0, m.f90, tuple(passed))
        for m in white_materials()[::3]
        for factor in (0.4, 1.0)
        for kept, passed in [((1 - factor) * np.array(m.diffuse), factor * np.array(m.diffuse))]
        for alpha in (0.0, 0.1, 1.0)
    ],
    lossless=[Translucent((1 - share,) * 3, transmitted=(share,) * 3) for share in (0.3, 1.0)],
    scene_materials=[
        scene.Material(
            albedo=(0.2, 0.5, 0.1), roughness=0.4, diffuse_transmission=0.5, diffuse_transmission_color=(0.6, 0.9, 0.2)
        ),
        scene.Material(
            albedo=0.8,
            roughness=0.0,
            metallic=0.2,
            diffuse_transmission=0.8,
            diffuse_transmission_color=(0.9, 0.7, 0.5),
        ),
    ],
)
