# SPDX-License-Identifier: MIT
"""``fragtracer_surface``: a material that varies over a mesh, with shading normals, alpha and culled back faces.

Its parameters: ``model`` (models/), ``albedo`` (three numbers), ``roughness``, ``metallic``, ``specular``,
``dielectric_f0`` (three numbers), ``geometry``, ``diffuse_factor``, ``opacity``, ``alpha_mode`` ("opaque", "mask" or
"blend"), ``alpha_cutoff``, ``double_sided``, ``normal_scale``, of a coat (coat.py) ``coat``, ``coat_roughness``,
``coat_f0`` (a number) and ``coat_normal_scale``, of a sheen (sheen.py) ``sheen_color`` (three numbers) and
``sheen_roughness``, of a thin film (thin_film.py) ``iridescence``, ``iridescence_ior``, ``iridescence_thickness`` and
``iridescence_thickness_minimum`` (nm), of a translucent base (translucent.py) ``diffuse_transmission`` and
``diffuse_transmission_color`` (three numbers); and children ``albedo_texture``, ``alpha_texture``,
``roughness_texture``, ``metallic_texture``, ``coat_texture``, ``coat_roughness_texture``, ``coat_normal_texture``,
``sheen_color_texture``, ``sheen_roughness_texture``, ``iridescence_texture``, ``iridescence_thickness_texture``,
``diffuse_transmission_texture``, ``diffuse_transmission_color_texture`` and ``normal_texture``, each a
``fragtracer_texture`` and each with its set of coordinates, as ``albedo_set``: "uv", or the name of an attribute of
the mesh.

The mesh has face normals, so that Mitsuba's normal is the geometric one. Shading normals that face away from
the viewer are bent towards it, and scattering fades out towards the geometric horizon, so that no light leaks
and no triangle edge shows (Chiang, Li and Burley 2019). Base and coat have each a normal map of its own.
Attributes of the mesh, ``vertex_shading`` (shading normal), ``vertex_tangent`` and ``vertex_handed`` (glTF's tangent
and its sign), ``vertex_color`` and ``vertex_alpha`` are read where ``has_shading`` and so on are true.
"""

from typing import Any

from .coat import Coated, shadowing
from .models import Parameters, lobes_of
from .models.metallic_roughness import DELTA_ALPHA
from .sheen import Sheened
from .thin_film import ThinFilm
from .translucent import Translucent

_SPECULAR_RANGE = (0.1, 0.9)
# The shading normal bends to the viewer where the cosine between them is less than this, and than that of the surface.
_LEAST_COSINE = 0.01


