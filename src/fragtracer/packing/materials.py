# SPDX-License-Identifier: MIT
"""Materials as records: their constant values, and what the shader needs where textures change them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fragtracer.packing.atlas import Atlas, build_atlas, mean_color
from fragtracer.packing.textures import texture_record
from fragtracer.scene import Material, Scene, Texture
from fragtracer.scene.material import TEXTURED
from fragtracer.shader_composer import CONSTANTS

MATERIAL_RECORDS = ("Material", "Maps", "Opacity", "Texture")


@dataclass(frozen=True, eq=False)
class PackedMaterials:
    """The records by kind, which features they need, and the images of their textures."""

    records: Mapping[str, list[dict[str, Any]]]
    defines: Mapping[str, int]
    atlas: Atlas


def has_colors(scene: Scene) -> bool:
    """Whether any vertex has a colour."""
    return any(part.geometry.colors is not None for mesh in scene.meshes for part in mesh.parts)


def has_one_sided_shapes(scene: Scene) -> bool:
    """Whether a shape other than a mesh is not there for rays from behind."""
    return any(not scene.materials[name].double_sided for name in _of_shapes(scene))


def _of_shapes(scene: Scene) -> set[str]:
    return {s.material for kind in (scene.spheres, scene.planes, scene.rectangles, scene.triangles) for s in kind}


def apart(scene: Scene, materials: Mapping[str, Material]) -> tuple[dict[str, Material], dict[str, str]]:
    """The materials to pack, those of shapes that have no texture coordinates without their textures; and
    for each material that meshes use the name of the one to pack, which is another where shapes use it too."""
    meshes = {mesh.material_of(part) for mesh in scene.meshes for part in mesh.parts}
    shapes = _of_shapes(scene)
    packed = {name: m if name in meshes - shapes else without_textures(m) for name, m in materials.items()}
    names = {name: name for name in meshes}
    for name in meshes & shapes:
        if materials[name].textures:
            names[name] = f"{name} on meshes"
            packed[names[name]] = materials[name]
    return packed, names


def without_textures(material: Material) -> Material:
    """What a surface without texture coordinates is made of."""
    none: dict[str, Any] = {f"{name}_texture": None for name in material.textures}
    return replace(material, **none) if none else material


def mean_emission(material: Material) -> tuple[float, float, float]:
    """Radiance that a surface with the whole emission texture on it has in the mean."""
    if not material.is_emissive:
        return (0.0, 0.0, 0.0)
    if material.emission_texture is None:
        return material.emission
    r, g, b = np.multiply(material.emission, mean_color(material.emission_texture.image)).tolist()
    return (r, g, b)


def plain_emission(material: Material) -> tuple[float, float, float]:
    """Radiance of a surface without textures, times the chance that it is there."""
    if not material.is_emissive:
        return (0.0, 0.0, 0.0)
    there = {"opaque": 1.0, "mask": float(material.opacity >= material.alpha_cutoff), "blend": material.opacity}
    r, g, b = (there[material.alpha_mode] * radiance for radiance in material.emission)
    return (r, g, b)


def pack_materials(materials: Iterable[Material], colored: bool, one_sided: bool = False) -> PackedMaterials:
    """Pack ``materials``. ``colored`` says that there are vertices with colours, which change them as well;
    ``one_sided`` that shapes are seen from one side alone, which only meshes see to themselves."""
    materials = list(materials)
    textures = list(dict.fromkeys(t for m in materials for t in m.textures.values()))
    atlas = build_atlas(texture.image for texture in textures)
    index = {texture: i for i, texture in enumerate(textures)}
    has_maps = bool(textures) or colored
    has_alpha = one_sided or any(m.alpha_mode != "opaque" for m in materials)
    records = {
        "Material": [_material(m) for m in materials],
        "Maps": [_maps(m, index) for m in materials] if has_maps else [],
        "Opacity": [_opacity(m, index) for m in materials] if has_alpha else [],
        "Texture": [texture_record(t, atlas.regions[t.image]) for t in textures],
    }
    used = {name for m in materials for name in m.textures}
    defines = {
        "HAS_MAPS": int(has_maps),
        "HAS_ALPHA": int(has_alpha),
        "HAS_UNLIT": int(any(m.unlit for m in materials)),
        "HAS_TEXTURES": int(bool(textures)),
        "HAS_BYTE_TEXTURES": int(len(atlas.bytes) > 0),
        "HAS_FLOAT_TEXTURES": int(len(atlas.floats) > 0),
        **{f"HAS_{name.upper()}_TEXTURE": int(name in used) for name in TEXTURED},
        "HAS_METALLIC_ROUGHNESS": int("metallic" in used and all(_share_texture(m) for m in materials)),
        **_lobes(materials),
    }
    return PackedMaterials(records, defines, atlas)


def _share_texture(material: Material) -> bool:
    """Whether roughness and metallic are channels of one texture, as in glTF, or neither has one."""
    rough, metal = material.roughness_texture, material.metallic_texture
    return rough == metal or (
        rough is not None and metal is not None and replace(rough, channel=metal.channel) == metal
    )


def _lobes(materials: Iterable[Material]) -> dict[str, int]:
    """What the reflection can consist of anywhere; textures lower the values they multiply, or raise them if floats."""
    lit = [m for m in materials if not m.unlit]
    specular = [m for m in lit if _specular_from(m) > 0]
    return {
        "HAS_DIFFUSE": int(any(_diffuse_from(m) > 0 for m in lit) or not specular),
        "HAS_SPECULAR": int(bool(specular)),
        "HAS_GLOSSY": int(any(m.alpha >= _ALPHA_DELTA or (m.alpha and m.roughness_texture) for m in specular)),
        "HAS_DELTA": int(any(m.alpha < _ALPHA_DELTA or m.roughness_texture for m in specular)),
    }


_ALPHA_DELTA = 1e-4  # of bsdf/cook_torrance.glsl


def _diffuse_from(material: Material) -> float:
    return max(material.base_color if material.metallic_texture else material.diffuse_albedo)


def _specular_from(material: Material) -> float:
    constant = max(*material.specular_f0, *material.specular_f90)
    return max(constant, material.specular) if material.metallic_texture else constant


def _material(material: Material) -> dict[str, Any]:
    if material.unlit:
        return {"emission": material.base_color, "unlit": 1}
    return {
        "diffuse": material.diffuse_albedo,
        "alpha": material.alpha,
        "f0": material.specular_f0,
        "f90": material.specular_f90,
        "emission": material.emission,
    }


def _maps(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    textures = material.textures
    dielectric = replace(material, metal=None, metallic=0.0)
    return {
        "albedo": material.base_color,
        "roughness": material.roughness,
        "dielectric_f0": dielectric.specular_f0,
        "metallic": material.metalness,
        "dielectric_f90": dielectric.specular_f90,
        "normal_scale": material.normal_scale,
        "occlusion_strength": material.occlusion_strength,
        **{f"{name}_texture": index[textures[name]] if name in textures else -1 for name in TEXTURED},
    }


def _opacity(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    return {
        "opacity": material.opacity,
        "mode": CONSTANTS[f"ALPHA_{material.alpha_mode.upper()}"],
        "cutoff": material.alpha_cutoff,
        "texture_index": index[material.albedo_texture] if material.albedo_texture else -1,
        "one_sided": int(not material.double_sided),
    }
