# SPDX-License-Identifier: MIT
"""fragtracer's material for Mitsuba 3: the lobes, from their formulas, for one material or many at once.

In this folder ``wo`` points to the viewer and ``wi`` to the light, as everywhere in fragtracer;
Mitsuba's names are the other way round and are swapped in the plugins' public methods.

References
----------
- Trowbridge, Reitz 1975, "Average irregularity representation of a rough surface"; in its
  microfacet form: Walter et al. 2007, "Microfacet models for refraction", eq. 33 and 34 (D, G1).
- Heitz 2014, "Understanding the masking-shadowing function in microfacet-based BRDFs", eq. 99.
- Schlick 1994, "An inexpensive BRDF model for physically-based rendering", eq. 15 (F), 19 (G).
- Karis 2013, "Real shading in Unreal Engine 4", eq. 4 (k of the analytic lights).
- Turquin 2019, "Practical multiple scattering compensation for microfacet models".
- Dupuy, Benyoub 2023, "Sampling visible GGX normals with spherical caps", listing 3.
"""

import math
from dataclasses import dataclass
from typing import Any

from ..thin_film import ThinFilm
from . import Parameters

SMITH = ("smith", "smith-height-correlated", "smith-multiple-scattering")
DELTA_ALPHA = 1e-4  # the specular lobe of a smaller alpha is a perfect mirror


def smith_g1_over_cos(c: Any, alpha: Any) -> Any:
    """G1(c) / c of Smith for GGX at cosine ``c``, finite at c = 0 (Walter et al. 2007, eq. 34)."""
    import drjit as dr

    alpha2 = dr.square(alpha)
    return 2 * dr.rcp(c + dr.sqrt(dr.fma(1 - alpha2, dr.square(c), alpha2)))


def smith_g2_over_cosines(c: Any, d: Any, alpha_c: Any, alpha_d: Any) -> Any:
    """G2 / (c d) of Smith for GGX at two cosines with their widths, correlated by height (Heitz 2014, eq. 99,
    multiplied out)."""
    import drjit as dr

    def root(cosine: Any, alpha: Any) -> Any:
        alpha2 = dr.square(alpha)
        return dr.sqrt(alpha2 + (1 - alpha2) * dr.square(cosine))

    return 2 * dr.rcp(c * root(d, alpha_d) + d * root(c, alpha_c))


def schlick_g1_over_cos(c: Any, k: Any) -> Any:
    """G1(c) / c of Schlick's approximation at cosine ``c``, finite at c = 0 (Schlick 1994, eq. 19)."""
    import drjit as dr

    return dr.rcp(c * (1 - k) + k)


def schlick_k(geometry: str, alpha: Any) -> Any:
    """Schlick's k of a geometry term: sqrt(2 / pi) alpha or, of Karis, (sqrt(alpha) + 1)² / 8; 0 for Smith's."""
    import drjit as dr

    if geometry in SMITH:
        return alpha * 0
    if geometry == "schlick-beckmann":
        return math.sqrt(2 / math.pi) * alpha
    if geometry == "karis":
        return dr.square(dr.sqrt(alpha) + 1) / 8
    raise ValueError(f"geometry must be {', '.join(SMITH)}, schlick-beckmann or karis, not {geometry!r}")


# What single scattering loses, over 9 alpha² / (c² + 9 alpha²): a row for each power of alpha, in it the
# coefficients of t = c / sqrt(c² + 9 alpha²) (docs/material.md).
LOSS = (
    (0.0611, 0.3890, -0.5535, 0.1462),
    (0.0268, -0.0495, -1.4913, 2.3215),
    (0.5768, 1.2835, 5.7916, -8.4859),
    (-0.2798, 0.1905, -7.4814, 11.9088),
)


def smith_albedo(c: Any, alpha: Any) -> Any:
    """What the specular lobe of a white metal reflects of all light at cosine ``c`` > 0 without multiple scattering."""
    import drjit as dr

    spread = 1 / (dr.square(c) + 9 * dr.square(alpha))
    t, loss = c * dr.sqrt(spread), c * 0
    for row in reversed(LOSS):
        loss = loss * alpha + (row[0] + t * (row[1] + t * (row[2] + t * row[3])))
    return 1 - 9 * dr.square(alpha) * spread * loss


