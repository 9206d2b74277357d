# SPDX-License-Identifier: MIT
"""Smooth and rough panes."""

from collections.abc import Sequence

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..domains import Sides
from .conductor import Conductor, conductor_pdf, conductor_tolerance
from .dielectric import DIELECTRIC_ALPHAS, Dielectric
from .model import WHITE, Delta, Model, mirror_image


def pane_reflectance(p: Dielectric, cosine: Floats) -> Floats:
    """The sum of all orders of reflection within the pane."""
    once = bsdf_oracle.fresnel_dielectric(cosine, p.eta)
    return once + (1 - once) ** 2 * once / (1 - once**2)


def pane_lobes(p: Dielectric, wo: Floats, wi: Floats) -> tuple[Floats, Floats]:
    """f |cos_i| and density of the facets, as of a conductor above, and below its mirror image."""
    wo, wi = np.broadcast_arrays(wo, wi)
    if p.alpha == 0:
        return np.zeros(wi.shape), np.zeros(wi.shape[:-1])
    reflects, above = wi[..., 2] > 0, wi * np.where(wi[..., 2:] < 0, (1, 1, -1), 1)
    reflected = pane_reflectance(p, np.linalg.norm(wo + above, axis=-1) / 2)
    chance = np.where(reflects, reflected, 1 - reflected)
    pdf = chance * conductor_pdf(Conductor(WHITE, WHITE, p.alpha, p.anisotropy), wo, above)
    value = pdf * bsdf_oracle.facets_g1(p.alpha, p.anisotropy, above)
    return value[..., None] * np.where(reflects[..., None], 1.0, np.asarray(p.transmittance)), pdf


def pane_tolerance(p: Dielectric, wo: Floats, wi: Floats) -> Floats:
    """As of a conductor, and what rounding makes of the little that is transmitted at grazing angles."""
    above = wi * np.where(wi[..., 2:] < 0, (1, 1, -1), 1)
    size = np.linalg.norm(wo + above, axis=-1)
    passed = np.where(wi[..., 2] < 0, 1 - pane_reflectance(p, size / 2), 1.0)
    return conductor_tolerance(Conductor(WHITE, WHITE, p.alpha), wo, above) + 1e-6 / (passed * size)


def pane_deltas(p: Dielectric, wo: Floats) -> Sequence[Delta]:
    if p.alpha > 0:
        return ()
    reflected = pane_reflectance(p, wo[..., 2])
    passed = (1 - reflected)[:, None] * np.asarray(p.transmittance)
    mirror = Delta(mirror_image(wo), reflected[:, None] * np.ones(3), reflected)
    return [mirror, Delta(-wo, passed, 1 - reflected, null=True)]


THIN_DIELECTRIC = Model(
    "THIN_DIELECTRIC",
    {
        "window": [Dielectric(1.5)],
        "green pane": [Dielectric(1.7, transmittance=(0.5, 0.9, 0.6))],
        "frosted pane": [Dielectric(1.5, alpha) for alpha in DIELECTRIC_ALPHAS[1:]],
        "green frosted pane": [Dielectric(1.7, 0.1, (0.5, 0.9, 0.6)), Dielectric(1.7, 0.1, (0.5, 0.9, 0.6), 0.5)],
    },
    lambda p, wo, wi: pane_lobes(p, wo, wi)[0],
    lambda p, wo, wi: pane_lobes(p, wo, wi)[1],
    lambda p, cosine: np.ones((len(cosine), 3)),
    deltas=pane_deltas,
    transmits=True,
    domain=lambda p, wo: Sides(p.alpha, None, wo),
    tolerance=pane_tolerance,
    whitest=[Dielectric(eta, alpha) for eta in (1.1, 2.4) for alpha in (0.0, 1e-3, 0.1, 0.6, 1.0)],
    lossless=[Dielectric(1.5), Dielectric(1.5, 1e-3)],
    scene_materials=[
        scene.Material(model="rough-thin-dielectric", roughness=0.4),
        scene.Material(model="thin-dielectric", ior=2.0, transmittance=(0.5, 0.9, 0.6)),
    ],
)
