# SPDX-License-Identifier: MIT
"""BSDFs of a Mitsuba scene as materials.

Where the two differ, a note says so:

- Facets are GGX's, also where Mitsuba has Beckmann's, of the same width.
- ``principled`` becomes a metallic-roughness material whose base is as bright; its coat and sheen have other facets.
- A conductor whose ``specular_reflectance`` is not 1 has Schlick's Fresnel term.
- An interface of two dielectrics with a medium within is one of the inner one, which must lie in the outer one.
"""

import math
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fragtracer.io.mitsuba.nodes import Node, fresh
from fragtracer.io.mitsuba.textures import Lengths, Textures, Value, mapped
from fragtracer.scene import Image, Material, Texture
from fragtracer.scene.material import MODELS, PANES, SOLIDS
from fragtracer.scene.reflectance import conductor_reflectance, grazing_reflectance, reflectance_from_ior
from fragtracer.scene.texture import four_channels, linear_pixels

Fields = dict[str, Any]

_AIR = 1.01  # an index that is not greater is that of air
_LEAST_INDEX = 1e-3  # of a conductor; some spectra have 0
_BUMP = "bump"  # among the fields: the texture of heights, and their scale
_WRAPPED = ("twosided", "mask", "normalmap", "bumpmap")
_INDICES = ("int_ior", "ext_ior")
_WHITE, _BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


