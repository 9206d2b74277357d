# SPDX-License-Identifier: MIT
"""fragtracer's material as a Mitsuba 3 BSDF plugin, ``fragtracer_cooktorrance``.

Written from the formulas, apart from the shader, so that an error in one of them shows up as a
difference. The file needs Mitsuba alone: ``fragtracer export-mitsuba --plugin`` copies it beside a
scene. To use it::

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")
    import fragtracer_bsdf
    fragtracer_bsdf.register()
    scene = mi.load_file("scene.xml")

Parameters of the plugin: ``diffuse_albedo``, ``specular_f0`` and ``specular_f90`` (three numbers each),
``alpha`` (GGX width) and ``geometry`` ("smith", "schlick-beckmann" or "karis").

In this file ``wo`` points to the viewer and ``wi`` to the light, as everywhere in fragtracer;
Mitsuba's names are the other way round and are swapped in the plugin's public methods.

References
----------
- Trowbridge, Reitz 1975, "Average irregularity representation of a rough surface"; in its
  microfacet form: Walter et al. 2007, "Microfacet models for refraction", eq. 33 and 34 (D, G1).
- Schlick 1994, "An inexpensive BRDF model for physically-based rendering", eq. 15 (F), 19 (G).
- Karis 2013, "Real shading in Unreal Engine 4", eq. 4 (k of the analytic lights).
- Dupuy, Benyoub 2023, "Sampling visible GGX normals with spherical caps", listing 3.
"""

import math
from functools import lru_cache
from typing import Any

NAME = "fragtracer_cooktorrance"
DELTA_ALPHA = 1e-4  # the specular lobe of a smaller alpha is a perfect mirror


def register() -> None:
    """Makes the plugin known to the active Mitsuba variant; may be called again."""
    import mitsuba as mi

    _register(mi.variant())


@lru_cache
def _register(variant: str) -> type:
    import drjit as dr
    import mitsuba as mi

    plugin = _plugin_class(mi, dr)
    mi.register_bsdf(NAME, plugin)
    return plugin


def smith_g1_over_cos(c: Any, alpha: Any) -> Any:
    """G1(c) / c of Smith for GGX at cosine ``c``, finite at c = 0 (Walter et al. 2007, eq. 34)."""
    import drjit as dr

    alpha2 = dr.square(alpha)
    return 2 / (c + dr.sqrt(dr.fma(1 - alpha2, dr.square(c), alpha2)))


def schlick_g1_over_cos(c: Any, k: Any) -> Any:
    """G1(c) / c of Schlick's approximation at cosine ``c``, finite at c = 0 (Schlick 1994, eq. 19)."""
    return 1 / (c * (1 - k) + k)


def schlick_k(geometry: str, alpha: float) -> float:
    """Schlick's k of a geometry term: sqrt(2 alpha² / pi) or, of Karis, (sqrt(alpha) + 1)² / 8."""
    if geometry == "schlick-beckmann":
        return math.sqrt(2 * alpha**2 / math.pi)
    if geometry == "karis":
        return (math.sqrt(alpha) + 1) ** 2 / 8
    raise ValueError(f"geometry must be smith, schlick-beckmann or karis, not {geometry!r}")


def ggx_d(wh: Any, alpha: Any) -> Any:
    """GGX density of normals D(wh) in 1/sr, ``wh`` in the local frame (Walter et al. 2007, eq. 33).

    sin² comes from x and y: (n·h)² (alpha² - 1) + 1 loses all its digits where alpha is small.
    """
    import drjit as dr

    alpha2 = dr.square(alpha)
    spread = dr.square(wh.x) + dr.square(wh.y) + alpha2 * dr.square(wh.z)
    return alpha2 / (dr.pi * dr.square(spread))


def ggx_sample_visible(wo: Any, alpha: Any, u: Any) -> Any:
    """A microfacet normal seen from ``wo`` (wo.z > 0), ``u`` uniform (Dupuy, Benyoub 2023, listing 3).

    Density D(wh) G1(wo) (wo·wh) / wo.z with Smith's G1.
    """
    import drjit as dr
    import mitsuba as mi

    v = dr.normalize(mi.Vector3f(alpha * wo.x, alpha * wo.y, wo.z))
    sin_phi, cos_phi = dr.sincos(2 * dr.pi * u.x)
    height = (1 - u.y) * (1 + v.z)  # of the cap's point above its lowest one, -v.z
    radius = dr.safe_sqrt(u.y * (1 + v.z) * (height + 1 - v.z))
    return dr.normalize(mi.Vector3f(alpha * (radius * cos_phi + v.x), alpha * (radius * sin_phi + v.y), height))


