# SPDX-License-Identifier: MIT
"""A diffuse base below a smooth dielectric."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Direction
from .model import WHITE, Delta, Model, mirror_image


@dataclass(frozen=True)
class Plastic:
    """Of BSDF_PLASTIC; ``diffuse`` as the shader's BSDF has it."""

    diffuse: Direction
    eta: float


def plastic_of(albedo: Direction, eta: float, nonlinear: bool = True) -> Plastic:
    """A base of that albedo: 1 - internal = (1 - external) / eta², with the means of the Fresnel term over the
    hemisphere."""
    cosine = (np.arange(20000) + 0.5) / 20000
    external = float(np.mean(2 * cosine * bsdf_oracle.fresnel_dielectric(cosine, eta)))
    internal = 1 - (1 - external) / eta**2
    rho = np.asarray(albedo)
    r, g, b = rho / (1 - (rho if nonlinear else 1) * internal) / eta**2
    return Plastic((r, g, b), eta)


def plastic_eval(p: Plastic, wo: Floats, wi: Floats) -> Floats:
    passed = [1 - bsdf_oracle.fresnel_dielectric(w[..., 2], p.eta) for w in (wo, wi)]
    return np.multiply(p.diffuse, (passed[0] * passed[1] * wi[..., 2] / np.pi)[..., None])


def plastic_chance(p: Plastic, wo: Floats) -> Floats:
    """Of the mirror lobe."""
    reflected = bsdf_oracle.fresnel_dielectric(wo[..., 2], p.eta)
    return reflected / (reflected + (1 - reflected) * (np.asarray(p.diffuse) @ bsdf_oracle.REC_709))


def plastic_deltas(p: Plastic, wo: Floats) -> Sequence[Delta]:
    reflected = bsdf_oracle.fresnel_dielectric(wo[..., 2], p.eta)
    return [Delta(mirror_image(wo), reflected[:, None] * np.ones(3), plastic_chance(p, wo))]


def plastic_largest_weight(p: Plastic, cosine: Floats) -> Floats:
    """Of the mirror, and of the base where light enters straight."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, reflected = plastic_chance(p, wo), bsdf_oracle.fresnel_dielectric(wo[:, 2], p.eta)
    with np.errstate(divide="ignore", invalid="ignore"):
        base = np.multiply(p.diffuse, ((1 - reflected) / (1 - chance))[:, None])
        return np.fmax(np.nan_to_num(base), (reflected / chance)[:, None])


PLASTIC = Model(
    "PLASTIC",
    {
        "varnish": [plastic_of((0.6, 0.3, 0.1), 1.5), plastic_of((0.6, 0.3, 0.1), 1.5, False)],
        "white plastic": [plastic_of(WHITE, 1.3), plastic_of(WHITE, 2.0)],
    },
    plastic_eval,
    lambda p, wo, wi: (1 - plastic_chance(p, wo)) * wi[..., 2] / np.pi,
    plastic_largest_weight,
    deltas=plastic_deltas,
    whitest=[plastic_of(WHITE, eta) for eta in (1.01, 1.3, 1.5, 2.5)],
    scene_materials=[
        scene.Material(model="plastic", albedo=(0.8, 0.4, 0.2)),
        scene.Material(model="plastic", albedo=(0.3, 0.5, 0.8), ior=1.8, nonlinear=False),
    ],
)