def ggx_d(wh: Any, alpha_u: Any, alpha_v: Any) -> Any:
    """GGX density of normals D(wh) in 1/sr, ``wh`` in the local frame, of widths along x and y (Walter et al. 2007,
    eq. 33; Heitz 2014, eq. 85).

    sin² comes from x and y: (n·h)² (alpha² - 1) + 1 loses all its digits where alpha is small.
    """
    import drjit as dr

    alpha2, ratio = alpha_u * alpha_v, alpha_v / alpha_u
    spread = dr.square(wh.x) * ratio + dr.square(wh.y) / ratio + alpha2 * dr.square(wh.z)
    return alpha2 / (dr.pi * dr.square(spread))


def ggx_sample_visible(wo: Any, alpha_u: Any, alpha_v: Any, u: Any) -> Any:
    """A microfacet normal seen from ``wo`` (wo.z > 0), ``u`` uniform (Dupuy, Benyoub 2023, listing 3).

    Density D(wh) G1(wo) (wo·wh) / wo.z with Smith's G1.
    """
    import drjit as dr
    import mitsuba as mi

    v = dr.normalize(mi.Vector3f(alpha_u * wo.x, alpha_v * wo.y, wo.z))
    sin_phi, cos_phi = dr.sincos(2 * dr.pi * u.x)
    height = (1 - u.y) * (1 + v.z)  # of the cap's point above its lowest one, -v.z
    radius = dr.safe_sqrt(u.y * (1 + v.z) * (height + 1 - v.z))
    x, y = alpha_u * (radius * cos_phi + v.x), alpha_v * (radius * sin_phi + v.y)
    return dr.normalize(mi.Vector3f(x, y, height))