def _plugin_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class CookTorrance(mi.BSDF):  # type: ignore[misc]
        """The lobes are chosen by the Fresnel term at n·wo; the smooth ones share one mixture density."""

        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.albedo = mi.Color3f([float(x) for x in props["diffuse_albedo"]])
            self.f0 = mi.Color3f([float(x) for x in props["specular_f0"]])
            self.f90 = mi.Color3f([float(x) for x in props["specular_f90"]])
            self.alpha = mi.Float(float(props["alpha"]))
            self.geometry = str(props.get("geometry", "smith"))
            alpha = float(props["alpha"])
            self.k = mi.Float(0.0 if self.geometry == "smith" else schlick_k(self.geometry, alpha))
            has_specular = any(float(x) > 0 for name in ("specular_f0", "specular_f90") for x in props[name])
            self._set_lobes(any(float(x) > 0 for x in props["diffuse_albedo"]), has_specular, alpha < DELTA_ALPHA)
            # Opaque, that is, unknown to the compiler: materials of one kind share their code.
            dr.make_opaque(self.albedo, self.f0, self.f90, self.alpha, self.k)

        def _set_lobes(self, has_diffuse: bool, has_specular: bool, delta: bool) -> None:
            self.delta = delta
            self.specular_range = (0.25, 0.75) if has_diffuse and has_specular else (float(has_specular),) * 2
            self.diffuse_type = int(mi.BSDFFlags.DiffuseReflection)
            self.specular_type = int(mi.BSDFFlags.DeltaReflection if delta else mi.BSDFFlags.GlossyReflection)
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            types = [self.diffuse_type] * (has_diffuse or not has_specular) + [self.specular_type] * has_specular
            self.m_components = [lobe | sides for lobe in types]
            self.m_flags = sides
            for lobe in types:
                self.m_flags = self.m_flags | lobe
            self.specular_index = len(types) - 1

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            wo, side = self._to_front(si.wi)
            p_specular = self._specular_probability(wo)
            specular = sample1 < p_specular
            wh = mi.Vector3f(0, 0, 1) if self.delta else ggx_sample_visible(wo, self.alpha, sample2)
            mirrored = 2 * dr.dot(wo, wh) * wh - wo
            wi = dr.select(specular, mirrored, mi.warp.square_to_cosine_hemisphere(sample2))
            value, pdf = self._eval_pdf(wo, wi)
            if self.delta:
                value = dr.select(specular, self._fresnel(wo.z) * dr.square(self._g1_over_cos(wo.z) * wo.z), value)
                pdf = dr.select(specular, p_specular, pdf)
            valid = active & (wo.z > 0) & (wi.z > 0) & (pdf > 0)
            bs = mi.BSDFSample3f(mi.Vector3f(wi.x, wi.y, wi.z * side))
            bs.pdf = dr.select(valid, pdf, 0)
            bs.eta = mi.Float(1)
            bs.sampled_type = dr.select(specular, mi.UInt32(self.specular_type), mi.UInt32(self.diffuse_type))
            bs.sampled_component = dr.select(specular, mi.UInt32(self.specular_index), mi.UInt32(0))
            return bs, dr.select(valid, value / pdf, 0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            viewer, side = self._to_front(si.wi)
            light = mi.Vector3f(wo.x, wo.y, wo.z * side)
            valid = active & (viewer.z > 0) & (light.z > 0)
            value, pdf = self._eval_pdf(viewer, light)
            return dr.select(valid, value, 0), dr.select(valid, pdf, 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def to_string(self) -> str:
            return f"FragtracerCookTorrance[geometry={self.geometry}, alpha={self.alpha}, f0={self.f0}]"

        def _to_front(self, w: Any) -> Any:
            """``w`` seen from its own side of the surface, and the sign that undoes it: both sides are alike."""
            side = dr.select(w.z < 0, mi.Float(-1), mi.Float(1))
            return mi.Vector3f(w.x, w.y, w.z * side), side

        def _fresnel(self, c: Any) -> Any:
            """Schlick 1994, eq. 15, with a reflectance F90 at grazing incidence."""
            return self.f0 + (self.f90 - self.f0) * (1 - c) ** 5

        def _interface(self, c: Any) -> Any:
            """What the rough interface keeps from the diffuse base, by its mean normal: Schlick's form
            that rises to max((1 - alpha) F90, F0) (after Lagarde 2011, with alpha for roughness)."""
            return self.f0 + (dr.maximum((1 - self.alpha) * self.f90, self.f0) - self.f0) * (1 - c) ** 5

        def _g1_over_cos(self, c: Any) -> Any:
            return smith_g1_over_cos(c, self.alpha) if self.geometry == "smith" else schlick_g1_over_cos(c, self.k)

        def _specular_probability(self, wo: Any) -> Any:
            reflected = dr.mean(self._fresnel(wo.z))
            scattered = dr.mean(self.albedo) * (1 - reflected)
            return dr.clip(reflected / dr.maximum(reflected + scattered, 1e-8), *self.specular_range)

        def _eval_pdf(self, wo: Any, wi: Any) -> Any:
            """Value f·cos and density of the smooth lobes, both directions on the front."""
            p_specular = self._specular_probability(wo)
            both_pass = (1 - self._interface(wo.z)) * (1 - self._interface(wi.z))
            value = self.albedo * both_pass * (wi.z / dr.pi)
            pdf = (1 - p_specular) * wi.z / dr.pi
            if self.delta:
                return value, pdf
            wh = dr.normalize(wo + wi)
            d = ggx_d(wh, self.alpha) / 4
            geometry = self._g1_over_cos(wo.z) * self._g1_over_cos(wi.z)
            value += self._fresnel(dr.dot(wo, wh)) * (d * geometry * wi.z)
            return value, pdf + p_specular * d * smith_g1_over_cos(wo.z, self.alpha)

    return CookTorrance
