# SPDX-License-Identifier: MIT
"""Translates materials to our own Mitsuba plugins, and what emits to Mitsuba's area lights."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.errors import FragtracerError
from fragtracer.reference.dielectrics import conductor_bsdf, dielectric_bsdf, facets, plastic_bsdf
from fragtracer.reference.meshes import MeshAttributes
from fragtracer.reference.plugins import BLEND, NAME, ONE_SIDED, SURFACE, UNLIT
from fragtracer.reference.shapes import Tree, rgb
from fragtracer.reference.textures import TextureFolder, opacity_at
from fragtracer.scene import Image, Material, RenderSettings, Texture
from fragtracer.scene.fields import Triple
from fragtracer.scene.material import DEFAULT_MODEL, MODELS
from fragtracer.scene.texture import linear_pixels

_FILM = ("iridescence", "iridescence_ior", "iridescence_thickness")
_WHITE = Image([[1.0]], "linear")
OR_NEAREST = "or take the nearest that Mitsuba has, which export-mitsuba writes without --plugin"


def is_lambert(material: Material) -> bool:
    """Whether the material is an opaque Lambert base without a specular lobe, a coat, a sheen and a film."""
    reflectance = max(*material.specular_f0, *material.specular_f90)
    is_layered = material.is_coated or material.has_sheen or material.has_iridescence
    is_bare = not (is_layered or material.is_translucent)
    return material.model == DEFAULT_MODEL and reflectance == 0 and is_bare


def lambert(material: Material) -> Tree:
    """Mitsuba's own diffuse material."""
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(material.diffuse_albedo)}}


def is_plain(material: Material, attributes: MeshAttributes) -> bool:
    """Whether the material is of the default model, uniform, opaque, double-sided and without shading normals."""
    return material.model == DEFAULT_MODEL and not (
        has_images(material)
        or attributes != MeshAttributes(uv=attributes.uv, bare=attributes.bare)
        or has_null_transmission(material)
    )


def is_own_plugin(material: Material) -> bool:
    """Whether a plugin serves for the model alone: Mitsuba's own, or that of rough panes."""
    return material.is_dielectric or material.model in ("conductor", "plastic", "rough-plastic")


def own_plugin(material: Material) -> Tree:
    """That plugin; a dielectric lies in air."""
    if material.is_dielectric:
        return dielectric_bsdf(material, None)
    return conductor_bsdf(material) if material.model == "conductor" else plastic_bsdf(material)


def has_images(material: Material) -> bool:
    """Whether images change how the material scatters."""
    layers = ["coat", "coat_roughness"] * material.is_coated + ["sheen_color", "sheen_roughness"] * material.has_sheen
    layers += ["iridescence", "iridescence_thickness"] * material.has_iridescence
    layers += ["diffuse_transmission", "diffuse_transmission_color"] * material.is_translucent
    return not material.textures.keys().isdisjoint(
        ("albedo", "roughness", "metallic", "normal", "transmittance", "anisotropy", *layers)
    )


def has_null_transmission(material: Material) -> bool:
    """Whether rays may pass through the surface unchanged: it has alpha, or its back faces are culled."""
    return material.is_pane or material.alpha_mode != "opaque" or not material.double_sided


def geometry_term(settings: RenderSettings) -> str:
    """The plugins' name of the geometry term, with or without multiple scattering."""
    return "smith-multiple-scattering" if settings.multiple_scattering else settings.geometry


