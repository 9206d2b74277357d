# SPDX-License-Identifier: MIT
"""Materials and their textures as records of shaders/scene/{material,texture}.glsl."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fragtracer.packing.atlas import Atlas, Region, build_atlas, mean_color
from fragtracer.packing.records import BsdfModel
from fragtracer.scene import SHAPES, Material, Scene, Texture
from fragtracer.scene.material import DEFAULT_MODEL, TEXTURED

_ALPHA_DELTA = 1e-4  # of bsdf/cook_torrance.glsl
_ALPHA_MODES = ("opaque", "mask", "blend")
_WRAP_MODES = ("repeat", "mirror", "clamp")
TEXTURE_NEAREST = 4
# What textures change, as in scene/texture.glsl.
_USES = {"albedo": 1, "roughness": 2, "metallic": 4, "normal": 8, "occlusion": 16, "emission": 32}


@dataclass(frozen=True, eq=False)
class PackedMaterials:
    """Records by kind, features, flags (uniforms that say what kinds of things there are), and the images of textures.

    ``of_shapes`` and ``of_meshes`` are the numbers of materials by name: those of shapes, which have no texture
    coordinates, leave the textures out.
    """

    records: Mapping[str, list[dict[str, Any]]]
    features: Mapping[str, int]
    flags: Mapping[str, int]
    atlas: Atlas
    of_shapes: Mapping[str, int]
    of_meshes: Mapping[str, int]


def pack_materials(scene: Scene, materials: Mapping[str, Material]) -> PackedMaterials:
    """Pack ``materials``, those of ``scene`` and of its lights."""
    packed, of_shapes, of_meshes = _apart(scene, materials)
    textured = [m for m in packed if m.textures]
    textures = list(dict.fromkeys(t for m in textured for t in m.textures.values()))
    atlas = build_atlas(texture.image for texture in textures)
    index = {texture: i for i, texture in enumerate(textures)}
    colored = any(part.geometry.colors is not None for mesh in scene.meshes for part in mesh.parts)
    has_maps = bool(textures) or colored
    has_alpha = any(m.alpha_mode != "opaque" for m in packed)
    specular = [m for m in packed if not m.unlit and _specular_from(m) > 0]
    models = [_model(m, bool(specular)) for m in packed]
    records = {
        "Material": [_material(m, model) for m, model in zip(packed, models, strict=True)],
        "Maps": [_maps(m, index) for m in packed] if has_maps else [],
        "Opacity": [_opacity(m, index) for m in packed] if has_alpha else [],
        "Texture": [_texture(t, atlas.regions[t.image]) for t in textures],
    }
    used = {name for m in textured for name in m.textures}
    if all(_share_texture(m) for m in textured):
        used -= {"metallic"}
    features = {
        **{f"HAS_{model.name}": int(model in models) for model in BsdfModel},
        "HAS_DELTA": int(any(m.alpha < _ALPHA_DELTA or m.roughness_texture for m in specular)),
        "HAS_ALPHA": int(has_alpha),
        "HAS_TEXTURES": int(bool(textures)),
    }
    flags = {
        "u_has_maps": int(has_maps),
        "u_texture_uses": sum(_USES[name] for name in used),
        "u_has_float_texels": int(len(atlas.floats) > 0),
    }
    return PackedMaterials(records, features, flags, atlas, of_shapes, of_meshes)


def mean_emission(material: Material) -> tuple[float, float, float]:
    """Radiance that a surface with the whole emission texture on it has in the mean."""
    if not material.is_emissive:
        return (0.0, 0.0, 0.0)
    if material.emission_texture is None:
        return material.emission
    r, g, b = np.multiply(material.emission, mean_color(material.emission_texture.image)).tolist()
    return (r, g, b)


def plain_emission(material: Material) -> tuple[float, float, float]:
    """Radiance of a surface without textures, times its opacity."""
    if not material.is_emissive:
        return (0.0, 0.0, 0.0)
    opacity = {"opaque": 1.0, "mask": float(material.opacity >= material.alpha_cutoff), "blend": material.opacity}
    r, g, b = (opacity[material.alpha_mode] * radiance for radiance in material.emission)
    return (r, g, b)


def _apart(scene: Scene, materials: Mapping[str, Material]) -> tuple[list[Material], dict[str, int], dict[str, int]]:
    """The materials to pack, and their numbers by name for shapes and for meshes; one that both use is there twice if
    it has textures."""
    on_meshes = {mesh.material_of(part) for mesh in scene.meshes for part in mesh.parts}
    on_shapes = {shape.material for kind in SHAPES for shape in getattr(scene, kind)}
    packed: list[Material] = []
    of_shapes: dict[str, int] = {}
    of_meshes: dict[str, int] = {}
    for name, material in materials.items():
        if name in on_meshes:
            of_meshes[name] = len(packed)
            packed.append(material)
        if name not in on_meshes or (name in on_shapes and material.textures):
            of_shapes[name] = len(packed)
            packed.append(_without_textures(material))
        else:
            of_shapes[name] = of_meshes[name]
    return packed, of_shapes, of_meshes


def _without_textures(material: Material) -> Material:
    none: dict[str, Any] = {f"{name}_texture": None for name in material.textures}
    return replace(material, **none) if none else material


def _model(material: Material, specular: bool) -> BsdfModel:
    """The shader's model. Where any material has a ``specular`` lobe, all of the default model that have none are
    Cook-Torrance without one, which is the same: every model that a program has costs time on a machine that runs both
    sides of a branch."""
    if material.model == DEFAULT_MODEL:
        return BsdfModel.COOK_TORRANCE if specular else BsdfModel.DIFFUSE
    return BsdfModel[material.model.replace("-", "_").upper()]


def _share_texture(material: Material) -> bool:
    """Whether roughness and metallic are channels of one texture, as in glTF, or neither has one."""
    rough, metal = material.roughness_texture, material.metallic_texture
    return rough == metal or (
        rough is not None and metal is not None and replace(rough, channel=metal.channel) == metal
    )


def _specular_from(material: Material) -> float:
    constant = max(*material.specular_f0, *material.specular_f90)
    return max(constant, material.specular) if material.metallic_texture else constant


def _material(material: Material, model: BsdfModel) -> dict[str, Any]:
    if material.unlit:
        return {"emission": material.base_color, "unlit": 1, "bsdf": model}
    return {
        "diffuse": material.diffuse_albedo,
        "alpha": material.alpha,
        "f0": material.specular_f0,
        "bsdf": model,
        "f90": material.specular_f90,
        "emission": material.emission,
    }


def _maps(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    textures = material.textures
    dielectric = replace(material, metal=None, metallic=0.0)
    numbers = {f"{name}_texture": index[textures[name]] if name in textures else -1 for name in TEXTURED}
    channel = -1
    if material.metallic_texture is not None and _share_texture(material):
        numbers["metallic_texture"], channel = -1, "rgba".index(material.metallic_texture.channel)
    return {
        "albedo": material.base_color,
        "roughness": material.roughness,
        "dielectric_f0": dielectric.specular_f0,
        "metallic": material.metalness,
        "metallic_channel": channel,
        "dielectric_f90": dielectric.specular_f90,
        "normal_scale": material.normal_scale,
        "occlusion_strength": material.occlusion_strength,
        **numbers,
    }


def _opacity(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    return {
        "opacity": material.opacity,
        "mode": _ALPHA_MODES.index(material.alpha_mode),
        "cutoff": material.alpha_cutoff,
        "texture_index": index[material.albedo_texture] if material.albedo_texture else -1,
    }


def _texture(texture: Texture, region: Region) -> dict[str, Any]:
    """The rows are those of KHR_texture_transform: scaled, turned counter-clockwise as seen on the image, whose v runs
    downwards, and moved."""
    cos, sin = np.cos(texture.rotation), np.sin(texture.rotation)
    (scale_u, scale_v), (offset_u, offset_v) = texture.scale, texture.offset
    return {
        "u_row": (cos * scale_u, sin * scale_v, offset_u),
        "v_row": (-sin * scale_u, cos * scale_v, offset_v),
        "coordinates": texture.coordinates,
        "channel": "rgba".index(texture.channel),
        **{name: getattr(region, name) for name in ("x", "y", "width", "height", "layer")},
        "flags": region.flags | (TEXTURE_NEAREST if texture.filter == "nearest" else 0),
        "wrap_u": _WRAP_MODES.index(texture.wrap_u),
        "wrap_v": _WRAP_MODES.index(texture.wrap_v),
    }


def needed_attributes(scene: Scene) -> Iterable[str]:
    """Which attributes of vertices the materials of meshes need: "normal", "uv", "tangent", "color"."""
    parts = [(scene.materials[mesh.material_of(part)], part.geometry) for mesh in scene.meshes for part in mesh.parts]
    has_bumps = any(material.normal_texture is not None for material, _ in parts)
    if has_bumps or any(geometry.normals is not None for _, geometry in parts):
        yield "normal"
    if any(material.textures for material, _ in parts):
        yield "uv"
    if has_bumps:
        yield "tangent"
    if any(geometry.colors is not None for _, geometry in parts):
        yield "color"
