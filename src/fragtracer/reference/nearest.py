# SPDX-License-Identifier: MIT
"""The nearest materials that every Mitsuba has, for people who will not use our plugin."""

import math
from typing import Any

from fragtracer.reference.dielectrics import facets, is_rough_pane, nearest_rough_pane
from fragtracer.reference.materials import (
    has_images,
    has_null_transmission,
    is_lambert,
    is_own_plugin,
    is_plain,
    lambert,
    own_plugin,
)
from fragtracer.reference.meshes import MeshAttributes
from fragtracer.reference.plugins import DELTA_ALPHA, NAME, SURFACE, UNLIT
from fragtracer.reference.shapes import Tree, rgb
from fragtracer.reference.textures import TextureFolder
from fragtracer.scene import Material
from fragtracer.scene.material import MODELS


def nearest_bsdf(material: Material, geometry: str, attributes: MeshAttributes, textures: TextureFolder) -> Tree:
    """Mitsuba's own material nearest to ours; its geometry term is Smith's, uncorrelated, whatever ``geometry`` says.

    Rough dielectrics become ``principled``, since ``roughplastic`` loses light as it gets rougher: at
    alpha = 1 its base is less than half as bright as ours.
    """
    if material.unlit:
        inner: Tree = {"type": "diffuse", "reflectance": rgb((0, 0, 0))}
    elif is_rough_pane(material):
        inner = nearest_rough_pane(material)
    elif is_own_plugin(material):
        own = own_plugin(material)
        inner = own.get("bsdf", own)
    elif is_textured(material, attributes):
        inner = _textured(material, attributes, textures)
    elif is_lambert(material):
        inner = lambert(material)["bsdf"]
    else:
        inner = _untextured(material)
    is_passed = material.is_dielectric and not material.unlit
    tree = {"type": "twosided", "bsdf": inner} if material.double_sided and not is_passed else inner
    if material.alpha_mode == "opaque":
        return tree
    opacity: Any = float(material.opacity)
    if material.alpha_mode == "blend" and material.albedo_texture:
        opacity = textures.nearest(material.albedo_texture, "a", material.opacity)
    elif material.alpha_mode == "mask" and material.albedo_texture:
        opacity = textures.nearest(material.albedo_texture, "a") | {"filter_type": "nearest"}
    return {"type": "mask", "opacity": opacity, "bsdf": tree}


def is_textured(material: Material, attributes: MeshAttributes) -> bool:
    """Whether it varies over the surface."""
    return has_images(material) or attributes.color


def _untextured(material: Material) -> Tree:
    if material.metalness == 1:
        return _metal(material)
    if material.metalness == 0:
        return _dielectric(material)
    return {
        "type": "blendbsdf",
        "weight": material.metallic,
        "bsdf_0": _dielectric(material),
        "bsdf_1": _metal(material),
    }


def _textured(material: Material, attributes: MeshAttributes, textures: TextureFolder) -> Tree:
    """``principled``, its textures made of ours and the values that they multiply."""
    color: Tree = rgb(material.base_color)
    if material.albedo_texture:
        color = textures.nearest(material.albedo_texture, "color", material.base_color)
    elif attributes.color:
        color = {"type": "mesh_attribute", "name": "vertex_color"}
    tree: Tree = {"type": "principled", "base_color": color, "eta": _index(_mean_f0(material))}
    numbers = {
        "roughness": (material.roughness_texture, material.roughness),
        "metallic": (material.metallic_texture, material.metalness),
    }
    for name, (texture, value) in numbers.items():
        tree[name] = textures.nearest(texture, texture.channel, value) if texture else float(value)
    if material.normal_texture:
        return {"type": "normalmap", "normalmap": textures.nearest(material.normal_texture, "color"), "bsdf": tree}
    return tree


def _metal(material: Material) -> Tree:
    metal: Tree = {"type": "conductor", "material": "none", "specular_reflectance": rgb(material.base_color)}
    if material.alpha >= DELTA_ALPHA:
        metal |= {"type": "roughconductor", **facets(material)}
    return metal