def exact_bsdf(material: Material, geometry: str, attributes: MeshAttributes, textures: TextureFolder) -> Tree:
    """The same material: Mitsuba's ``diffuse`` where that is exact, our plugins elsewhere."""
    if material.unlit:
        black = _unlit_as_lambert(material, (0.0, 0.0, 0.0))
        return surface(black, geometry, attributes, textures) if has_null_transmission(material) else lambert(black)
    if (is_own_plugin(material) or material.anisotropy) and not material.double_sided:
        front = exact_bsdf(replace(material, double_sided=True), geometry, attributes, textures)
        return {"type": ONE_SIDED, "bsdf": front}
    if material.black_back:
        front = exact_bsdf(replace(material, black_back=False), geometry, attributes, textures)
        return front["bsdf"] if front["type"] == "twosided" else {"type": ONE_SIDED, "bsdf": front, "passes": False}
    if material.anisotropy and (
        material.anisotropy_rotation_degrees % 90
        or not (is_own_plugin(material) or is_plain(material, attributes))
        or (has_images(material) or attributes.shading or attributes.tangent)
    ):
        raise FragtracerError(
            "Mitsuba shows anisotropy exactly only in quarters of a turn, opaque, and without textures and attributes "
            f"of vertices; leave these out, {OR_NEAREST}"
        )
    if is_own_plugin(material):
        if material.dispersion:
            raise FragtracerError(
                "Mitsuba's RGB variants know no wavelengths, and no dispersion; leave abbe_number out"
            )
        is_colored = attributes.color and "albedo" in MODELS[material.model]
        if attributes.shading or is_colored or has_images(material) or material.alpha_mode != "opaque":
            raise FragtracerError(
                f"Mitsuba shows model = {material.model!r} exactly only without textures, normals and colours of "
                f"vertices, and alpha; leave these out, {OR_NEAREST}"
            )
        return own_plugin(material)
    if not is_plain(material, attributes):
        return surface(material, geometry, attributes, textures)
    if is_lambert(material):
        return lambert(material)
    tree: Tree = {
        "type": NAME,
        "diffuse_albedo": list(material.diffuse_albedo),
        "specular_f0": list(material.specular_f0),
        "specular_f90": list(material.specular_f90),
        "alpha": float(material.alpha),
        "geometry": geometry,
        "diffuse_factor": material.diffuse_factor,
        **{name: width for name, width in facets(material).items() if name.startswith("alpha_")},
    }
    if material.is_coated:
        tree |= {name: float(getattr(material, name)) for name in ("coat", "coat_f0", "coat_alpha")}
    if material.has_iridescence:
        tree |= {name: float(getattr(material, name)) for name in _FILM}
    if material.is_translucent:
        transmitted = [(1 - material.metalness) * channel for channel in material.diffuse_transmission_color]
        tree |= {
            "diffuse_transmission": float(material.diffuse_transmission),
            "diffuse_transmission_albedo": transmitted,
        }
    return tree | _sheen(material)


def _sheen(material: Material) -> Tree:
    """The parameters of the plugins for the sheen, as far as there is one."""
    if not material.has_sheen:
        return {}
    return {"sheen_color": list(material.sheen_color), "sheen_roughness": float(material.sheen_roughness)}


def _unlit_as_lambert(material: Material, albedo: Triple) -> Material:
    """A Lambert material of another albedo where the unlit ``material`` is met, whatever its model is."""
    met = {name: getattr(material, name) for name in ("opacity", "alpha_mode", "alpha_cutoff", "double_sided")}
    return Material(albedo=albedo, specular=0.0, albedo_texture=material.albedo_texture, **met)


def blended_bsdf(
    material: Material, parts: Sequence[Tree], attributes: MeshAttributes, textures: TextureFolder, exact: bool
) -> Tree:
    """The blend of two: of ``material`` itself, and of that which it is blended with; by Mitsuba's own ``blendbsdf``
    unless it is to be ``exact``."""
    weight, texture = material.blend_weight, material.blend_weight_texture
    if material.alpha_mode != "opaque" or (exact and not material.double_sided):
        raise FragtracerError(
            "Mitsuba shows a blend of materials only where nothing has alpha, and exactly only from both sides; leave "
            "alpha_mode, double_sided or blend out"
        )
    if exact and texture and texture.coordinates != attributes.uv:
        raise FragtracerError(
            "Mitsuba looks blend_weight_texture up at the coordinates of what emits, or else at the first ones; give "
            f"the texture these, {OR_NEAREST}"
        )
    kind = BLEND if exact else "blendbsdf"
    tree: Tree = {"type": kind, "bsdf_0": parts[0], "bsdf_1": parts[1], "weight": float(weight)}
    if texture and exact:
        tree["weight_texture"] = textures.exact(texture, texture.channel)
    elif texture:
        tree["weight"] = textures.nearest(texture, texture.channel, weight)
    return tree


