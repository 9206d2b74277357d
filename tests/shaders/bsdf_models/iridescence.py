# SPDX-License-Identifier: MIT
"""Cook-Torrance below a thin film."""

from dataclasses import replace

import numpy as np

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Filmed
from .cook_torrance import COOK_TORRANCE, cook_torrance, float32_tolerance
from .model import WHITE


def filmed(name: str, alpha: float, iridescence: float = 1.0, ior: float = 1.3, thickness: float = 400.0) -> Filmed:
    m = COOK_TORRANCE[name]
    return Filmed(m.diffuse, alpha, m.f0, m.f90, iridescence, ior, thickness)


def iridescent_tolerance(m: Filmed, wo: Floats, wi: Floats) -> Floats:
    """As without, and what rounding makes of what the film leaves small, reflected or passed to the base."""
    facets = bsdf_oracle.facet_fresnel(m, np.linalg.norm(wo + wi, axis=-1) / 2)
    there, back = (bsdf_oracle.interface_reflectance(m, w[..., 2]) for w in (wo, wi))
    reflected = np.minimum(facets, there).min(axis=-1)
    passed = [(1 - r).min(axis=-1) for r in (there, back)]
    rounding = 1e-6 / np.maximum(reflected, 1e-30) + sum(4e-6 / np.maximum(p, 1e-30) for p in passed)
    return float32_tolerance(m, wo, wi) + rounding


# Interfaces of all contrasts under films of all thicknesses, white below.
SOME_F0 = [(0.0, 0.001, 0.02), (0.04, 0.17, 0.5)]
IRIDESCENT = replace(
    cook_torrance("SMITH"),
    materials={
        "oil": [filmed("plastic", alpha, thickness=350.0) for alpha in (0.0, 0.1, 0.5)],
        "oxide": [filmed("gold", alpha, 0.7, 2.4, 120.0) for alpha in (0.0, 0.01, 1.0)],
        "soap": [Filmed((0.8, 0.5, 0.2), alpha, iridescence=1.0, iridescence_thickness=120.0) for alpha in (0.0, 0.3)],
    },
    features={"GEOMETRY_TERM": "GEOMETRY_SMITH", "HAS_EXACT_FRESNEL": 1},
    tolerance=iridescent_tolerance,
    whitest=[
        Filmed(WHITE, alpha, f0, tuple(min(1, 50 * f) for f in f0), 1.0, ior, thickness)
        for f0 in SOME_F0
        for ior, thickness in ((1.1, 1200.0), (1.3, 200.0), (1.3, 500.0), (1.6, 400.0), (2.1, 330.0), (2.5, 100.0))
        for alpha in (0.0, 0.03, 0.1, 0.3, 0.6, 1.0)
    ],
    lossless=[],
    scene_materials=[],  # test_reference_meshes.py compares one
)