def _dielectric(material: Material) -> Tree:
    """The dielectric part, its base made as bright as ours.

    Our base loses what the interface reflects, on the way in and out: on average (1 - F)² with
    F = F0 + (F90 - F0) / 21, Schlick's mean over the hemisphere. The base of ``principled`` loses next to
    nothing, that of ``plastic`` (1 - F)² / (1 - F) for its own F.
    """
    mean = _mean_f0(material)
    ior = _index(mean)
    passed = [1 - (f0 + (f90 - f0) / 21) for f0, f90 in zip(material.specular_f0, material.specular_f90, strict=True)]
    base = [c * p**2 for c, p in zip(material.albedo, passed, strict=True)]
    if material.alpha >= DELTA_ALPHA:
        return {"type": "principled", "base_color": rgb(base), "roughness": float(material.roughness), "eta": ior}
    lost = 1 - (mean + (1 - mean) / 21)
    base = [min(1.0, b / lost) for b in base]
    return {"type": "plastic", "int_ior": ior, "ext_ior": 1.0, "diffuse_reflectance": rgb(base)}


def _mean_f0(material: Material) -> float:
    """Reflectance at normal incidence of the dielectric part, all colours together, as Mitsuba can show it."""
    return min(max(material.specular * sum(material.dielectric_f0) / 3, 1e-6), 0.99)  # its index is to be above 1


def _index(f0: float) -> float:
    """The index of refraction whose reflectance at normal incidence is ``f0``."""
    return (1 + math.sqrt(f0)) / (1 - math.sqrt(f0))


def note(material: Material, geometry: str, plugin: bool, attributes: MeshAttributes) -> str:
    """What a material becomes in an exported scene, and how near that is."""
    if material.unlit:
        return (
            f"{UNLIT}, the same" if plugin else "area, nearly the same: emits from its front only, sampled as a light"
        )
    if is_rough_pane(material) and not plugin:
        return (
            "principledthin, nearly the same: the reflection of one interface in place of both, what is transmitted "
            "scattered less, facets of one width"
        )
    if is_own_plugin(material):
        lost = ["tangents"] * (material.anisotropy > 0) + ["colours"] * ("albedo" in MODELS[material.model])
        tree = own_plugin(material)
        same = f"{tree.get('bsdf', tree)['type']}, the same but for textures and {' and '.join([*lost, 'normals'])}"
        return "; ".join([f"{same} of vertices", *_holes(material)])
    if plugin and not is_plain(material, attributes):
        return f"{SURFACE}, the same"
    if not (plugin or is_plain(material, attributes)) and (
        is_textured(material, attributes) or has_null_transmission(material)
    ):
        return _textured_note(material, geometry)
    if is_lambert(material):
        return "diffuse, the same"
    if plugin:
        return f"{NAME}, the same"
    inner = _untextured(material)
    kinds = [child["type"] for child in (inner.get("bsdf_0", inner), inner.get("bsdf_1")) if child]
    differs = []
    if "plastic" in kinds:
        differs.append("the exact Fresnel term in place of Schlick's")
    if "principled" in kinds:
        differs.append("the exact Fresnel term in place of Schlick's, a base brighter towards grazing")
    if kinds[-1].endswith("conductor"):
        differs.append("a metal of the same reflectance at every angle, no rise towards grazing")
    if material.anisotropy:
        differs.append("facets of two widths on metals alone, turned as Mitsuba's shapes have their tangents")
    if material.diffuse_factor == "half-vector":
        differs.append("a base without the factor of the half vector")
    if geometry != "smith":
        differs.append(f"Smith's uncorrelated geometry term in place of {geometry}")
    return f"{' and '.join(kinds)}, nearly the same: {'; '.join(differs)}"


def _holes(material: Material) -> list[str]:
    found = ["edges of holes by unfiltered opacity"] if material.alpha_mode == "mask" else []
    return found + ["shadows of holes need the integrator volpath, which is set"] * (material.alpha_mode != "opaque")


def _textured_note(material: Material, geometry: str) -> str:
    differs = ["a base without the factor of the half vector"]
    if material.diffuse_factor == "interface":
        differs = ["a base brighter towards grazing"]
    if material.normal_texture:
        differs.append("a normal map whose green is inverted where the image is mirrored")
    differs += _holes(material)
    if geometry != "smith":
        differs.append(f"Smith's uncorrelated geometry term in place of {geometry}")
    return f"principled, nearly the same: {'; '.join(differs)}"