@dataclass
class Materials:
    """The materials of a scene, each made where a shape asks for it. ``notes`` are what is not as in Mitsuba."""

    mi: Any
    textures: Textures
    notes: list[str]
    found: dict[str, Material] = field(default_factory=dict)
    _names: dict[tuple[Node | None, Node | None, str | None, Lengths | None], str] = field(default_factory=dict)
    _colored: set[str] = field(default_factory=set)

    def name(
        self, bsdf: Node | None, emitter: Node | None, interior: str | None, lengths: Lengths | None = None
    ) -> str:
        """That of the material of a shape with this BSDF, emitter and medium within; where it :meth:`is_bumped`, with
        the ``lengths`` in metres along which u and v of its texture coordinates grow by 1, if there are any."""
        key = bsdf, emitter, interior, lengths
        if key not in self._names:
            with bsdf.checked() if bsdf is not None else nullcontext():
                fields, is_colored = self._fields(bsdf)
            bump = fields.pop(_BUMP, None)
            if bump is not None and lengths is not None:
                heights, scale = bump
                fields["normal_texture"] = self.textures.bump(heights, scale, lengths)
            elif bump is not None:
                self.notes.append(f"{bump[0].line}: the bumps of a shape without triangles or texture coordinates")
            if emitter is not None:
                if bsdf is None:
                    fields["albedo"] = _BLACK
                with emitter.checked():
                    radiance = self.textures.radiance(emitter, "radiance")
                fields |= {"emission": radiance.color, "emission_texture": radiance.texture}
            if interior is not None and fields.get("model") in SOLIDS:
                fields["interior"] = interior
                if fields.pop("exterior_ior", None) is not None:
                    self.notes.append(f"the medium {interior!r} and what bounds it lie within what is outside of it")
            self._names[key] = self._add(bsdf, fields, is_colored)
        return self._names[key]

    def is_bumped(self, bsdf: Node | None) -> bool:
        """Whether the material of a BSDF depends on how textures lie on a shape."""
        if bsdf is None or bsdf.plugin == "blendbsdf":
            return False
        return bsdf.plugin == "bumpmap" or (bsdf.plugin in _WRAPPED and self.is_bumped(bsdf.child("bsdf")))

    def is_colored(self, name: str) -> bool:
        """Whether the colours of vertices are those of the material ``name``."""
        return name in self._colored

    def _add(self, bsdf: Node | None, fields: Fields, is_colored: bool) -> str:
        name = fresh(_title(bsdf) if bsdf is not None else "default", self.found)
        with bsdf.checked() if bsdf is not None else nullcontext():
            self.found[name] = Material(**fields)
        if is_colored:
            self._colored.add(name)
        return name

    def _fields(self, bsdf: Node | None, is_two_sided: bool = False) -> tuple[Fields, bool]:
        """The fields of a material, and whether the colours of vertices multiply its albedo."""
        if bsdf is not None and bsdf.plugin in _WRAPPED:
            return self._wrapped(bsdf, is_two_sided)
        if bsdf is not None and bsdf.plugin == "blendbsdf":
            return self._blend(bsdf, is_two_sided)
        fields, is_colored = self._single(bsdf)
        is_opaque = fields.get("model") not in (*SOLIDS, *PANES) and not fields.get("diffuse_transmission")
        return fields | {"black_back": is_opaque and not is_two_sided}, is_colored

    def _single(self, bsdf: Node | None) -> tuple[Fields, bool]:
        """Of a BSDF that holds no other."""
        if bsdf is None:
            return {"albedo": (0.5, 0.5, 0.5), "specular": 0.0}, False
        match bsdf.plugin:
            case "diffuse":
                fields: Fields = {"specular": 0.0}
                albedo = self.textures.reflectance(bsdf, "reflectance", 0.5)
            case "conductor" | "roughconductor":
                return self._conductor(bsdf), False
            case "dielectric" | "roughdielectric" | "thindielectric":
                return self._dielectric(bsdf), False
            case "plastic" | "roughplastic":
                fields = self._plastic(bsdf)
                albedo = self.textures.reflectance(bsdf, "diffuse_reflectance", 0.5)
            case "principled" | "principledthin":
                return self._principled(bsdf)
            case "null":
                return {"model": "null"}, False
            case _:
                self.notes.append(f"{bsdf.line}: {bsdf.title}, a diffuse grey in its place")
                return {"albedo": (0.5, 0.5, 0.5), "specular": 0.0}, False
        return fields | {"albedo": albedo.color, "albedo_texture": albedo.texture}, bool(albedo.attribute)

    def _nested(self, bsdf: Node) -> list[Node]:
        nested = bsdf.all("bsdf")
        if not nested:
            raise bsdf.error("it holds no other <bsdf>")
        return nested

    def _wrapped(self, bsdf: Node, is_two_sided: bool) -> tuple[Fields, bool]:
        nested, *others = self._nested(bsdf)
        fields, is_colored = self._fields(nested, is_two_sided or bsdf.plugin == "twosided")
        match bsdf.plugin:
            case "twosided" if others:
                self.notes.append(f"{bsdf.line}: the other side of {bsdf.title}, which is as its front")
            case "mask":
                fields |= self._masked(bsdf, fields)
            case "normalmap":
                normals = bsdf.named.get("normalmap") or bsdf.child("texture")
                if normals is None:
                    raise bsdf.error("it has no normalmap, a texture")
                fields |= {"normal_texture": self.textures.texture(normals)}
            case "bumpmap":
                heights = bsdf.child("texture")
                if heights is None:
                    raise bsdf.error("it has no texture, of heights")
                fields[_BUMP] = heights, bsdf.number("scale", 1.0)
        return fields, is_colored

    def _masked(self, bsdf: Node, fields: Fields) -> Fields:
        opacity = self.textures.number(bsdf, "opacity", 0.5)
        masked: Fields = {"alpha_mode": "blend", "opacity": min(max(opacity.number, 0.0), 1.0)}
        if opacity.texture is None:
            return masked
        if "albedo" not in MODELS[fields.get("model", Material.model)]:
            self.notes.append(f"{bsdf.line}: the texture of the opacity, of a material without an albedo")
            return {}
        albedo: Texture | None = fields.get("albedo_texture")
        if albedo is not None and replace(albedo, image=opacity.texture.image) != opacity.texture:
            self.notes.append(f"{bsdf.line}: the mapping of the opacity, which is that of the albedo")
        return masked | {"albedo_texture": _with_alpha(albedo, opacity.texture)}

    def _blend(self, bsdf: Node, is_two_sided: bool) -> tuple[Fields, bool]:
        if len(nested := self._nested(bsdf)) != 2:
            raise bsdf.error(f"it blends two BSDFs, and has {len(nested)}")
        (one, is_colored), (other, is_other_colored) = (self._fields(each, is_two_sided) for each in nested)
        bumped = [each for each in (one, other) if each.pop(_BUMP, None) is not None]
        self.notes += [f"{bsdf.line}: the bumps of what {bsdf.title} blends"] * len(bumped)
        weight = self.textures.number(bsdf, "weight", 0.5)
        if "blend" in one or "blend" in other:
            self.notes.append(f"{bsdf.line}: {bsdf.title} of another blend, the heavier of the two in its place")
            return (other, is_other_colored) if weight.number > 0.5 else (one, is_colored)
        masks = {name: one[name] for name in ("opacity", "alpha_mode") if name in one}
        name = self._add(nested[1], {k: v for k, v in other.items() if k not in masks}, is_other_colored)
        share = min(max(weight.number, 0.0), 1.0)
        return one | {"blend": name, "blend_weight": share, "blend_weight_texture": weight.texture}, is_colored

    def _conductor(self, bsdf: Node) -> Fields:
        fields = self._facets(bsdf) if bsdf.plugin == "roughconductor" else {"roughness": 0.0}
        scale = self.textures.reflectance(bsdf, "specular_reflectance", 1.0)
        metal = bsdf.text("material", "none")
        if bsdf.has("eta") or bsdf.has("k"):
            index = self.textures.unbounded(bsdf, "eta", 0.0), self.textures.unbounded(bsdf, "k", 1.0)
        elif metal != "none":
            values = self.mi.traverse(self.mi.load_dict({"type": "conductor", "material": metal}))
            index = _triple(values["eta.value"]), _triple(values["k.value"])
        else:
            return fields | {"metallic": 1.0, "albedo": scale.color, "albedo_texture": scale.texture}
        eta = tuple(max(n, _LEAST_INDEX) for n in index[0])
        if scale == Value(_WHITE):
            return fields | {"model": "conductor", "eta": eta, "k": index[1]}
        self.notes.append(f"{bsdf.line}: the exact Fresnel term of {bsdf.title}, Schlick's in its place")
        albedo = tuple(np.multiply(conductor_reflectance(*index), scale.color).tolist())
        return fields | {"metallic": 1.0, "albedo": albedo, "albedo_texture": scale.texture}

    def _dielectric(self, bsdf: Node) -> Fields:
        fields: Fields = {"model": "thin-dielectric" if bsdf.plugin == "thindielectric" else "dielectric"}
        if bsdf.plugin == "roughdielectric":
            fields |= self._facets(bsdf)
        elif fields["model"] == "dielectric":
            fields["roughness"] = 0.0
        self._note_reflectance(bsdf)
        passed = self.textures.reflectance(bsdf, "specular_transmittance", 1.0)
        fields |= {"transmittance": passed.color, "transmittance_texture": passed.texture}
        return fields | self._index(bsdf, "bk7")

    def _index(self, bsdf: Node, default: str) -> Fields:
        """The index of refraction, and that of what is outside, unless that is air."""
        bsdf.asked.update(_INDICES)
        names = [bsdf.props.get(name, other) for name, other in zip(_INDICES, (default, "air"), strict=True)]
        eta, inner, outer = (self._ratio(*pair) for pair in (names, (names[0], 1.0), (names[1], 1.0)))
        is_interface = bsdf.plugin in ("dielectric", "roughdielectric") and (outer > _AIR or eta < 1)
        if is_interface and min(inner, outer) >= 1:
            return {"ior": inner, "exterior_ior": outer}
        if eta < 1:
            self.notes.append(f"{bsdf.line}: {bsdf.title} of an index less than 1, which is 1")
        return {"ior": max(1.0, eta)}

    def _ratio(self, inner: Any, outer: Any) -> float:
        """Of two indices, each a number or the name of a material."""
        plugin = self.mi.load_dict({"type": "dielectric", "int_ior": inner, "ext_ior": outer})
        return float(self.mi.traverse(plugin)["eta"])

    def _plastic(self, bsdf: Node) -> Fields:
        fields: Fields = {"model": "plastic", "nonlinear": bsdf.flag("nonlinear", False)}
        if bsdf.plugin == "roughplastic":
            self._note_beckmann(bsdf)
            fields |= {"model": "rough-plastic", "roughness": math.sqrt(min(max(bsdf.number("alpha", 0.1), 0.0), 1.0))}
        self._note_reflectance(bsdf)
        return fields | self._index(bsdf, "polypropylene")

    def _facets(self, bsdf: Node) -> Fields:
        """Their widths, α, as the roughness, whose square that is."""
        self._note_beckmann(bsdf)
        if not (bsdf.has("alpha_u") or bsdf.has("alpha_v")):
            return self._rough(self.textures.number(bsdf, "alpha", 0.1), root=True)
        along, across = (self.textures.number(bsdf, name, 0.1) for name in ("alpha_u", "alpha_v"))
        if along.texture is not None or across.texture is not None:
            self.notes.append(f"{bsdf.line}: textures of alpha_u and alpha_v, those of alpha_v for both")
            return self._rough(across, root=True)
        u, v = (min(max(value.number, 1e-4), 1.0) for value in (along, across))
        least, most = min(u, v), max(u, v)
        fields: Fields = {"roughness": math.sqrt(least)}
        if most > least:
            fields["anisotropy"] = math.sqrt((most - least) / (1 - least))
            fields["anisotropy_rotation_degrees"] = 0.0 if u > v else 90.0
        return fields

    def _note_reflectance(self, bsdf: Node) -> None:
        if self.textures.reflectance(bsdf, "specular_reflectance", 1.0) != Value(_WHITE):
            self.notes.append(f"{bsdf.line}: specular_reflectance of {bsdf.title}")

    def _note_beckmann(self, bsdf: Node) -> None:
        if bsdf.text("distribution", "beckmann") != "ggx":
            self.notes.append(f"{bsdf.line}: Beckmann's facets of {bsdf.title}, GGX's in their place")

    def _rough(self, value: Value, root: bool) -> Fields:
        """A roughness, or the ``root`` of a width."""
        number = min(max(value.number, 0.0), 1.0)
        if value.texture is None:
            return {"roughness": math.sqrt(number) if root else number}
        texture = mapped(value.texture, lambda pixels: np.sqrt(pixels[..., 0])) if root else value.texture
        return {"roughness": 1.0, "roughness_texture": texture}

    def _principled(self, bsdf: Node) -> tuple[Fields, bool]:
        color = self.textures.reflectance(bsdf, "base_color", 0.5)
        fields = self._rough(self.textures.number(bsdf, "roughness", 0.5), root=False)
        if bsdf.has("specular"):
            root = math.sqrt(0.08 * min(max(bsdf.number("specular", 0.5), 0.0), 1.0))
            fields["ior"] = (1 + root) / (1 - root)
        else:
            fields["ior"] = max(1.0, bsdf.number("eta", 1.5))
        is_thin = bsdf.plugin == "principledthin"
        transmitted = self.textures.number(bsdf, "spec_trans", 0.0).number
        if transmitted > 0:
            self.notes.append(f"{bsdf.line}: spec_trans of {bsdf.title}, all or nothing in its place")
        if transmitted > 0.5:
            fields |= {"model": "rough-thin-dielectric" if is_thin else "dielectric"}
            passed = mapped(t, lambda pixels: np.sqrt(pixels[..., :3])) if (t := color.texture) else None
            fields |= {"transmittance": tuple(map(math.sqrt, color.color)), "transmittance_texture": passed}
            return fields, False
        metallic = self.textures.number(bsdf, "metallic", 0.0)
        fields |= {"metallic": min(max(metallic.number, 0.0), 1.0), "metallic_texture": metallic.texture}
        anisotropic = self.textures.number(bsdf, "anisotropic", 0.0)
        if anisotropic.texture is None and anisotropic.number > 0:
            fields |= _brushed(fields["roughness"], min(anisotropic.number, 1.0))
        fields |= _as_bright(color, fields)
        if is_thin:
            share = min(max(self.textures.number(bsdf, "diff_trans", 0.0).number / 2, 0.0), 1.0)
            fields |= {"diffuse_transmission": share, "diffuse_transmission_color": color.color}
        elif (clearcoat := self.textures.number(bsdf, "clearcoat", 0.0).number) > 0:
            gloss = min(max(self.textures.number(bsdf, "clearcoat_gloss", 0.0).number, 0.0), 1.0)
            fields |= {"coat": min(0.25 * clearcoat, 1.0), "coat_roughness": math.sqrt(0.1 + (0.001 - 0.1) * gloss)}
        self.notes.append(f"{bsdf.line}: {bsdf.title}, a metallic-roughness material in its place")
        return fields, bool(color.attribute)


