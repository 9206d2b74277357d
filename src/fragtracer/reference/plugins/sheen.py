# SPDX-License-Identifier: MIT
"""The sheen of cloth over other lobes (Estevez and Kulla 2017, "Production friendly microfacet sheen BRDF").

Where the directional albedo of their lobe is more than 1, at one of both angles, the lobe is divided by it; the lobes
below are scaled by what the brightest colour of the sheen then leaves (docs/material.md).
"""

from dataclasses import dataclass
from typing import Any

_LEAST_ROUGHNESS, _LEAST_COSINE = 0.1, 1e-3
# Their fit of ln Lambda: a / (1 + b x^c) + d x + e, of alpha = 0 and of 1.
_SHARP = (25.3245, 3.32435, 0.16801, -1.27393, -4.85967)
_WIDE = (21.5473, 3.82987, 0.19823, -1.97760, -4.32054)
# ln of 4 cos (1 + Lambda) times the directional albedo: a row for each power of the root of the cosine, in it the
# coefficients of 1, ln r, r and 1 / r of the roughness r (docs/material.md).
_ALBEDO = (
    (0.1183, -1.1427, 0.8352, -0.002),
    (0.9044, 0.0743, -1.1209, -0.2244),
    (-3.5838, 4.8836, 1.4523, 0.3529),
    (1.8672, -16.8722, 4.0374, -3.5829),
    (3.3552, 15.1436, -7.1205, 2.3312),
)
_RANGE = (0.1, 0.9)  # of the probability to choose the sheen


@dataclass(frozen=True)
class Sheened:
    """``base`` under a sheen of a ``color``. Directions are local, on the front."""

    base: Any
    color: Any
    roughness: Any

    @property
    def geometry(self) -> str:
        return str(self.base.geometry)

    @property
    def _r(self) -> Any:
        import drjit as dr

        return dr.maximum(self.roughness, _LEAST_ROUGHNESS)

    def _lambda(self, cosine: Any) -> Any:
        """Of masking, by their fit, which is mirrored at a cosine of 1/2."""
        import drjit as dr

        near = dr.square(1 - dr.square(self._r))
        a, b, c, d, e = (wide + (sharp - wide) * near for sharp, wide in zip(_SHARP, _WIDE, strict=True))

        def log(x: Any) -> Any:
            return a / (1 + b * dr.power(x, c)) + d * x + e

        upper = 2 * log(0.5) - log(dr.maximum(1 - cosine, 0))
        return dr.exp(dr.select(cosine < 0.5, log(cosine), upper))

    def albedo(self, cosine: Any) -> Any:
        """What a white lobe would reflect of light from all around, at a cosine."""
        import drjit as dr

        cosine, r = dr.maximum(cosine, _LEAST_COSINE), self._r
        rows = [one + log * dr.log(r) + linear * r + inverse / r for one, log, linear, inverse in _ALBEDO]
        exponent = sum(row * dr.sqrt(cosine) ** i for i, row in enumerate(rows))
        return dr.exp(exponent) / (4 * cosine * (1 + self._lambda(cosine)))

    def _factors(self, wo: Any, wi: Any) -> Any:
        """f cos of white sheen, and the factor of the base."""
        import drjit as dr

        alpha = dr.square(self._r)
        o, i = dr.maximum(wo.z, _LEAST_COSINE), dr.maximum(wi.z, _LEAST_COSINE)
        wh = dr.normalize(wo + wi)
        sine = dr.sqrt(dr.square(wh.x) + dr.square(wh.y))
        d = (2 + 1 / alpha) * dr.power(sine, 1 / alpha) / (2 * dr.pi)
        v = 1 / ((1 + self._lambda(o) + self._lambda(i)) * 4 * o * i)
        most = dr.maximum(self.albedo(o), self.albedo(i))
        return d * v * wi.z / dr.maximum(most, 1), 1 - dr.max(self.color) * dr.minimum(most, 1)

    def reflected(self, wo: Any) -> tuple[Any, ...]:
        """Estimates of what the sheen and the lobes of the base reflect."""
        import drjit as dr

        albedo = dr.minimum(self.albedo(wo.z), 1)
        kept = 1 - dr.max(self.color) * albedo
        return (dr.mean(self.color) * albedo, *(kept * part for part in self.base.reflected(wo)))

    def _probability(self, wo: Any) -> Any:
        import drjit as dr

        sheen, *base = self.reflected(wo)
        return dr.clip(sheen / dr.maximum(sheen + sum(base), 1e-8), *_RANGE)

    def eval_pdf(self, wo: Any, wi: Any) -> Any:
        """Value f·cos and density of the smooth lobes; the sheen is sampled uniformly."""
        import drjit as dr

        p, (value, pdf), (sheen, kept) = self._probability(wo), self.base.eval_pdf(wo, wi), self._factors(wo, wi)
        return sheen * self.color + kept * value, p / (2 * dr.pi) + (1 - p) * pdf

    def sample(self, wo: Any, choice: Any, u: Any) -> Any:
        """As of the base; what the sheen reflects is diffuse."""
        import drjit as dr
        import mitsuba as mi

        p = self._probability(wo)
        is_sheen = choice < p
        rest = dr.select(is_sheen, 0, (choice - p) / (1 - p))
        below, mirrored, p_mirror, specular, mirror = self.base.sample(wo, rest, u)
        wi = dr.select(is_sheen, mi.warp.square_to_uniform_hemisphere(u), below)
        value, pdf = self.eval_pdf(wo, wi)
        mirror &= ~is_sheen
        value = dr.select(mirror, mirrored * self._factors(wo, wi)[1], value)
        return wi, value, dr.select(mirror, (1 - p) * p_mirror, pdf), specular & ~is_sheen, mirror
