# SPDX-License-Identifier: MIT
"""A clear coat over other lobes: GGX facets of a dielectric, which the light of the lobes passes in and out.

What it keeps from them is estimated as what a rough interface keeps from a diffuse base.
"""

from dataclasses import dataclass
from typing import Any

from .models.metallic_roughness import Lobes, schlick_k

_RANGE = (0.1, 0.9)  # of the probability to choose the coat


def shadowing(front: Any, wi: Any) -> Any:
    """Shadow terminator factor of ``wi`` for the geometric normal ``front``, both in the shading frame (Chiang, Li and
    Burley 2019, "Taming the shadow terminator", eq. 3). What is transmitted has none, but by both normals."""
    import drjit as dr
    import mitsuba as mi

    cosine = dr.dot(front, wi)
    g = dr.minimum(1, cosine / dr.maximum(wi.z * front.z, 1e-20))
    passed = dr.select((cosine < 0) & (wi.z < 0), mi.Float(1), 0)
    return dr.select((cosine > 0) & (wi.z > 0), g + g * g - g**3, passed)


@dataclass(frozen=True)
class Coated:
    """``base`` under a coat. Directions are local to the coat.

    The base has a ``frame`` of its own, within that of the coat, where a normal map bends the base alone. Where there
    is a geometric normal ``front``, in the frame of the coat, values count the shadow terminators of both.
    """

    base: Lobes
    coat: Lobes
    weight: Any
    frame: Any = None
    front: Any = None

    @classmethod
    def of(cls, base: Lobes, weight: Any, f0: Any, alpha: Any, frame: Any = None, front: Any = None) -> "Coated":
        """A coat of the reflectance ``f0`` at normal incidence, its facets of a width ``alpha`` that is no mirror's."""
        import drjit as dr
        import mitsuba as mi

        geometry = "smith" if base.geometry == "smith-multiple-scattering" else base.geometry
        k = schlick_k(geometry, alpha)
        f90 = dr.minimum(50 * f0, 1)  # as scene/reflectance.py has it
        coat = Lobes(mi.Color3f(0), mi.Color3f(f0), mi.Color3f(f90), alpha, geometry, k, specular_range=(1, 1))
        return cls(base, coat, weight, frame, front)

    def passed(self, w: Any) -> Any:
        """What the coat passes to the base, or back out."""
        import drjit as dr

        return 1 - self.weight * self.coat.interface(dr.maximum(w.z, 0))

    def coat_probability(self, wo: Any) -> Any:
        """Coat and base are chosen by estimates of what they reflect."""
        import drjit as dr

        coat = self.weight * dr.mean(self.coat.fresnel(dr.maximum(wo.z, 0)))
        base = dr.mean(self.passed(wo)) * sum(self.base.reflected(self._to_base(wo)))
        return dr.clip(coat / dr.maximum(coat + base, 1e-8), *_RANGE)

    def eval_pdf(self, wo: Any, wi: Any) -> Any:
        """Value f·cos and density of the smooth lobes."""
        import drjit as dr

        p_coat, o, i = self.coat_probability(wo), self._to_base(wo), self._to_base(wi)
        (value, pdf), (coat_value, coat_pdf) = self.base.eval_pdf(o, i), self.coat.eval_pdf(wo, wi)
        lit = (o.z > 0) & (i.z > 0)
        value = dr.select(lit, value * self._base_share(wo, wi), 0) + self.weight * coat_value * self._lit(wi)
        return value, dr.select(lit, (1 - p_coat) * pdf, 0) + p_coat * coat_pdf

    def sample(self, wo: Any, choice: Any, u: Any) -> Any:
        """As of the base; what the coat reflects is specular, and no mirror's."""
        import drjit as dr

        p_coat, o = self.coat_probability(wo), self._to_base(wo)
        coated = choice < p_coat
        rest = dr.select(coated, 0, (choice - p_coat) / (1 - p_coat))
        below, mirrored, p_mirror, specular, mirror = self.base.sample(o, rest, u)
        reflected, *_ = self.coat.sample(wo, 0, u)
        wi = dr.select(coated, reflected, below if self.frame is None else self.frame.to_world(below))
        value, pdf = self.eval_pdf(wo, wi)
        mirror &= choice >= p_coat
        value = dr.select(mirror, mirrored * self._base_share(wo, wi), value)
        pdf = dr.select(mirror, (1 - p_coat) * p_mirror, dr.select(coated | ((o.z > 0) & (below.z > 0)), pdf, 0))
        return wi, value, pdf, specular | coated, mirror

    def _base_share(self, wo: Any, wi: Any) -> Any:
        share = self.passed(wo) * self.passed(wi)
        if self.front is None:
            return share
        return share * shadowing(self._to_base(self.front), self._to_base(wi))

    def _lit(self, wi: Any) -> Any:
        return 1 if self.front is None else shadowing(self.front, wi)

    def _to_base(self, w: Any) -> Any:
        return w if self.frame is None else self.frame.to_local(w)
