# SPDX-License-Identifier: MIT
"""The nearest materials that every Mitsuba has, for people who will not use our plugin."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.reference.dielectrics import facets, is_rough_pane, nearest_rough_pane
from fragtracer.reference.materials import has_images, is_lambert, is_own_plugin, own_plugin
from fragtracer.reference.meshes import VERTEX_COLORS, MeshAttributes
from fragtracer.reference.plugins import DELTA_ALPHA, UNLIT
from fragtracer.reference.shapes import Tree, rgb
from fragtracer.reference.textures import TextureFolder, opacity_at
from fragtracer.scene import Image, Material, Texture
from fragtracer.scene.material import DEFAULT_MODEL, MODELS
from fragtracer.scene.texture import linear_pixels


def nearest_bsdf(
    material: Material, attributes: MeshAttributes, textures: TextureFolder, vertex_color: str = VERTEX_COLORS[0]
) -> Tree:
    """Mitsuba's own material nearest to ours; its geometry term is Smith's, uncorrelated.

    Rough dielectrics become ``principled``, since ``roughplastic`` loses light as it gets rougher: at
    alpha = 1 its base is less than half as bright as ours. Coat, sheen and film are left away: ``principled`` has
    no film, its coat and sheen have other facets, and the coat a fixed index. What transmits diffusely is blended with
    what does nothing else. ``vertex_color`` names the colours of vertices, times the albedo.
    """
    whole, material = material, _bare(material)
    if material.unlit:
        inner: Tree = {"type": "diffuse", "reflectance": rgb((0, 0, 0))}
    elif is_rough_pane(material):
        inner = nearest_rough_pane(material)
    elif is_own_plugin(material):
        own = own_plugin(material)
        inner = own.get("bsdf", own)
    elif _is_diffuse(material) or has_images(material) or attributes.color:
        inner = _textured(with_base_as_bright(material), attributes, textures, vertex_color)
    else:
        inner = _untextured(material)
    is_passed = material.is_dielectric and not material.unlit
    is_two_sided = material.double_sided and not (is_passed or material.black_back)
    tree = {"type": "twosided", "bsdf": inner} if is_two_sided else inner
    if whole.is_translucent:
        tree = _translucent(whole, tree, textures)
    if material.alpha_mode == "opaque":
        return tree
    return {"type": "mask", "opacity": _opacity(material, attributes, textures), "bsdf": tree}


def _opacity(material: Material, attributes: MeshAttributes, textures: TextureFolder) -> Any:
    texture = material.albedo_texture
    if texture and material.alpha_mode == "blend":
        return textures.nearest(texture, "a", material.opacity)
    if texture:
        shown = opacity_at(material, linear_pixels(texture.image)[..., 3])
        image = Image((255 * shown).astype(np.uint8), "linear")
        return textures.nearest(replace(texture, image=image, filter="nearest"), "r")
    if attributes.alpha:
        return {"type": "mesh_attribute", "name": "vertex_alpha"}
    return float(opacity_at(material, 1.0))


def _is_diffuse(material: Material) -> bool:
    """Whether it has no specular lobe."""
    return material.model == "eon" or is_lambert(_bare(material))


def _bare(material: Material) -> Material:
    """Without what lies over the base and what passes it."""
    return replace(material, coat=0.0, sheen_color=(0.0, 0.0, 0.0), iridescence=0.0, diffuse_transmission=0.0)


def _translucent(material: Material, rest: Tree, textures: TextureFolder) -> Tree:
    """The ``rest`` of a material, blended with ``principledthin`` that transmits all diffusely."""
    passed = [(1 - material.metalness) * p**2 for p in _passed(material)]
    shown = np.multiply(material.diffuse_transmission_color, passed)
    color, factor = material.diffuse_transmission_color_texture, material.diffuse_transmission_texture
    thin: Tree = {"type": "principledthin", "diff_trans": 2.0, "roughness": 1.0}
    thin["base_color"] = textures.nearest(color, "color", shown) if color else rgb(shown)
    weight: Any = material.diffuse_transmission
    weight = textures.nearest(factor, factor.channel, weight) if factor else float(weight)
    return {"type": "blendbsdf", "weight": weight, "bsdf_0": rest, "bsdf_1": thin}


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


def _textured(material: Material, attributes: MeshAttributes, textures: TextureFolder, vertex_color: str) -> Tree:
    """``principled``, or ``diffuse``, its textures made of ours and the values that they multiply."""
    color: Tree = rgb(material.base_color)
    if material.albedo_texture:
        color = textures.nearest(material.albedo_texture, "color", material.base_color)
    elif attributes.color:
        color = {"type": "mesh_attribute", "name": vertex_color}
    tree: Tree = {"type": "diffuse", "reflectance": color}
    if not _is_diffuse(material):
        tree = {"type": "principled", "base_color": color, "eta": _index(_mean_f0(material))}
        numbers = {
            "roughness": (material.roughness_texture, material.roughness),
            "metallic": (material.metallic_texture, material.metalness),
        }
        for name, (texture, value) in numbers.items():
            tree[name] = textures.nearest(texture, texture.channel, value) if texture else float(value)
    if material.normal_texture:
        normals = _scaled(material.normal_texture, material.normal_scale)
        return {"type": "normalmap", "normalmap": textures.nearest(normals, "color"), "bsdf": tree}
    return tree


def with_base_as_bright(material: Material) -> Material:
    """One that ``principled`` shows about as bright as ours, whose base loses what the interface reflects; the same
    where a texture says how much of it is a metal, since the albedo is that of both."""
    if material.model != DEFAULT_MODEL or material.metal or material.unlit or _is_diffuse(material):
        return material
    if _is_metal_in_places(material):
        return material
    kept = [m + (1 - m) * p**2 for m, p in zip([material.metallic] * 3, _passed(material), strict=True)]
    red, green, blue = np.multiply(material.albedo, kept)
    return replace(material, albedo=(red, green, blue))


def _is_metal_in_places(material: Material) -> bool:
    return material.metallic_texture is not None and material.metalness > 0


def _passed(material: Material) -> list[float]:
    """What the interface lets through of diffuse light, by Schlick's mean over the hemisphere,
    F = F0 + (F90 - F0) / 21."""
    return [1 - (f0 + (f90 - f0) / 21) for f0, f90 in zip(material.specular_f0, material.specular_f90, strict=True)]


def _scaled(normals: Texture, scale: float) -> Texture:
    """A normal map, x and y of its vectors times ``scale``, which ``normalmap`` does not have.

    They are not made unit vectors, so that those that are filtered between texels lean alike; all become shorter where
    texels could not hold them.
    """
    if scale == 1:
        return normals
    factors = np.array([scale, scale, 1.0]) / max(1.0, abs(scale))
    texels = 0.5 + (linear_pixels(normals.image)[..., :3] - 0.5) * factors
    return replace(normals, image=Image(texels, "linear"))


def _metal(material: Material) -> Tree:
    metal: Tree = {"type": "conductor", "material": "none", "specular_reflectance": rgb(material.base_color)}
    if material.alpha >= DELTA_ALPHA:
        metal |= {"type": "roughconductor", **facets(material)}
    return metal


def _dielectric(material: Material) -> Tree:
    """The dielectric part, its base made as bright as ours.

    Our base loses what the interface reflects, on the way in and out. That of ``principled`` loses next to nothing,
    that of ``plastic`` as much on one of them, by its own F.
    """
    mean = _mean_f0(material)
    ior = _index(mean)
    base = [c * p**2 for c, p in zip(material.albedo, _passed(material), strict=True)]
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


def note(
    material: Material, geometry: str, plugin: bool, attributes: Sequence[MeshAttributes], trees: Sequence[Tree]
) -> str:
    """What a material becomes in an exported scene, and how near that is.

    ``attributes`` are those of each mesh that has it, and ``trees`` what it is there, without its blend.
    """
    kinds = ["area"] if material.unlit else list(dict.fromkeys(kind for tree in trees for kind in _kinds(tree)))
    if plugin:
        return f"{UNLIT if material.unlit else ' and '.join(kinds)}, the same"
    differs = _differences(material, geometry, attributes, kinds)
    if is_own_plugin(material) and not (material.unlit or is_rough_pane(material)):
        lost = ["tangents"] * (material.anisotropy > 0) + ["colours"] * ("albedo" in MODELS[material.model])
        same = f"the same but for textures and {' and '.join([*lost, 'normals'])} of vertices"
        return "; ".join([f"{' and '.join(kinds)}, {same}", *differs])
    return f"{' and '.join(kinds)}, " + (f"nearly the same: {'; '.join(differs)}" if differs else "the same")


def _kinds(tree: Tree) -> list[str]:
    """The types of what scatters, in what is around it."""
    inner = [tree[name] for name in ("bsdf", "bsdf_0", "bsdf_1") if name in tree]
    return [kind for child in inner for kind in _kinds(child)] or [tree["type"]]


def _differences(
    material: Material, geometry: str, attributes: Sequence[MeshAttributes], kinds: Sequence[str]
) -> list[str]:
    """How Mitsuba's own material, of these ``kinds``, differs from ours."""
    found = []
    if material.unlit:
        found.append("emits from its front only, sampled as a light")
    elif is_rough_pane(material):
        found.append(
            "the reflection of one interface in place of both, what is transmitted scattered less, facets of one width"
        )
    elif is_own_plugin(material):
        found += ["without dispersion"] * (material.dispersion > 0)
    elif _is_diffuse(material):
        if material.model == "eon" and material.roughness > 0:
            found.append("Lambert's model in place of Oren and Nayar's, up to a fifth brighter on average")
    else:
        found += _specular_differences(material, geometry, kinds)
    found += ["without its coat"] * material.is_coated + ["without its sheen"] * material.has_sheen
    found += ["without its film"] * material.has_iridescence
    found += ["a specular lobe weaker by the share that is transmitted"] * material.is_translucent
    if material.normal_texture and not material.unlit and not is_own_plugin(material):
        found.append("a normal map whose green is inverted where the image is mirrored")
    if not material.double_sided:
        found.append("back faces are black, not passed")
    return [*found, *_vertices_and_holes(material, attributes)]


