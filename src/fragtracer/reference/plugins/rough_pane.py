# SPDX-License-Identifier: MIT
"""``fragtracer_rough_pane``: a thin pane of GGX facets, which Mitsuba has not.

Its parameters: ``int_ior`` and ``ext_ior``, ``alpha_u`` and ``alpha_v``, the widths of the facets along the tangent and
across it, and ``specular_transmittance`` (three numbers). A facet reflects 2 F / (1 + F), and what it transmits has the
directions of the reflected lobe, mirrored in the surface (glTF's ``KHR_materials_transmission``). Facets and the
Fresnel term are Mitsuba's own.
"""

from typing import Any


def rough_pane_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class RoughPane(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.eta = mi.Float(float(props["int_ior"]) / float(props["ext_ior"]))
            self.widths = mi.Float(float(props["alpha_u"])), mi.Float(float(props["alpha_v"]))
            self.color = mi.Color3f([float(x) for x in props["specular_transmittance"]])
            flags = mi.BSDFFlags
            self.types = [int(flags.GlossyReflection), int(flags.GlossyTransmission)]
            self.m_components = [kind | flags.FrontSide | flags.BackSide for kind in self.types]
            self.m_flags = self.m_components[0] | self.m_components[1]
            dr.make_opaque(self.eta, self.color, *self.widths)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            viewer = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
            half, _ = self._facets().sample(viewer, sample2)
            light = mi.reflect(viewer, half)
            reflects = sample1 < self._reflectance(dr.dot(viewer, half))
            valid = active & (light.z > 0)
            wo = mi.Vector3f(light.x, light.y, dr.mulsign(light.z, dr.select(reflects, si.wi.z, -si.wi.z)))
            value, pdf = self.eval_pdf(ctx, si, wo, valid)
            bs = mi.BSDFSample3f(wo)
            bs.pdf, bs.eta = pdf, mi.Float(1)
            bs.sampled_component = dr.select(reflects, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(reflects, *map(mi.UInt32, self.types))
            return bs, dr.select(valid & (pdf > 0), value * dr.rcp(pdf), 0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            viewer, light = (mi.Vector3f(w.x, w.y, dr.abs(w.z)) for w in (si.wi, wo))
            half, facets = dr.normalize(viewer + light), self._facets()
            reflects = si.wi.z * wo.z > 0
            reflected = self._reflectance(dr.dot(viewer, half))
            chance = dr.select(reflects, reflected, 1 - reflected)
            visible = facets.smith_g1(viewer, half) * dr.rcp(4 * viewer.z)
            pdf = dr.select(active & (si.wi.z * wo.z != 0), chance * facets.eval(half) * visible, 0)
            value = dr.select(reflects, mi.Color3f(1), self.color) * (pdf * facets.smith_g1(light, half))
            return value, pdf

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def to_string(self) -> str:
            return f"FragtracerRoughPane[eta={self.eta}, alpha={self.widths}]"

        def _facets(self) -> Any:
            return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, *self.widths, True)

        def _reflectance(self, cosine: Any) -> Any:
            """All orders of reflection between the two interfaces."""
            once = mi.fresnel(cosine, self.eta)[0]
            return 2 * once / (1 + once)

    return RoughPane
