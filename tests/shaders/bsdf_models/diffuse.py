# SPDX-License-Identifier: MIT
"""Lambertian reflection."""

import numpy as np

from .. import bsdf_oracle
from ..bsdf_oracle import Lambert
from .model import WHITE, Model

DIFFUSE = Model(
    "DIFFUSE",
    {
        "grey": [Lambert((0.5, 0.5, 0.5))],
        "coloured": [Lambert((0.8, 0.5, 0.2))],
        "white": [Lambert(WHITE)],
        "black": [Lambert((0.0, 0.0, 0.0))],
    },
    bsdf_oracle.lambert_eval,
    bsdf_oracle.lambert_pdf,
    lambda p, cosine: np.broadcast_to(p.diffuse, (len(cosine), 3)),
    whitest=[Lambert(WHITE)],
    lossless=[Lambert(WHITE)],
)