def _specular_differences(material: Material, geometry: str, kinds: Sequence[str]) -> list[str]:
    found = []
    is_metal = any(kind.endswith("conductor") for kind in kinds)
    if "principled" in kinds:
        found.append("the exact Fresnel term in place of Schlick's, a base brighter towards grazing")
        if _is_metal_in_places(material):
            passed = min(_passed(replace(material, metallic=0.0)))
            found.append(f"a base {100 * (1 / passed**2 - 1):.0f} % brighter")
    elif "plastic" in kinds:
        found.append("the exact Fresnel term in place of Schlick's")
    if is_metal:
        found.append("a metal of the same reflectance at every angle, no rise towards grazing")
    if material.anisotropy and is_metal:
        found.append("facets of two widths on metals alone, turned as Mitsuba's shapes have their tangents")
    elif material.anisotropy:
        found.append("facets of one width")
    if material.diffuse_factor == "half-vector":
        found.append("a base without the factor of the half vector")
    if geometry != "smith":
        found.append(f"Smith's uncorrelated geometry term in place of {geometry}")
    return found


def _vertices_and_holes(material: Material, attributes: Sequence[MeshAttributes]) -> list[str]:
    """What is lost of the attributes of vertices, and how holes differ."""
    texture, found = material.albedo_texture, []
    has_color, has_alpha = any(a.color for a in attributes), any(a.alpha for a in attributes)
    if has_color and (material.unlit or (texture and not is_own_plugin(material))):
        found.append("without the colours of vertices")
    if has_alpha and texture:
        found.append("without the alpha of vertices")
    elif has_alpha and material.unlit:
        found.append("emits through their alpha")
    if material.alpha_mode == "mask" and texture:
        found.append("edges of holes by unfiltered opacity")
    elif material.alpha_mode == "mask" and has_alpha:
        found.append("edges of holes fade from vertex to vertex")
    return found + ["shadows of holes need the integrator volpath, which is set"] * (material.alpha_mode != "opaque")