def _title(bsdf: Node) -> str:
    """What names a BSDF: its own, or what it wraps."""
    nested = bsdf.child("bsdf")
    return bsdf.id or (_title(nested) if nested is not None and bsdf.plugin in _WRAPPED else bsdf.plugin)


def _triple(values: Any) -> tuple[float, float, float]:
    r, g, b = np.broadcast_to(np.array(values, np.float64), 3).tolist()
    return (r, g, b)


def _brushed(roughness: float, anisotropic: float) -> Fields:
    """The facets of ``principled``: widths of α / a and α a, where a² is 1 - 0.9 ``anisotropic``."""
    aspect = math.sqrt(1 - 0.9 * anisotropic)
    along, across = (min(max(width, 1e-4), 1.0) for width in (roughness**2 / aspect, roughness**2 * aspect))
    return {"roughness": math.sqrt(across), "anisotropy": math.sqrt((along - across) / (1 - across))}


def _as_bright(color: Value, fields: Fields) -> Fields:
    """An albedo whose base is as bright as that of ``principled``, which loses nothing to the interface; the same where
    a texture says how much of it is a metal."""
    metallic, f0 = fields["metallic"], reflectance_from_ior(fields["ior"])
    passed = 1 - (f0 + (grazing_reflectance(f0) - f0) / 21)
    kept = 1.0 if fields["metallic_texture"] else metallic + (1 - metallic) * passed**2
    if color.texture is None:
        return {"albedo": tuple(min(1.0, channel / kept) for channel in color.color)}
    if kept == 1:
        return {"albedo": color.color, "albedo_texture": color.texture}
    brighter = mapped(color.texture, lambda pixels: np.minimum(pixels[..., :3] / kept, 1))
    return {"albedo": color.color, "albedo_texture": brighter}


def _with_alpha(albedo: Texture | None, opacity: Texture) -> Texture:
    """The texture ``albedo``, or white, with ``opacity`` as its alpha, at the higher resolution of the two."""
    alpha = np.clip(linear_pixels(opacity.image)[..., :1], 0, 1)
    if albedo is None:
        albedo = replace(opacity, image=Image(np.full((1, 1, 3), 255, np.uint8), "linear"))
    color = four_channels(albedo.image.pixels)[..., :3]
    size = max(alpha.shape[0], color.shape[0]), max(alpha.shape[1], color.shape[1])
    alpha = np.round(255 * alpha) if color.dtype == np.uint8 else alpha
    pixels = np.concatenate([_enlarged(color, size), _enlarged(alpha.astype(color.dtype), size)], axis=2)
    return replace(albedo, image=Image(pixels, albedo.image.color_space))


def _enlarged(pixels: Any, size: tuple[int, int]) -> Any:
    """Texels (h, w, channels), each repeated to ``size`` (rows, columns)."""
    rows, columns = (np.arange(n) * old // n for n, old in zip(size, pixels.shape[:2], strict=True))
    return pixels[rows][:, columns]