def surface(material: Material, geometry: str, attributes: MeshAttributes, textures: TextureFolder) -> Tree:
    """The plugin for a material that varies over a mesh; of a named metal the albedo is its reflectance."""
    tree: Tree = {
        "type": SURFACE,
        "model": material.model,
        "albedo": list(material.base_color),
        "metallic": float(material.metalness),
        "roughness": float(material.roughness),
        "specular": float(material.specular),
        "dielectric_f0": list(material.dielectric_f0),
        "geometry": geometry,
        "diffuse_factor": material.diffuse_factor,
        "opacity": float(material.opacity),
        "alpha_mode": material.alpha_mode,
        "alpha_cutoff": float(material.least_alpha),
        "double_sided": material.double_sided,
        "normal_scale": float(material.normal_scale),
    }
    if material.is_coated:
        numbers = ("coat", "coat_f0", "coat_roughness", "coat_normal_scale")
        tree |= {name: float(getattr(material, name)) for name in numbers}
    if material.has_iridescence:
        tree |= {name: float(getattr(material, name)) for name in (*_FILM, "iridescence_thickness_minimum")}
    if material.is_translucent:
        tree |= {
            "diffuse_transmission": float(material.diffuse_transmission),
            "diffuse_transmission_color": list(material.diffuse_transmission_color),
        }
    tree |= _sheen(material)
    images: dict[str, tuple[Texture | None, Any]] = {
        "albedo": (material.albedo_texture, "color"),
        "alpha": (material.albedo_texture if material.alpha_mode != "opaque" else None, "a"),
        "roughness": (t := material.roughness_texture, t and t.channel),
        "metallic": (t := material.metallic_texture, t and t.channel),
        "coat": (t := material.coat_texture if material.is_coated else None, t and t.channel),
        "coat_roughness": (t := material.coat_roughness_texture if material.is_coated else None, t and t.channel),
        "coat_normal": (material.coat_normal_texture if material.is_coated else None, "color"),
        "sheen_color": (material.sheen_color_texture if material.has_sheen else None, "color"),
        "sheen_roughness": (t := material.sheen_roughness_texture if material.has_sheen else None, t and t.channel),
        "iridescence": (t := material.iridescence_texture if material.has_iridescence else None, t and t.channel),
        "iridescence_thickness": (
            t := material.iridescence_thickness_texture if material.has_iridescence else None,
            t and t.channel,
        ),
        "diffuse_transmission": (
            t := material.diffuse_transmission_texture if material.is_translucent else None,
            t and t.channel,
        ),
        "diffuse_transmission_color": (
            material.diffuse_transmission_color_texture if material.is_translucent else None,
            "color",
        ),
        "normal": (material.normal_texture, "color"),
    }
    for name, (texture, use) in images.items():
        if texture:
            tree[f"{name}_texture"] = textures.exact(texture, use)
            tree[f"{name}_set"] = attributes.set_of(texture.coordinates)
    return tree | {
        f"has_{name}": True for name in ("shading", "tangent", "color", "alpha") if getattr(attributes, name)
    }


def emitter_of(material: Material, attributes: MeshAttributes, textures: TextureFolder, exact: bool) -> Tree | None:
    """The emitter of a surface, None where it emits nothing.

    Mitsuba's own ``area`` light, the nearest to an unlit material, emits from the front only.
    """
    if material.unlit and exact:
        shown = _unlit_as_lambert(material, material.base_color)
        return surface(shown, "smith", attributes, textures) | {"type": UNLIT}
    if material.unlit:
        return {"type": "area", "radiance": _unlit_radiance(material, textures)}
    if not material.is_emissive:
        return None
    return {"type": "area", "radiance": _radiance(material, attributes, textures, exact)}


def _unlit_radiance(material: Material, textures: TextureFolder) -> Tree:
    """The colour of an unlit material, times its opacity but for the alpha of vertices."""
    texture = material.albedo_texture
    if texture is None:
        return rgb(np.multiply(material.base_color, opacity_at(material, 1.0)))
    if material.alpha_mode != "opaque":
        pixels = linear_pixels(texture.image)
        shown = pixels[..., :3] * opacity_at(material, pixels[..., 3:])
        texture = replace(texture, image=Image(shown, "linear"))
    return textures.nearest(texture, "color", material.base_color)


def _radiance(material: Material, attributes: MeshAttributes, textures: TextureFolder, exact: bool) -> Tree:
    """The emitted radiance, times the opacity where the surface has alpha.

    Raises
    ------
    FragtracerError
        If the opacity of an emissive surface cannot be looked up where its emission is.
    """
    texture, alpha = material.emission_texture, material.albedo_texture
    if material.alpha_mode == "opaque" or not (alpha or attributes.alpha):
        emission = np.multiply(material.emission, opacity_at(material, 1.0))
        if texture is None:
            return rgb(emission)
        return (textures.exact if exact else textures.nearest)(texture, "color", emission)
    if attributes.alpha or not exact or (texture and alpha and texture.coordinates != alpha.coordinates):
        raise FragtracerError(
            "Mitsuba cannot show a material that emits light and has holes (alpha_mode) unless by fragtracer's plugin, "
            "its alpha in a texture with the coordinates of emission_texture and none in the colours of vertices"
        )
    assert alpha is not None
    tree = textures.exact(texture or Texture(_WHITE), "color", material.emission)
    return tree | {
        "alpha": textures.exact(alpha, "a"),
        "opacity": material.opacity,
        "alpha_mode": material.alpha_mode,
        "alpha_cutoff": material.least_alpha,
    }
