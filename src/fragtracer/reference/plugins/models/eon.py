# SPDX-License-Identifier: MIT
"""The energy-preserving Oren-Nayar model (Portsmouth, Kutz, Hill 2025, "EON: A practical energy-preserving rough
diffuse BRDF", JCGT 14:1), with the exact albedo of equation 13."""

from dataclasses import dataclass
from typing import Any

from . import Parameters


@dataclass(frozen=True)
class Lobes:
    """``roughness`` is the root of alpha. Directions are local, on the front."""

    albedo: Any
    roughness: Any

    @classmethod
    def of(cls, p: Parameters) -> "Lobes":
        import drjit as dr

        return cls(p.albedo, dr.sqrt(p.alpha))

    def eval_pdf(self, wo: Any, wi: Any) -> Any:
        """Value f·cos and density."""
        import drjit as dr

        a = 1 / (1 + (1 / 2 - 2 / (3 * dr.pi)) * self.roughness)
        s = dr.dot(wo, wi) - wo.z * wi.z
        t = dr.select(s > 0, dr.maximum(wo.z, wi.z), 1)
        single = self.albedo / dr.pi * a * (1 + self.roughness * s / t)
        mean = a * (1 + (2 / 3 - 28 / (15 * dr.pi)) * self.roughness)
        tint = dr.square(self.albedo) * mean / (1 - self.albedo * (1 - mean))
        lost = (1 - self._single_albedo(a, wo.z)) * (1 - self._single_albedo(a, wi.z)) / dr.maximum(1 - mean, 1e-7)
        return (single + tint / dr.pi * lost) * wi.z, wi.z / dr.pi

    def _single_albedo(self, a: Any, c: Any) -> Any:
        import drjit as dr

        c = dr.clip(c, 1e-3, 1)
        s = dr.safe_sqrt(1 - c * c)
        g = s * (dr.acos(c) - s * c) + 2 / 3 * (s / c * (1 - s**3) - s)
        return a * (1 + self.roughness * g / dr.pi)

    def sample(self, wo: Any, choice: Any, u: Any) -> Any:
        """A direction to the light, f·cos, its density, and that it is neither specular nor a mirror's."""
        import drjit as dr
        import mitsuba as mi

        wi = mi.warp.square_to_cosine_hemisphere(u)
        never = dr.zeros(mi.Bool, dr.width(u))
        return wi, *self.eval_pdf(wo, wi), never, never
