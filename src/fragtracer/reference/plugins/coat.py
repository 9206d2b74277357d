# SPDX-License-Identifier: MIT
"""A clear coat over other lobes: GGX facets of a dielectric, which the light of the lobes passes in and out.

What it keeps from them is estimated as what a rough interface keeps from a diffuse base.
"""

from dataclasses import dataclass
from typing import Any

from .models.metallic_roughness import Lobes, schlick_k

_RANGE = (0.1, 0.9)  # of the probability to choose the coat


@dataclass(frozen=True)
class Coated:
    """``base`` under a coat. Directions are local, on the front of the base.

    The coat has a ``frame`` of its own, within that of the base, where a normal map bends the base alone.
    """

    base: Lobes
    coat: Lobes
    weight: Any
    frame: Any = None

    @classmethod
    def of(cls, base: Lobes, weight: Any, f0: Any, alpha: Any, frame: Any = None) -> "Coated":
        """A coat of the reflectance ``f0`` at normal incidence, its facets of a width ``alpha`` that is no mirror's."""
        import drjit as dr
        import mitsuba as mi

        geometry = "smith" if base.geometry == "smith-multiple-scattering" else base.geometry
        k = schlick_k(geometry, alpha)
        f90 = dr.minimum(50 * f0, 1)  # as scene/reflectance.py has it
        coat = Lobes(mi.Color3f(0), mi.Color3f(f0), mi.Color3f(f90), alpha, geometry, k, specular_range=(1, 1))
        return cls(base, coat, weight, frame)

    def passed(self, w: Any) -> Any:
        """What the coat passes to the base, or back out, along a direction in its own frame."""
        import drjit as dr

        return 1 - self.weight * self.coat.interface(dr.maximum(w.z, 0))

    def coat_probability(self, wo: Any) -> Any:
        """Coat and base are chosen by estimates of what they reflect."""
        import drjit as dr

        o = self._to_coat(wo)
        coat = self.weight * dr.mean(self.coat.fresnel(dr.maximum(o.z, 0)))
        base = dr.mean(self.passed(o)) * sum(self.base.reflected(wo))
        return dr.select(o.z > 0, dr.clip(coat / dr.maximum(coat + base, 1e-8), *_RANGE), 0)

    def eval_pdf(self, wo: Any, wi: Any) -> Any:
        """Value f·cos and density of the smooth lobes."""
        import drjit as dr

        p_coat, o, i = self.coat_probability(wo), self._to_coat(wo), self._to_coat(wi)
        (value, pdf), (coat_value, coat_pdf) = self.base.eval_pdf(wo, wi), self.coat.eval_pdf(o, i)
        above = (o.z > 0) & (i.z > 0)
        value = value * self.passed(o) * self.passed(i) + dr.select(above, self.weight * coat_value, 0)
        return value, (1 - p_coat) * pdf + dr.select(above, p_coat * coat_pdf, 0)

    def sample(self, wo: Any, choice: Any, u: Any) -> Any:
        """As of the base; what the coat reflects is specular, and no mirror's."""
        import drjit as dr

        p_coat, o = self.coat_probability(wo), self._to_coat(wo)
        coated = choice < p_coat
        rest = dr.select(coated, 0, (choice - p_coat) / (1 - p_coat))
        wi, mirrored, p_mirror, specular, mirror = self.base.sample(wo, rest, u)
        reflected, *_ = self.coat.sample(o, 0, u)
        wi = dr.select(coated, self._from_coat(reflected), wi)
        value, pdf = self.eval_pdf(wo, wi)
        mirror &= choice >= p_coat
        value = dr.select(mirror, mirrored * self.passed(o) * self.passed(self._to_coat(wi)), value)
        pdf = dr.select(mirror, (1 - p_coat) * p_mirror, dr.select(coated & (reflected.z <= 0), 0, pdf))
        return wi, value, pdf, specular | coated, mirror

    def _to_coat(self, w: Any) -> Any:
        return w if self.frame is None else self.frame.to_local(w)

    def _from_coat(self, w: Any) -> Any:
        return w if self.frame is None else self.frame.to_world(w)
