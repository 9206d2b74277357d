# SPDX-License-Identifier: MIT
"""Smooth and rough dielectric interfaces."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Direction
from ..domains import Sides
from .model import WHITE, Delta, Model, mirror_image, no_slack


@dataclass(frozen=True)
class Dielectric:
    """Of BSDF_DIELECTRIC and BSDF_THIN_DIELECTRIC."""

    eta: float
    alpha: float = 0.0
    transmittance: Direction = WHITE
    anisotropy: float = 0.0


def dielectric_lobes(p: Dielectric, wo: Floats, wi: Floats) -> tuple[Floats, Floats]:
    """f |cos_i| and density of the facets (Walter et al. 2007, equations 20, 21, 13, 14, 16 and 17); of transmitted
    radiance."""
    wo, wi = np.broadcast_arrays(wo, wi)
    if p.alpha == 0:
        return np.zeros(wi.shape), np.zeros(wi.shape[:-1])
    reflects = wi[..., 2] > 0
    wh = dielectric_half(p, wo, wi)
    co, ci = (wo * wh).sum(-1), (wi * wh).sum(-1)
    faces = (co > 0) & ((ci > 0) == reflects)
    fresnel = bsdf_oracle.fresnel_dielectric(np.abs(co), p.eta)
    d = bsdf_oracle.facets_d(p.alpha, p.anisotropy, wh) * faces
    g1o, g1i = (bsdf_oracle.facets_g1(p.alpha, p.anisotropy, w) for w in (wo, wi))
    with np.errstate(divide="ignore", invalid="ignore"):
        reflected = fresnel * d * g1o / (4 * wo[..., 2])
        transmitted = (1 - fresnel) * d * g1o * np.abs(co * ci) * p.eta**2 / (wo[..., 2] * (co + p.eta * ci) ** 2)
    pdf = np.where(reflects, reflected, np.where(faces, transmitted, 0.0))
    value = (pdf * g1i)[..., None] * np.where(reflects[..., None], 1.0, np.asarray(p.transmittance) / p.eta**2)
    return value, pdf


def dielectric_half(p: Dielectric, wo: Floats, wi: Floats) -> Floats:
    wh = wo + np.where(wi[..., 2:] > 0, 1.0, p.eta) * wi
    wh = wh / np.linalg.norm(wh, axis=-1, keepdims=True)
    return wh * np.where(wh[..., 2:] < 0, -1.0, 1.0)


def dielectric_deltas(p: Dielectric, wo: Floats) -> Sequence[Delta]:
    if p.alpha > 0:
        return ()
    reflected = bsdf_oracle.fresnel_dielectric(wo[..., 2], p.eta)
    sine2 = (1 - wo[..., 2] ** 2) / p.eta**2
    refracted = np.column_stack([-wo[..., :2] / p.eta, -np.sqrt(np.maximum(1 - sine2, 0))])
    passed = (1 - reflected)[:, None] * np.asarray(p.transmittance) / p.eta**2
    mirror = Delta(mirror_image(wo), reflected[:, None] * np.ones(3), reflected)
    return [mirror, Delta(refracted, passed, 1 - reflected, p.eta)] if (reflected < 1).all() else [mirror]


def dielectric_tolerance(p: Dielectric, wo: Floats, wi: Floats) -> Floats:
    """1e-4, what the distribution makes of rounding the half vector, and what rounding makes of the Fresnel term close
    to the critical angle."""
    if p.alpha == 0:
        return no_slack(p, wo, wi)
    half = np.linalg.norm(wo + np.where(wi[..., 2:] > 0, 1.0, p.eta) * wi, axis=-1)
    cosine = (wo * dielectric_half(p, wo, wi)).sum(-1)
    beyond = np.abs(1 - (1 - cosine**2) / p.eta**2)
    slip = 3e-7 / min(1.0, p.eta**2)
    fresnel = 4 * np.minimum(slip / np.sqrt(np.maximum(beyond, 1e-30)), np.sqrt(slip))
    passed = np.where(wi[..., 2] < 0, slip / np.maximum(beyond, 1e-30), 0.0)
    return 1e-4 + 8e-7 / (p.alpha * half) + 4e-7 / np.maximum(np.abs(cosine), 1e-30) + fresnel + passed


DIELECTRIC_ALPHAS = (0.0, 1e-3, 0.05, 0.3, 1.0)
DIELECTRIC = Model(
    "DIELECTRIC",
    {
        "glass": [Dielectric(1.5, alpha) for alpha in DIELECTRIC_ALPHAS],
        "glass from within": [Dielectric(1 / 1.5, alpha) for alpha in DIELECTRIC_ALPHAS],
        "red glass": [Dielectric(1.9, alpha, (0.9, 0.2, 0.1)) for alpha in (0.0, 0.3)],
        "brushed glass": [Dielectric(eta, 0.1, anisotropy=0.5) for eta in (1.5, 1 / 1.5)],
    },
    lambda p, wo, wi: dielectric_lobes(p, wo, wi)[0],
    lambda p, wo, wi: dielectric_lobes(p, wo, wi)[1],
    lambda p, cosine: np.full((len(cosine), 3), max(1.0, p.eta**-2)),
    deltas=dielectric_deltas,
    transmits=True,
    refracts=True,
    domain=lambda p, wo: Sides(p.alpha, p.eta, wo),
    tolerance=dielectric_tolerance,
    whitest=[Dielectric(eta, alpha) for eta in (1.1, 1.5, 2.4, 1 / 1.5) for alpha in (0.0, 1e-3, 0.1, 0.3, 0.6, 1.0)],
    lossless=[Dielectric(1.5), Dielectric(1 / 1.5), Dielectric(1.5, 1e-3)],
    scene_materials=[
        scene.Material(model="dielectric", roughness=0.5, attenuation_color=(0.9, 0.5, 0.3)),
        scene.Material(model="dielectric", roughness=0.0, ior=1.33, transmittance=(0.7, 0.9, 1.0)),
    ],
)