@dataclass(frozen=True)
class Lobes:
    """A specular lobe over a Lambert base. Directions are local, on the front.

    ``specular_range`` bounds the probability of choosing the specular lobe. With the ``diffuse_factor`` "half-vector"
    the base has 1 - F(wo·wh) in place of what passes the interface in and out.
    """

    albedo: Any  # of the base
    f0: Any
    f90: Any
    alpha: Any  # GGX width
    geometry: str
    k: Any
    specular_range: tuple[float, float]
    diffuse_factor: str = "interface"
    widths: tuple[Any, Any] | None = None  # along x and y, where they are not both alpha
    film: ThinFilm | None = None

    @classmethod
    def of(cls, p: Parameters) -> "Lobes":
        k = schlick_k(p.geometry, p.alpha)
        return cls(p.albedo, p.f0, p.f90, p.alpha, p.geometry, k, p.specular_range, p.diffuse_factor, film=p.film)

    @property
    def delta(self) -> Any:
        """Whether the specular lobe is a perfect mirror."""
        return self.alpha < DELTA_ALPHA

    def fresnel(self, c: Any) -> Any:
        """Schlick 1994, eq. 15, with a reflectance F90 at grazing incidence; and what a film changes of it."""
        bare = self.f0 + (self.f90 - self.f0) * (1 - c) ** 5
        return bare if self.film is None else bare + self.film.change(c, self.f0, self.f90)

    def interface(self, c: Any) -> Any:
        """What the rough interface keeps from the diffuse base, by its mean normal: Schlick's form
        that rises to max((1 - alpha) F90, F0) (after Lagarde 2011, with alpha for roughness); with the
        height-correlated term of 0.95 alpha. With a film the larger one of what that changes at two angles
        (docs/material.md)."""
        import drjit as dr

        alpha = 0.95 * self.alpha if self.geometry == "smith-height-correlated" else self.alpha
        bare = self.f0 + (dr.maximum((1 - alpha) * self.f90, self.f0) - self.f0) * (1 - c) ** 5
        if self.film is None:
            return bare
        facing = (c + dr.sqrt(dr.square(self.alpha) + (1 - dr.square(self.alpha)) * dr.square(c))) / 2
        change = dr.maximum(
            self.film.change(c * (1 - 0.9 * self.alpha), self.f0, self.f90),
            self.film.change(facing, self.f0, self.f90),
        )
        return dr.clip(bare + dr.select(change < 0, 1 - self.alpha, 1) * change, 0, 1)

    @property
    def mean_width(self) -> Any:
        """That of isotropic facets which reflect about as much once."""
        import drjit as dr

        if self.widths is None:
            return self.alpha
        return dr.sqrt((dr.square(self.widths[0]) + dr.square(self.widths[1])) / 2)

    def width(self, w: Any) -> Any:
        """The width of the facets along a direction."""
        import drjit as dr

        if self.widths is None:
            return self.alpha
        x, y = dr.square(w.x), dr.square(w.y)
        squares = dr.square(self.widths[0]) * x + dr.square(self.widths[1]) * y
        return dr.sqrt(squares / dr.maximum(x + y, 1e-30))

    def g_over_cosines(self, wo: Any, wi: Any) -> Any:
        """The geometry term over both cosines."""
        widths = self.width(wo), self.width(wi)
        if self.geometry == "smith-height-correlated":
            return smith_g2_over_cosines(wo.z, wi.z, *widths)
        if self.geometry in SMITH:
            return smith_g1_over_cos(wo.z, widths[0]) * smith_g1_over_cos(wi.z, widths[1])
        k = (self.k, self.k) if self.widths is None else tuple(schlick_k(self.geometry, w) for w in widths)
        return schlick_g1_over_cos(wo.z, k[0]) * schlick_g1_over_cos(wi.z, k[1])

    def reflected(self, wo: Any) -> tuple[Any, Any]:
        """Estimates of what the specular lobe and the base reflect, by the Fresnel term at n·wo."""
        import drjit as dr

        specular = dr.mean(self.fresnel(wo.z))
        return specular, dr.mean(self.albedo) * (1 - specular)

    def specular_probability(self, wo: Any) -> Any:
        """The lobes are chosen by what they reflect."""
        import drjit as dr

        specular, diffuse = self.reflected(wo)
        return dr.clip(specular / dr.maximum(specular + diffuse, 1e-8), *self.specular_range)

    def eval_pdf(self, wo: Any, wi: Any) -> Any:
        """Value f·cos and density of the smooth lobes, which share one mixture density."""
        import drjit as dr
        import mitsuba as mi

        p_specular = self.specular_probability(wo)
        wh = dr.normalize(wo + wi)
        factor = (1 - self.interface(wo.z)) * (1 - self.interface(wi.z))
        if self.diffuse_factor == "half-vector":
            factor = 1 - self.fresnel(dr.dot(wo, wh))
        value = self.albedo * factor * (wi.z / dr.pi)
        pdf = (1 - p_specular) * wi.z / dr.pi
        alphas = [dr.maximum(alpha, DELTA_ALPHA) for alpha in self.widths or (self.alpha, self.alpha)]
        d = dr.select(self.delta, 0, ggx_d(wh, *alphas) / 4)
        specular = self.fresnel(dr.dot(wo, wh)) * (d * self.g_over_cosines(wo, wi) * wi.z)
        if self.geometry == "smith-multiple-scattering":
            once = smith_albedo(dr.maximum(wo.z, 1e-6), self.mean_width)
            f0 = self.f0 if self.film is None else self.fresnel(mi.Float(1))
            specular *= 1 + f0 * (1 - once) / once
        value += specular
        return value, pdf + p_specular * d * smith_g1_over_cos(wo.z, self.width(wo))

    def sample(self, wo: Any, choice: Any, u: Any) -> Any:
        """A direction to the light, f·cos, its density (of a mirror its probability), whether it is specular, and
        whether a mirror's."""
        import drjit as dr
        import mitsuba as mi

        p_specular = self.specular_probability(wo)
        specular = choice < p_specular
        visible = ggx_sample_visible(wo, *(self.widths or (self.alpha, self.alpha)), u)
        wh = dr.select(self.delta, mi.Vector3f(0, 0, 1), visible)
        mirrored = 2 * dr.dot(wo, wh) * wh - wo
        wi = dr.select(specular, mirrored, mi.warp.square_to_cosine_hemisphere(u))
        value, pdf = self.eval_pdf(wo, wi)
        mirror = specular & self.delta
        value = dr.select(mirror, self.fresnel(wo.z) * self.g_over_cosines(wo, wo) * dr.square(wo.z), value)
        return wi, value, dr.select(mirror, p_specular, pdf), specular, mirror
