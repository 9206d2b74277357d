# SPDX-License-Identifier: MIT
"""A diffuse base below a rough dielectric."""

from dataclasses import dataclass

import numpy as np

from fragtracer import scene
from fragtracer.packing.coats import coat

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Direction
from ..domains import Reflections
from .dielectric import Dielectric, dielectric_lobes
from .model import WHITE, Model


@dataclass(frozen=True)
class RoughPlastic:
    """Of BSDF_ROUGH_PLASTIC; ``diffuse`` and the coefficients of the coat as the shader's BSDF has them."""

    diffuse: Direction
    alpha: float
    eta: float
    coat_facets: tuple[float, ...]
    coat_angles: Direction


def rough_plastic_of(albedo: Direction, alpha: float, eta: float = 1.5, nonlinear: bool = True) -> RoughPlastic:
    """A base of that albedo; test_coats.py holds the coat to its integrals."""
    record = coat(alpha, eta)
    rho = np.asarray(albedo)
    r, g, b = rho / (1 - (rho if nonlinear else 1) * (1 - record["leaving"])) / eta**2
    return RoughPlastic((r, g, b), alpha, eta, tuple(record["facets"]), tuple(record["angles"]))


def rough_plastic_interface(p: RoughPlastic, cosine: Floats) -> tuple[Floats, Floats]:
    """What a smooth coat reflects at the angle to a facet, and what the coat passes."""
    facet = cosine / bsdf_oracle.g1_smith(p.alpha, cosine)
    ratio = p.alpha / facet
    fit = np.polynomial.polynomial.polyval(ratio, [*p.coat_facets, p.coat_angles[0]])
    fit = fit + p.coat_angles[1] * cosine + p.coat_angles[2] * np.sqrt(np.maximum(0, 1 - cosine**2))
    reflected = bsdf_oracle.fresnel_dielectric(facet, p.eta)
    return reflected, (1 - reflected) * fit


def rough_plastic_chance(p: RoughPlastic, wo: Floats) -> Floats:
    """Of the facets."""
    reflected, passed = rough_plastic_interface(p, wo[..., 2])
    return reflected / (reflected + passed * (np.asarray(p.diffuse) @ bsdf_oracle.REC_709))


def rough_plastic_eval(p: RoughPlastic, wo: Floats, wi: Floats) -> Floats:
    facets, _ = dielectric_lobes(Dielectric(p.eta, p.alpha), wo, wi)
    passed = [rough_plastic_interface(p, w[..., 2])[1] for w in (wo, wi)]
    return facets + np.multiply(p.diffuse, (passed[0] * passed[1] * wi[..., 2] / np.pi)[..., None])


def rough_plastic_pdf(p: RoughPlastic, wo: Floats, wi: Floats) -> Floats:
    chance = rough_plastic_chance(p, wo)
    wh = (wo + wi) / np.linalg.norm(wo + wi, axis=-1, keepdims=True)
    facets = bsdf_oracle.visible_normal_pdf(p.alpha, wo, wh) / (4 * (wo * wh).sum(-1))
    return chance * facets + (1 - chance) * wi[..., 2] / np.pi


def rough_plastic_largest_weight(p: RoughPlastic, cosine: Floats) -> Floats:
    """Of facets that reflect all, and of the base where light enters straight."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, passed = rough_plastic_chance(p, wo)[:, None], rough_plastic_interface(p, wo[:, 2])[1][:, None]
    return np.maximum(1 / chance, np.multiply(p.diffuse, passed / (1 - chance)))


def rough_plastic_tolerance(p: RoughPlastic, wo: Floats, wi: Floats) -> Floats:
    """1e-4, and what the distribution makes of rounding the half vector."""
    return 1e-4 + 8e-7 / (p.alpha * np.linalg.norm(wo + wi, axis=-1))


ROUGH_PLASTIC = Model(
    "ROUGH_PLASTIC",
    {
        "satin": [rough_plastic_of((0.6, 0.3, 0.1), alpha) for alpha in (1e-3, 0.05, 0.3, 1.0)],
        "linear satin": [rough_plastic_of((0.6, 0.3, 0.1), 0.3, nonlinear=False)],
        "white satin": [rough_plastic_of(WHITE, 0.1, eta) for eta in (1.3, 2.0)],
    },
    rough_plastic_eval,
    rough_plastic_pdf,
    rough_plastic_largest_weight,
    domain=lambda p, wo: Reflections(p.alpha, wo),
    tolerance=rough_plastic_tolerance,
    whitest=[rough_plastic_of(WHITE, alpha, eta) for eta in (1.1, 1.5, 2.4) for alpha in (0.01, 0.1, 0.4, 1.0)],
    scene_materials=[
        scene.Material(model="rough-plastic", albedo=(0.8, 0.4, 0.2), roughness=0.3),
        scene.Material(model="rough-plastic", albedo=(0.3, 0.5, 0.8), roughness=0.7, ior=1.8, nonlinear=False),
    ],
)
