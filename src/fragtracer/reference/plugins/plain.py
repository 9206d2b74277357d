# SPDX-License-Identifier: MIT
"""``fragtracer_cooktorrance``: a uniform two-sided material.

Its parameters: ``diffuse_albedo``, ``specular_f0`` and ``specular_f90`` (three numbers each),
``alpha`` (GGX width), ``geometry`` ("smith", "smith-height-correlated", "schlick-beckmann", "karis" or
"smith-multiple-scattering") and ``diffuse_factor`` ("interface" or "half-vector"); of
facets of two widths ``alpha_u``, along the tangent, and ``alpha_v`` besides; of a thin film (thin_film.py)
``iridescence``, ``iridescence_ior`` and ``iridescence_thickness`` (nm); of a sheen (sheen.py) ``sheen_color``
(three numbers) and ``sheen_roughness``; of a coat (coat.py) its weight ``coat``, ``coat_f0`` (a number) and
``coat_alpha``; and of a translucent base (translucent.py) ``diffuse_transmission`` (a number) and
``diffuse_transmission_albedo`` (three numbers).
"""

from typing import Any

from .coat import Coated
from .models.metallic_roughness import DELTA_ALPHA, Lobes, schlick_k
from .sheen import Sheened
from .thin_film import ThinFilm
from .translucent import Translucent


def plain_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    flags = mi.BSDFFlags
    diffuse, glossy, delta = map(int, (flags.DiffuseReflection, flags.GlossyReflection, flags.DeltaReflection))
    transmission = int(flags.DiffuseTransmission)

    class CookTorrance(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            colors = [[float(x) for x in props[name]] for name in ("diffuse_albedo", "specular_f0", "specular_f90")]
            (albedo, f0, f90), alpha = map(mi.Color3f, colors), mi.Float(float(props["alpha"]))
            geometry = str(props.get("geometry", "smith"))
            k = mi.Float(schlick_k(geometry, alpha))
            has_sheen = "sheen_color" in props
            has_film = "iridescence" in props
            has_diffuse, has_specular = max(colors[0]) > 0, has_film or max(colors[1] + colors[2]) > 0
            coated = float(props.get("coat", 0)) > 0
            self.transmits = "diffuse_transmission" in props
            self._set_lobes(has_diffuse or has_sheen, has_specular, float(props["alpha"]) < DELTA_ALPHA, coated)
            # Opaque, that is, unknown to the compiler: materials of one kind share their code.
            dr.make_opaque(albedo, f0, f90, alpha, k)
            specular_range = (0.25, 0.75) if has_diffuse and has_specular else (float(has_specular),) * 2
            diffuse_factor = str(props.get("diffuse_factor", "interface"))
            widths = None
            if "alpha_u" in props:
                widths = mi.Float(float(props["alpha_u"])), mi.Float(float(props["alpha_v"]))
                dr.make_opaque(*widths)
            film = None
            if has_film:
                names = ("iridescence", "iridescence_ior", "iridescence_thickness")
                film = ThinFilm(*(mi.Float(float(props[name])) for name in names))
                dr.make_opaque(film.weight, film.index, film.thickness)
            self.base: Any = Lobes(albedo, f0, f90, alpha, geometry, k, specular_range, diffuse_factor, widths, film)
            if has_sheen:
                color = mi.Color3f([float(x) for x in props["sheen_color"]])
                sheen_roughness = mi.Float(float(props["sheen_roughness"]))
                dr.make_opaque(color, sheen_roughness)
                self.base = Sheened(self.base, color, sheen_roughness)
            if self.transmits:
                factor = mi.Float(float(props["diffuse_transmission"]))
                transmitted = mi.Color3f([float(x) for x in props["diffuse_transmission_albedo"]])
                dr.make_opaque(factor, transmitted)
                self.base = Translucent.of(self.base, factor, transmitted)
            self.lobes = self._coated(props) if coated else self.base

        def _coated(self, props: Any) -> Coated:
            weight, f0, alpha = (mi.Float(float(props[name])) for name in ("coat", "coat_f0", "coat_alpha"))
            dr.make_opaque(weight, f0, alpha)
            return Coated.of(self.base, weight, f0, alpha)

        def _set_lobes(self, has_diffuse: bool, has_specular: bool, mirror: bool, coated: bool) -> None:
            has_glossy, has_delta = coated or (has_specular and not mirror), has_specular and mirror
            self.types = [diffuse] * (has_diffuse or not has_specular) + [glossy] * has_glossy + [delta] * has_delta
            self.types += [transmission] * self.transmits
            self.m_flags = sides = flags.FrontSide | flags.BackSide
            self.m_components = [lobe | sides for lobe in self.types]
            for lobe in self.types:
                self.m_flags = self.m_flags | lobe

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            wo, side = self._to_front(si.wi)
            wi, value, pdf, specular, mirror = self.lobes.sample(wo, sample1, sample2)
            valid = active & (wo.z > 0) & self._is_lit(wi) & (pdf > 0)
            bs = mi.BSDFSample3f(mi.Vector3f(wi.x, wi.y, wi.z * side))
            bs.pdf = dr.select(valid, pdf, 0)
            bs.eta = mi.Float(1)
            smooth = dr.select(specular, mi.UInt32(glossy), mi.UInt32(diffuse))
            bs.sampled_type = dr.select(mirror, mi.UInt32(delta), smooth)
            if self.transmits:
                bs.sampled_type = dr.select(wi.z < 0, mi.UInt32(transmission), bs.sampled_type)
            bs.sampled_component = mi.UInt32(0)
            for index, lobe in enumerate(self.types):
                bs.sampled_component = dr.select(bs.sampled_type == lobe, mi.UInt32(index), bs.sampled_component)
            return bs, dr.select(valid, value * dr.rcp(pdf), 0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            viewer, side = self._to_front(si.wi)
            light = mi.Vector3f(wo.x, wo.y, wo.z * side)
            valid = active & (viewer.z > 0) & self._is_lit(light)
            value, pdf = self.lobes.eval_pdf(viewer, light)
            return dr.select(valid, value, 0), dr.select(valid, pdf, 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def to_string(self) -> str:
            return f"FragtracerCookTorrance[geometry={self.base.geometry}]"

        def _is_lit(self, w: Any) -> Any:
            """Whether light may come from a direction, the viewer being on the front."""
            return (w.z > 0) | (w.z < 0) if self.transmits else w.z > 0

        def _to_front(self, w: Any) -> Any:
            """``w`` mirrored to the front of the surface, and the sign that undoes it."""
            side = dr.select(w.z < 0, mi.Float(-1), mi.Float(1))
            return mi.Vector3f(w.x, w.y, w.z * side), side

    return CookTorrance