def surface_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class Surface(mi.BSDF):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            defaults = {"roughness": 0.5, "metallic": 0, "specular": 1, "opacity": 1}
            defaults |= {"coat": 0, "coat_roughness": 0, "coat_f0": 0, "sheen_roughness": 0}
            defaults |= {"iridescence": 0, "iridescence_ior": 1, "iridescence_thickness": 0}
            defaults |= {"iridescence_thickness_minimum": 0}
            defaults |= {"diffuse_transmission": 0}
            self.values = {name: mi.Float(float(props.get(name, default))) for name, default in defaults.items()}
            self.is_coated = float(props.get("coat", 0)) > 0
            self.scales = {n: float(props.get(f"{n}_scale", 1)) for n in ("normal", "coat_normal")}
            self.cutoff = float(props.get("alpha_cutoff", 0.5))
            self.albedo = mi.Color3f([float(x) for x in props["albedo"]])
            self.dielectric_f0 = mi.Color3f([float(x) for x in props.get("dielectric_f0", [0.0, 0.0, 0.0])])
            self.sheen_color = mi.Color3f([float(x) for x in props.get("sheen_color", [0.0, 0.0, 0.0])])
            self.has_sheen, self.has_film = "sheen_color" in props, "iridescence" in props
            self.transmits = "diffuse_transmission" in props
            transmitted = props.get("diffuse_transmission_color", [1.0, 1.0, 1.0])
            self.transmission_color = mi.Color3f([float(x) for x in transmitted])
            self.geometry, self.alpha_mode = str(props.get("geometry", "smith")), str(props.get("alpha_mode", "opaque"))
            self.model = str(props.get("model", "metallic-roughness"))
            self.diffuse_factor = str(props.get("diffuse_factor", "interface"))
            self.double_sided = bool(props.get("double_sided", True))
            names = ["albedo", "alpha", "roughness", "metallic", "coat", "coat_roughness", "coat_normal", "normal"]
            names += ["sheen_color", "sheen_roughness", "iridescence", "iridescence_thickness"]
            names += ["diffuse_transmission", "diffuse_transmission_color"]
            self.textures = {n: props[f"{n}_texture"] for n in names if f"{n}_texture" in props}
            self.sets = {n: str(props.get(f"{n}_set", "uv")) for n in names}
            attributes = ("shading", "tangent", "color", "alpha")
            self.has = {name: bool(props.get(f"has_{name}", False)) for name in attributes}
            sides, flags = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide, mi.BSDFFlags
            self.types = [int(flags.DiffuseReflection), int(flags.GlossyReflection), int(flags.DeltaReflection)]
            self.types += [int(flags.DiffuseTransmission)] * self.transmits
            self.types += [int(flags.Null)] * (self.alpha_mode != "opaque" or not self.double_sided)
            self.m_components = [kind | sides for kind in self.types]
            self.m_flags = sides
            for kind in self.types:
                self.m_flags = self.m_flags | kind
            dr.make_opaque(self.albedo, self.dielectric_f0, self.sheen_color, *self.values.values())
            dr.make_opaque(self.transmission_color)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            opacity = self.opacity_at(si, active)
            transmitted = sample1 >= opacity
            choice = dr.select(transmitted, 0, sample1 / dr.maximum(opacity, 1e-20))
            frame, front, lobes = self._layers(si, active)
            wo = frame.to_local(si.to_world(si.wi))
            local, value, pdf, specular, mirror = lobes.sample(wo, choice, sample2)
            wi = si.to_local(frame.to_world(local))
            valid = active & (sample1 < opacity) & (wo.z > 0) & self._is_lit(local) & (pdf > 0)
            bs = mi.BSDFSample3f(dr.select(transmitted, -si.wi, wi))
            bs.pdf = dr.select(transmitted, 1 - opacity, dr.select(valid, pdf * opacity, 0))
            bs.eta = mi.Float(1)
            lobe = dr.select(mirror, mi.UInt32(2), dr.select(specular, mi.UInt32(1), mi.UInt32(0)))
            if self.transmits:
                lobe = dr.select(local.z < 0, mi.UInt32(3), lobe)
            bs.sampled_component = dr.select(transmitted, mi.UInt32(len(self.types) - 1), lobe)
            bs.sampled_type = mi.UInt32(0)
            for index, kind in enumerate(self.types):
                chosen = bs.sampled_component == index
                bs.sampled_type = dr.select(chosen, mi.UInt32(kind), bs.sampled_type)
            lit = 1 if self.is_coated else shadowing(front, local)
            weight = dr.select(valid, value * (lit * dr.rcp(pdf)), 0)
            return bs, dr.select(active & transmitted, mi.Color3f(1), weight)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            opacity = self.opacity_at(si, active)
            frame, front, lobes = self._layers(si, active)
            viewer, light = frame.to_local(si.to_world(si.wi)), frame.to_local(si.to_world(wo))
            valid = active & (viewer.z > 0) & self._is_lit(light)
            value, pdf = lobes.eval_pdf(viewer, light)
            value *= 1 if self.is_coated else shadowing(front, light)
            return dr.select(valid, value * opacity, 0), dr.select(valid, pdf * opacity, 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(1 - self.opacity_at(si, active))

        def to_string(self) -> str:
            return f"FragtracerSurface[geometry={self.geometry}, textures={list(self.textures)}]"

        def _is_lit(self, w: Any) -> Any:
            """Whether light may come from a local direction."""
            return (w.z > 0) | (w.z < 0) if self.transmits else w.z > 0

        def _uv(self, name: str, si: Any, active: Any) -> Any:
            if self.sets[name] == "uv":
                return si.uv
            uvw = si.shape.eval_attribute_3(self.sets[name], si, active)
            return mi.Point2f(uvw.x, uvw.y)

        def _number(self, name: str, si: Any, active: Any) -> Any:
            value = self.values[name]
            if name not in self.textures:
                return value
            return dr.clip(value * self.textures[name].number_at(si, self._uv(name, si, active), active), 0, 1)

        def opacity_at(self, si: Any, active: Any) -> Any:
            """The probability that a ray interacts with the surface; 0 for a culled back face."""
            alpha = mi.Float(1)
            if self.alpha_mode != "opaque":
                alpha = alpha * self.values["opacity"]
                if "alpha" in self.textures:
                    alpha = alpha * self.textures["alpha"].number_at(si, self._uv("alpha", si, active), active)
                if self.has["alpha"]:
                    alpha = alpha * si.shape.eval_attribute_1("vertex_alpha", si, active)
            if self.alpha_mode == "mask":
                alpha = dr.select(alpha >= self.cutoff, mi.Float(1), 0)
            alpha = dr.clip(alpha, 0, 1)
            return alpha if self.double_sided else dr.select(si.wi.z > 0, alpha, 0)

        def albedo_at(self, si: Any, active: Any) -> Any:
            albedo = self.albedo
            if "albedo" in self.textures:
                albedo = albedo * self.textures["albedo"].at(si, self._uv("albedo", si, active), active)
            if self.has["color"]:
                albedo = albedo * si.shape.eval_attribute_3("vertex_color", si, active)
            return dr.clip(albedo, 0, 1)

        def _lobes(self, si: Any, active: Any) -> Any:
            """The material of docs/material.md at the point."""
            albedo = self.albedo_at(si, active)
            metallic, alpha = self._number("metallic", si, active), dr.square(self._number("roughness", si, active))
            dielectric = (1 - metallic) * self.values["specular"]
            f0 = dielectric * self.dielectric_f0 + metallic * albedo
            f90 = dielectric * _grazing(self.dielectric_f0) + metallic * _grazing(dr.max(albedo))
            parameters = Parameters(
                *((1 - metallic) * albedo, f0, f90, alpha, self.geometry, _SPECULAR_RANGE, self.diffuse_factor),
                self._film(si, active) if self.has_film else None,
            )
            lobes = self._sheened(lobes_of(self.model, parameters), si, active)
            if not self.transmits:
                return lobes
            color = self.transmission_color
            if "diffuse_transmission_color" in self.textures:
                uv = self._uv("diffuse_transmission_color", si, active)
                color = color * self.textures["diffuse_transmission_color"].at(si, uv, active)
            factor = self._number("diffuse_transmission", si, active)
            return Translucent.of(lobes, factor, (1 - metallic) * dr.clip(color, 0, 1))

        def _film(self, si: Any, active: Any) -> ThinFilm:
            weight, thickness = self._number("iridescence", si, active), self.values["iridescence_thickness"]
            if "iridescence_thickness" in self.textures:
                uv = self._uv("iridescence_thickness", si, active)
                share = dr.clip(self.textures["iridescence_thickness"].number_at(si, uv, active), 0, 1)
                thickness = dr.lerp(self.values["iridescence_thickness_minimum"], thickness, share)
            return ThinFilm(weight, self.values["iridescence_ior"], thickness)

        def _sheened(self, base: Any, si: Any, active: Any) -> Any:
            if not self.has_sheen:
                return base
            color = self.sheen_color
            if "sheen_color" in self.textures:
                color = color * self.textures["sheen_color"].at(si, self._uv("sheen_color", si, active), active)
            return Sheened(base, dr.clip(color, 0, 1), self._number("sheen_roughness", si, active))

        def _layers(self, si: Any, active: Any) -> Any:
            """The frame of the lobes, which is the coat's if there is one, in it the geometric normal on the viewer's
            side, and the lobes."""
            (frame, front), lobes = self._frame(si, active), self._lobes(si, active)
            if not self.is_coated:
                return frame, front, lobes
            own, own_front = self._frame(si, active, "coat_normal")
            is_apart = self._is_mapped("normal") or self._is_mapped("coat_normal")
            base = mi.Frame3f(own.to_local(frame.n)) if is_apart else None
            alpha = dr.maximum(dr.square(self._number("coat_roughness", si, active)), DELTA_ALPHA)
            coat = self._number("coat", si, active), self.values["coat_f0"], alpha
            return own, own_front, Coated.of(lobes, *coat, base, own_front)

        def _frame(self, si: Any, active: Any, name: str = "normal") -> Any:
            """The frame around the shading normal as the normal map of a ``name`` has it, and in it the geometric
            normal, both on the viewer's side."""
            normal = self._shading_normal(si, active)
            if self._is_mapped(name):
                normal = self._mapped(name, normal, si, active)
            frame = mi.Frame3f(_bent(normal, si))
            return frame, frame.to_local(mi.Vector3f(si.n) * _side(si))

        def _shading_normal(self, si: Any, active: Any) -> Any:
            """That of the mesh, on the front."""
            normal = mi.Vector3f(si.n)
            if not self.has["shading"]:
                return normal
            given = si.shape.eval_attribute_3("vertex_shading", si, active)
            return _unit(dr.mulsign(mi.Vector3f(given), dr.dot(given, si.n)), normal)

        def _is_mapped(self, name: str) -> bool:
            return name in self.textures and self.has["tangent"]

        def _mapped(self, name: str, normal: Any, si: Any, active: Any) -> Any:
            """The normal of the normal map of a ``name``, in the tangent frame of glTF 2.0, section 3.7.2.1."""
            texel = self.textures[name].at(si, self._uv(name, si, active), active)
            x, y, z = (2 * c - 1 for c in texel)
            given = mi.Vector3f(si.shape.eval_attribute_3("vertex_tangent", si, active))
            handed = dr.sign(si.shape.eval_attribute_1("vertex_handed", si, active))
            tangent = given - normal * dr.dot(normal, given)
            known = dr.squared_norm(tangent) > 0
            tangent = _unit(tangent, tangent)
            bitangent = dr.cross(normal, tangent) * handed
            mapped = self.scales[name] * (x * tangent + y * bitangent) + z * normal
            return dr.select(known, _unit(mapped, normal), normal)

    def _side(si: Any) -> Any:
        """1 where the viewer is in front, -1 where behind."""
        return dr.select(si.wi.z < 0, mi.Float(-1), mi.Float(1))

    def _bent(normal: Any, si: Any) -> Any:
        """A normal of the front on the viewer's side, bent to the viewer where it faces away."""
        normal, viewer = normal * _side(si), si.to_world(si.wi)
        cosine, least = dr.dot(normal, viewer), dr.minimum(_LEAST_COSINE, dr.abs(si.wi.z))
        bent = dr.normalize(normal + dr.maximum(least - cosine, 0) * viewer)
        return dr.select(cosine < least, bent, normal)

    def _unit(vector: Any, otherwise: Any) -> Any:
        """A vector of length 1, or something else where it has none."""
        size = dr.norm(vector)
        return dr.select(size > 1e-6, vector / dr.maximum(size, 1e-6), otherwise)

    def _grazing(f0: Any) -> Any:
        """Reflectance at grazing incidence of a reflectance at normal incidence."""
        return dr.minimum(1, 50 * f0)

    return Surface
