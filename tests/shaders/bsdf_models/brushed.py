# SPDX-License-Identifier: MIT
"""Cook-Torrance with anisotropic facets."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Material
from .conductor import BRUSHED, Conductor, conductor_pdf
from .cook_torrance import COOK_TORRANCE, cook_torrance
from .model import WHITE, Model, no_delta


@dataclass(frozen=True)
class Brushed(Material):
    """With facets of two widths."""

    anisotropy: float = 0.5


def brushed_eval(m: Brushed, term: str, wo: Floats, wi: Floats) -> Floats:
    """The specular lobe with the width along each direction in the term of masking and shadowing."""
    wh = (wo + wi) / np.linalg.norm(wo + wi, axis=-1, keepdims=True)
    one, other = (bsdf_oracle.g1(term, bsdf_oracle.width_along(m.alpha, m.anisotropy, w), w[..., 2]) for w in (wo, wi))
    masking = 1 / (1 / one + 1 / other - 1) if term == "SMITH_HEIGHT_CORRELATED" else one * other
    d = bsdf_oracle.facets_d(m.alpha, m.anisotropy, wh) / (4 * wo[..., 2])
    fresnel = bsdf_oracle.fresnel(m.f0, m.f90, (wo * wh).sum(-1))
    return bsdf_oracle.bsdf_eval_diffuse(m, wo, wi, term) + fresnel * (d * masking)[..., None]


def brushed_pdf(m: Brushed, wo: Floats, wi: Floats, term: str) -> Floats:
    facets = conductor_pdf(Conductor(WHITE, WHITE, m.alpha, m.anisotropy), wo, wi)
    chance = bsdf_oracle.specular_probability(m, wo, term)
    return chance * facets + (1 - chance) * wi[..., 2] / np.pi


def brushed(term: str) -> Model:
    model = cook_torrance(term)
    some = {
        name: [Brushed(m.diffuse, alpha, m.f0, m.f90, anisotropy) for alpha, anisotropy in BRUSHED]
        for name, m in COOK_TORRANCE.items()
        if name in ("plastic", "gold")
    }
    white = [COOK_TORRANCE[name] for name in ("white dielectric", "white metal")] if "SMITH" in term else []

    def largest_weight(m: Brushed, cosine: Floats) -> Floats:
        return np.fmax(model.largest_weight(m, cosine), model.largest_weight(replace(m, alpha=1.0), cosine))

    return replace(
        model,
        materials=some,
        value=lambda m, wo, wi: brushed_eval(m, term, wo, wi),
        pdf=partial(brushed_pdf, term=term),
        largest_weight=largest_weight,
        deltas=no_delta,
        whitest=[Brushed(m.diffuse, alpha, m.f0, m.f90, by) for m in white for alpha, by in BRUSHED],
        lossless=[],
        scene_materials=[
            scene.Material(albedo=(0.8, 0.5, 0.3), roughness=0.4, anisotropy=0.8),
            scene.Material(
                model="conductor", metal="gold", roughness=0.3, anisotropy=0.7, anisotropy_rotation_degrees=90.0
            ),
        ]
        if term == "SMITH"
        else [],
    )
