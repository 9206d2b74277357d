# SPDX-License-Identifier: MIT
"""Says fragtracer's materials in the words of our own plugins, and what shines in those of Mitsuba's lights."""

from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.errors import FragtracerError
from fragtracer.reference.bsdf import NAME, SURFACE, UNLIT
from fragtracer.reference.meshes import Traits
from fragtracer.reference.shapes import Tree
from fragtracer.reference.textures import TextureFolder
from fragtracer.scene import Image, Material, RenderSettings, Texture

_WHITE = Image([[1.0]], "linear")


def rgb(color: Any) -> Tree:
    """A colour, linear Rec. 709."""
    return {"type": "rgb", "value": [float(c) for c in color]}


def is_lambert(material: Material) -> bool:
    """Whether the material has no specular lobe at all."""
    return max(*material.specular_f0, *material.specular_f90) == 0


def lambert(material: Material) -> Tree:
    """Mitsuba's own diffuse material."""
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(material.diffuse_albedo)}}


def is_plain(material: Material, traits: Traits) -> bool:
    """Whether the material is alike at all points of a mesh, opaque, and without shading normals."""
    return not (has_images(material) or traits != Traits(uv=traits.uv) or passes(material))


def has_images(material: Material) -> bool:
    """Whether images change how the material scatters."""
    return not material.textures.keys().isdisjoint(("albedo", "roughness", "metallic", "normal"))


def passes(material: Material) -> bool:
    """Whether rays may pass the surface as if it was not there."""
    return material.alpha_mode != "opaque" or not material.double_sided


def geometry_term(settings: RenderSettings) -> str:
    """What the plugins call the geometry term, and what it does with light scattered more than once."""
    return "smith-multiple-scattering" if settings.multiple_scattering else settings.geometry


def exact_bsdf(material: Material, geometry: str, traits: Traits, textures: TextureFolder) -> Tree:
    """The same material: Mitsuba's ``diffuse`` where that is exact, our plugins elsewhere."""
    if material.unlit:
        black = replace(material, albedo=(0.0, 0.0, 0.0), metal=None, metallic=0.0, specular=0.0)
        return surface(black, geometry, traits, textures) if passes(material) else lambert(black)
    if not is_plain(material, traits):
        return surface(material, geometry, traits, textures)
    if is_lambert(material):
        return lambert(material)
    return {
        "type": NAME,
        "diffuse_albedo": list(material.diffuse_albedo),
        "specular_f0": list(material.specular_f0),
        "specular_f90": list(material.specular_f90),
        "alpha": float(material.alpha),
        "geometry": geometry,
    }


def surface(material: Material, geometry: str, traits: Traits, textures: TextureFolder) -> Tree:
    """The plugin for what varies over a mesh; a metal of a name is one whose albedo is its reflectance."""
    tree: Tree = {
        "type": SURFACE,
        "albedo": list(material.base_color),
        "metallic": float(material.metalness),
        "roughness": float(material.roughness),
        "specular": float(material.specular),
        "dielectric_f0": list(material.dielectric_f0),
        "geometry": geometry,
        "opacity": float(material.opacity),
        "alpha_mode": material.alpha_mode,
        "alpha_cutoff": float(material.alpha_cutoff),
        "double_sided": material.double_sided,
        "normal_scale": float(material.normal_scale),
    }
    images: dict[str, tuple[Texture | None, Any]] = {
        "albedo": (material.albedo_texture, "color"),
        "alpha": (material.albedo_texture if material.alpha_mode != "opaque" else None, "a"),
        "roughness": (t := material.roughness_texture, t and t.channel),
        "metallic": (t := material.metallic_texture, t and t.channel),
        "normal": (material.normal_texture, "color"),
    }
    for name, (texture, use) in images.items():
        if texture:
            tree[f"{name}_texture"] = textures.exact(texture, use)
            tree[f"{name}_set"] = traits.set_of(texture.coordinates)
    return tree | {f"has_{name}": True for name in ("shading", "tangent", "color", "alpha") if getattr(traits, name)}


def emitter_of(material: Material, traits: Traits, textures: TextureFolder, exact: bool) -> Tree | None:
    """What makes a surface shine. Mitsuba's own area light, the nearest to one that is unlit, shines to the front."""
    if material.unlit and exact:
        return surface(material, "smith", traits, textures) | {"type": UNLIT}
    if material.unlit:
        color, texture = material.base_color, material.albedo_texture
        return {"type": "area", "radiance": textures.nearest(texture, "color", color) if texture else rgb(color)}
    return {"type": "area", "radiance": _radiance(material, traits, textures, exact)} if material.is_emissive else None


def _radiance(material: Material, traits: Traits, textures: TextureFolder, exact: bool) -> Tree:
    """What an emissive surface sends out; of one that is partly there, what its points send out on average.

    Raises
    ------
    FragtracerError
        If points of a light do not know how much of it is there.
    """
    texture, lace = material.emission_texture, material.albedo_texture
    if material.alpha_mode == "opaque" or not (lace or traits.alpha):
        opacity = {"opaque": 1.0, "blend": material.opacity, "mask": float(material.opacity >= material.alpha_cutoff)}
        emission = np.multiply(material.emission, opacity[material.alpha_mode])
        if texture is None:
            return rgb(emission)
        return (textures.exact if exact else textures.nearest)(texture, "color", emission)
    if traits.alpha or not exact or (texture and lace and texture.coordinates != lace.coordinates):
        raise FragtracerError(
            "Mitsuba cannot show a material that emits light and has holes (alpha_mode) unless by fragtracer's plugin, "
            "its alpha in a texture with the coordinates of emission_texture and none in the colours of vertices"
        )
    assert lace is not None
    tree = textures.exact(texture or Texture(_WHITE), "color", material.emission)
    names = ("opacity", "alpha_mode", "alpha_cutoff")
    return tree | {"alpha": textures.exact(lace, "a")} | {name: getattr(material, name) for name in names}
