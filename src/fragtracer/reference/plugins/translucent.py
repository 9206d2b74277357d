# SPDX-License-Identifier: MIT
"""A base that transmits a part of the light diffusely (glTF's ``KHR_materials_diffuse_transmission``).

The interface of the lobes keeps as much from what is transmitted as from what their base reflects.
"""

from dataclasses import dataclass, replace
from typing import Any

from .models.metallic_roughness import Lobes

_RANGE = (0.05, 0.95)  # of the probability to choose transmission


@dataclass(frozen=True)
class Translucent:
    """Lobes whose ``base`` reflects what it does not transmit, by an ``albedo``. Directions are local, the viewer's on
    the front, and light that is transmitted below."""

    base: Lobes
    albedo: Any

    @classmethod
    def of(cls, base: Lobes, factor: Any, albedo: Any) -> "Translucent":
        """A share ``factor`` of the base transmits by ``albedo``."""
        return cls(replace(base, albedo=(1 - factor) * base.albedo), factor * albedo)

    @property
    def geometry(self) -> str:
        return self.base.geometry

    def _probability(self, wo: Any) -> Any:
        import drjit as dr

        specular, reflected = self.base.reflected(wo)
        transmitted = dr.mean(self.albedo) * (1 - specular)
        return dr.clip(transmitted / dr.maximum(specular + reflected + transmitted, 1e-8), *_RANGE)

    def eval_pdf(self, wo: Any, wi: Any) -> Any:
        """Value f·cos and density of the smooth lobes, on both sides."""
        import drjit as dr
        import mitsuba as mi

        p, below = self._probability(wo), wi.z < 0
        up = mi.Vector3f(wi.x, wi.y, dr.abs(wi.z))
        value, pdf = self.base.eval_pdf(wo, up)
        passed = (1 - self.base.interface(wo.z)) * (1 - self.base.interface(up.z))
        cosine = up.z / dr.pi
        return dr.select(below, self.albedo * passed * cosine, value), dr.select(below, p * cosine, (1 - p) * pdf)

    def sample(self, wo: Any, choice: Any, u: Any) -> Any:
        """As of the base; what is transmitted is diffuse."""
        import drjit as dr
        import mitsuba as mi

        p = self._probability(wo)
        passes = choice < p
        rest = dr.select(passes, 0, (choice - p) / (1 - p))
        above, mirrored, p_mirror, specular, mirror = self.base.sample(wo, rest, u)
        wi = dr.select(passes, -mi.warp.square_to_cosine_hemisphere(u), above)
        value, pdf = self.eval_pdf(wo, wi)
        pdf = dr.select(passes | (above.z > 0), pdf, 0)  # what facets reflect down is not transmitted
        mirror &= choice >= p
        value = dr.select(mirror, mirrored, value)
        return wi, value, dr.select(mirror, (1 - p) * p_mirror, pdf), specular & (choice >= p), mirror
