# SPDX-License-Identifier: MIT
"""Smooth and rough conductors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fragtracer import scene
from fragtracer.scene.reflectance import METAL_INDEX

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Direction
from ..domains import Reflections
from .model import Delta, Model, mirror_image


@dataclass(frozen=True)
class Conductor:
    """Of BSDF_CONDUCTOR."""

    index: Direction
    extinction: Direction
    alpha: float
    anisotropy: float = 0.0


def conductor_pdf(p: Conductor, wo: Floats, wi: Floats) -> Floats:
    wh = wo + wi
    wh = wh / np.linalg.norm(wh, axis=-1, keepdims=True)
    if p.alpha == 0:
        return np.zeros(wh.shape[:-1])
    facets = p.alpha, p.anisotropy
    return bsdf_oracle.facets_d(*facets, wh) * bsdf_oracle.facets_g1(*facets, wo) / (4 * wo[..., 2])


def conductor_eval(p: Conductor, wo: Floats, wi: Floats) -> Floats:
    """F D G1(wo) G1(wi) / (4 cos_o)."""
    cosine = np.linalg.norm(wo + wi, axis=-1) / 2
    shadowed = conductor_pdf(p, wo, wi) * bsdf_oracle.facets_g1(p.alpha, p.anisotropy, wi)
    return bsdf_oracle.fresnel_conductor(cosine, p.index, p.extinction) * shadowed[..., None]


def conductor_deltas(p: Conductor, wo: Floats) -> Sequence[Delta]:
    mirrored = bsdf_oracle.fresnel_conductor(wo[..., 2], p.index, p.extinction)
    return () if p.alpha > 0 else [Delta(mirror_image(wo), mirrored, np.ones(len(wo)))]


def conductor_tolerance(p: Conductor, wo: Floats, wi: Floats) -> Floats:
    return 1e-4 + 4e-7 / (p.alpha or 1.0) / np.linalg.norm(wo + wi, axis=-1)


# Width across the tangent, and anisotropy.
BRUSHED = ((0.05, 0.4), (0.3, 0.8))
CONDUCTORS = {
    "measured gold": METAL_INDEX["gold"],
    "all but lossless": ((2e-3, 2e-3, 2e-3), (10.0, 10.0, 10.0)),
    "barely a metal": ((1.0, 1.5, 3.0), (0.5, 0.1, 1.0)),
}
CONDUCTOR = Model(
    "CONDUCTOR",
    {name: [Conductor(*index, alpha) for alpha in (0.0, 1e-2, 0.3, 1.0)] for name, index in CONDUCTORS.items()}
    | {"brushed gold": [Conductor(*METAL_INDEX["gold"], *facets) for facets in BRUSHED]},
    conductor_eval,
    conductor_pdf,
    lambda p, cosine: np.ones((len(cosine), 3)),
    deltas=conductor_deltas,
    domain=lambda p, wo: Reflections(p.alpha or 1.0, wo),
    tolerance=conductor_tolerance,
    whitest=[Conductor(*CONDUCTORS["all but lossless"], alpha) for alpha in (0.0, 1e-2, 0.1, 0.5, 1.0)]
    + [Conductor(*CONDUCTORS["all but lossless"], *facets) for facets in BRUSHED],
    lossless=[Conductor(*CONDUCTORS["all but lossless"], alpha) for alpha in (0.0, 1e-3)],
    scene_materials=[
        scene.Material(model="conductor", metal="gold", roughness=0.3),
        scene.Material(model="conductor", eta=(1.5, 1.0, 0.5), k=(2.0, 3.0, 4.0), roughness=0.0),
    ],
)
