# SPDX-License-Identifier: MIT
"""The energy-preserving Oren-Nayar model."""

from dataclasses import dataclass

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Direction
from .model import WHITE, Model


@dataclass(frozen=True)
class Eon:
    """Of BSDF_EON."""

    diffuse: Direction
    alpha: float


def eon_albedo(roughness: float, cosine: Floats) -> Floats:
    """Portsmouth, Kutz and Hill 2025, equations 12 and 13."""
    sine = np.sqrt(1 - cosine**2)
    above = cosine * sine * (1 + sine + sine**2) / (1 + sine)  # sin / cos (1 - sin³)
    g = sine * (np.arccos(cosine) - sine * cosine) + 2 / 3 * (above - sine)
    return (1 + roughness * g / np.pi) / (1 + (1 / 2 - 2 / (3 * np.pi)) * roughness)


def eon_eval(p: Eon, wo: Floats, wi: Floats) -> Floats:
    r, rho = np.sqrt(p.alpha), np.asarray(p.diffuse)
    scale = 1 / (1 + (1 / 2 - 2 / (3 * np.pi)) * r)
    s = (wo * wi).sum(-1) - wo[..., 2] * wi[..., 2]
    single = scale * (1 + r * np.where(s > 0, s / np.maximum(wo[..., 2], wi[..., 2]), s))
    mean = scale * (1 + (2 / 3 - 28 / (15 * np.pi)) * r)
    lost = np.ones(single.shape) * 0
    if r > 0:
        lost = (1 - eon_albedo(r, wo[..., 2])) * (1 - eon_albedo(r, wi[..., 2])) / (1 - mean)
    tint = rho**2 * mean / (1 - rho * (1 - mean))
    return (rho * single[..., None] + tint * lost[..., None]) * wi[..., 2:] / np.pi


def eon_largest_weight(p: Eon, cosine: Floats) -> Floats:
    """What the first lobe can be at most along the horizon, and all of the second."""
    r = np.sqrt(p.alpha)
    weight = 1 + r * np.sqrt(1 - cosine**2) / np.maximum(cosine, 1e-30)
    return np.broadcast_to((weight + 1)[:, None], (len(cosine), 3))


@dataclass(frozen=True)
class EonDomain:
    """The hemisphere, its cells parted where wi is as steep as wo and where it is beside it, which are kinks, and
    crowded towards the first."""

    wo: Direction

    @property
    def _kink(self) -> float:
        """The cosine there; any other where there is none."""
        return self.wo[2] if self.wo[2] < 0.999 else 0.5

    @property
    def _azimuth(self) -> float:
        return float(np.arctan2(self.wo[1], self.wo[0]))

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        x, height = 2 * np.minimum(s, 0.5), np.log(self._kink)
        upper = np.exp(height * x**2)
        cosine = np.where(s < 0.5, upper, self._kink * (2 - 2 * s))
        slope = np.where(s < 0.5, -4 * height * x * upper, 2 * self._kink)
        sine, angle = np.sqrt(1 - cosine**2), self._azimuth + 2 * np.pi * t
        return np.stack([sine * np.cos(angle), sine * np.sin(angle), cosine], -1), 2 * np.pi * slope

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        cosine = np.clip(points[:, 2], 0, 1)
        with np.errstate(divide="ignore"):
            upper = np.sqrt(np.log(cosine) / np.log(self._kink)) / 2
        s = np.where(cosine > self._kink, upper, 1 - cosine / self._kink / 2)
        return np.where(points[:, 2] > 0, s, -1), (np.arctan2(points[:, 1], points[:, 0]) - self._azimuth) / (
            2 * np.pi
        ) % 1


def eon_tolerance(p: Eon, wo: Floats, wi: Floats) -> Floats:
    """1e-4, and what rounding makes of the first lobe where it all but vanishes, opposite the viewer."""
    s = (wo * wi).sum(-1) - wo[..., 2] * wi[..., 2]
    return 1e-4 + 2e-7 / np.maximum(1 + np.sqrt(p.alpha) * np.minimum(s, 0), 1e-7)


EON_ALPHAS = (0.0, 0.01, 0.25, 1.0)
EON = Model(
    "EON",
    {
        "clay": [Eon((0.6, 0.3, 0.15), alpha) for alpha in EON_ALPHAS],
        "white clay": [Eon(WHITE, alpha) for alpha in EON_ALPHAS],
        "black clay": [Eon((0.0, 0.0, 0.0), 1.0)],
    },
    eon_eval,
    bsdf_oracle.lambert_pdf,
    eon_largest_weight,
    domain=lambda _, wo: EonDomain(wo),
    tolerance=eon_tolerance,
    whitest=[Eon(WHITE, alpha) for alpha in EON_ALPHAS],
    lossless=[Eon(WHITE, alpha) for alpha in EON_ALPHAS],
    scene_materials=[
        scene.Material(model="eon", albedo=(0.8, 0.4, 0.2), roughness=1.0),
        scene.Material(model="eon", albedo=(0.3, 0.5, 0.8), roughness=0.4),
    ],
)
