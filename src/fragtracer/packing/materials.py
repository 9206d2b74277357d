# SPDX-License-Identifier: MIT
"""Materials and their textures as records of shaders/scene/{material,texture}.glsl."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.atlas import Atlas, Region, build_atlas, mean_color
from fragtracer.packing.coats import ROUGHNESSES, coat
from fragtracer.packing.interiors import dielectrics
from fragtracer.packing.records import MATERIAL_RECORDS, BsdfModel, Words, words_of, words_of_rows
from fragtracer.scene import SHAPES, Material, Scene, Texture
from fragtracer.scene.fields import Triple
from fragtracer.scene.material import DEFAULT_MODEL, TEXTURED
from fragtracer.scene.reflectance import internal_diffuse_transmittance

ALPHA_DELTA = 1e-4  # of bsdf/ggx.glsl
LARGEST_ETA = 1e9  # of plastic: powers of it are float32, and it reflects all but 4e-9
_ALPHA_MODES = ("opaque", "mask", "blend")
_WRAP_MODES = ("repeat", "mirror", "clamp")
TEXTURE_NEAREST = 4
# Flags of scene/material.glsl.
MATERIAL_UNLIT, MATERIAL_MAPPED, MATERIAL_BLACK_BACK, MATERIAL_INTERFACE = 1, 2, 4, 8
# What textures change, as in scene/texture.glsl.
_USES = {name: 1 << i for i, name in enumerate(name for name in TEXTURED if name != "transmittance")}


@dataclass(frozen=True, eq=False)
class PackedMaterials:
    """Words of the records by kind, features, flags (uniforms that say what kinds of things there are), and images.

    ``of_shapes`` and ``of_meshes`` are the numbers of materials by name: those of shapes, which have no texture
    coordinates, leave the textures out. ``others`` are the numbers of what materials are blended with, by theirs.
    """

    words: Mapping[str, Words]
    features: Mapping[str, int]
    flags: Mapping[str, int]
    atlas: Atlas
    of_shapes: Mapping[str, int]
    of_meshes: Mapping[str, int]
    others: Mapping[int, int]


def pack_materials(scene: Scene, materials: Mapping[str, Material]) -> PackedMaterials:
    """Pack ``materials``, those of ``scene`` and of its lights."""
    packed, of_shapes, of_meshes = _apart(scene, materials)
    names = _names(of_shapes, of_meshes)
    others = _with_others(packed, names, set(of_meshes.values()), materials)
    dielectric = dielectrics(materials)
    conductor, plastic = (
        {name: i for i, name in enumerate(n for n, m in materials.items() if m.model in models)}
        for models in (("conductor",), ("plastic", "rough-plastic"))
    )
    coats = {name: _coats(materials[name]) for name in plastic}
    own = dielectric | conductor | plastic
    coated = [m for m in packed if m.is_coated]
    translucent = [m for m in packed if m.is_translucent]
    layer_of = {id(m): i for some in (coated, translucent) for i, m in enumerate(some)}
    numbers = np.array(
        [layer_of.get(id(m), own.get(n, _has_half_vector(m))) for n, m in zip(names, packed, strict=True)], np.int64
    )
    textured = [m for m in packed if m.textures]
    textures = list(dict.fromkeys(t for m in textured for t in m.textures.values()))
    atlas = build_atlas(texture.image for texture in textures)
    index = {texture: i for i, texture in enumerate(textures)}
    colored = any(part.geometry.colors is not None for mesh in scene.meshes for part in mesh.parts)
    has_maps = bool(textures) or colored
    mapped = np.array([colored or bool(m.textures) for m in packed])
    has_sheen = any(m.has_sheen for m in packed)
    has_iridescence = any(m.has_iridescence for m in packed)
    is_anisotropic = any(m.anisotropy > 0 for m in packed)
    has_alpha = any(m.alpha_mode != "opaque" for m in packed)
    lobes = [(m.specular_f0, m.specular_f90) for m in packed]
    plain = [(m, lobe) for m, lobe in zip(packed, lobes, strict=True) if m.model == DEFAULT_MODEL and not m.unlit]
    specular = [m for m, lobe in plain if m.has_iridescence or _specular_from(m, *lobe) > 0]
    models = [_model(m, any(not _has_own_model(other) for other in specular)) for m in packed]
    words = {
        "Material": _material_words(packed, models, lobes, numbers, mapped),
        "Maps": words_of_rows(MATERIAL_RECORDS["Maps"], [_maps(m, index) for m in packed] if has_maps else []),
        "Dielectric": words_of_rows(MATERIAL_RECORDS["Dielectric"], [_dielectric(materials[n]) for n in dielectric]),
        "Conductor": words_of_rows(MATERIAL_RECORDS["Conductor"], [_conductor(materials[n]) for n in conductor]),
        "Plastic": words_of_rows(MATERIAL_RECORDS["Plastic"], _plastics(materials, coats)),
        "Coat": words_of_rows(MATERIAL_RECORDS["Coat"], [row for rows in coats.values() for row in rows]),
        "ClearCoat": words_of_rows(MATERIAL_RECORDS["ClearCoat"], [_clear_coat(m, index) for m in coated]),
        "Sheen": words_of_rows(MATERIAL_RECORDS["Sheen"], [_sheen(m, index) for m in packed] if has_sheen else []),
        "Iridescence": words_of_rows(
            MATERIAL_RECORDS["Iridescence"], [_iridescence(m, index) for m in packed] if has_iridescence else []
        ),
        "Translucency": words_of_rows(MATERIAL_RECORDS["Translucency"], [_translucency(m, index) for m in translucent]),
        "Anisotropy": words_of_rows(
            MATERIAL_RECORDS["Anisotropy"], [_anisotropy(m, index) for m in packed] if is_anisotropic else []
        ),
        "Opacity": words_of_rows(
            MATERIAL_RECORDS["Opacity"], [_opacity(m, index) for m in packed] if has_alpha else []
        ),
        "Blend": words_of_rows(
            MATERIAL_RECORDS["Blend"], [_blend(i, m, others, index) for i, m in enumerate(packed)] if others else []
        ),
        "Texture": words_of_rows(MATERIAL_RECORDS["Texture"], [_texture(t, atlas.regions[t.image]) for t in textures]),
    }
    used = {"albedo" if name == "transmittance" else name for m in textured for name in m.textures}
    if all(_share_texture(m) for m in textured):
        used -= {"metallic"}
    features = {
        **{model.feature: 0 for model in BsdfModel},
        **{model.feature: 1 for model in models},
        **({"HAS_EXACT_FRESNEL": 1} if has_iridescence else {}),
        "HAS_DELTA": int(any(m.alpha < ALPHA_DELTA or m.roughness_texture for m in specular)),
        "HAS_ALPHA": int(has_alpha),
        "HAS_TEXTURES": int(bool(textures)),
    }
    flags = {
        "u_has_maps": int(has_maps),
        "u_has_blends": int(bool(others)),
        "u_has_black_backs": int(any(m.black_back for m in packed)),
        "u_absent_models": sum(1 << model for model in BsdfModel if model not in models),
        "u_dielectrics_are_smooth": int(not any(map(_is_rough_dielectric, packed))),
        "u_facets_are_isotropic": int(not is_anisotropic),
        "u_without_sheen": int(not has_sheen),
        "u_without_iridescence": int(not has_iridescence),
        "u_without_half_vector": int(not any(map(_has_half_vector, packed))),
        "u_texture_uses": sum(_USES[name] for name in used),
        "u_has_float_texels": int(len(atlas.floats) > 0),
    }
    return PackedMaterials(words, features, flags, atlas, of_shapes, of_meshes, others)


def material_names(scene: Scene, materials: Mapping[str, Material]) -> list[str]:
    """The names of materials by the numbers that :func:`pack_materials` gives them."""
    return _names(*_apart(scene, materials)[1:])


def _names(of_shapes: Mapping[str, int], of_meshes: Mapping[str, int]) -> list[str]:
    """The names of materials by their numbers."""
    name = {number: name for of in (of_shapes, of_meshes) for name, number in of.items()}
    return [name[i] for i in range(len(name))]


def mean_emission(material: Material) -> tuple[float, float, float]:
    """Radiance that a surface with the whole emission texture on it has in the mean."""
    if not material.is_emissive:
        return (0.0, 0.0, 0.0)
    if material.emission_texture is None:
        return material.emission
    r, g, b = np.multiply(material.emission, mean_color(material.emission_texture.image)).tolist()
    return (r, g, b)


def plain_emission(material: Material) -> Triple:
    """Radiance of an emissive surface without textures, times its opacity."""
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
        other = materials[material.blend] if material.blend is not None else material
        if name not in on_meshes or (name in on_shapes and (material.textures or other.textures)):
            of_shapes[name] = len(packed)
            packed.append(material.without_textures())
        else:
            of_shapes[name] = of_meshes[name]
    return packed, of_shapes, of_meshes


def _with_others(
    packed: list[Material], names: list[str], of_meshes: Collection[int], materials: Mapping[str, Material]
) -> dict[int, int]:
    """Adds to ``packed`` and ``names`` what each of them is blended with, which emits as that one does; the numbers of
    these by those. Only numbers ``of_meshes`` have textures."""
    others: dict[int, int] = {}
    for number, material in enumerate(list(packed)):
        if material.blend is not None:
            other = materials[material.blend]
            other = other if number in of_meshes else other.without_textures()
            others[number] = len(packed)
            names.append(material.blend)
            packed.append(replace(other, emission=material.emission, emission_texture=material.emission_texture))
    return others


def _model(material: Material, specular: bool) -> BsdfModel:
    """The shader's model. Where any material has a ``specular`` lobe, all of the default model that have none are
    Cook-Torrance without one, which is the same: every model that a program has costs time on a machine that runs both
    sides of a branch."""
    if material.is_coated:
        return BsdfModel.COATED
    if material.has_sheen:
        return BsdfModel.SHEEN
    if material.is_translucent:
        return BsdfModel.TRANSLUCENT
    if material.model == DEFAULT_MODEL:
        return BsdfModel.COOK_TORRANCE if specular else BsdfModel.DIFFUSE
    if material.model == "rough-plastic" and not _is_rough(material):
        return BsdfModel.PLASTIC
    if material.model == "null":
        return BsdfModel.DIELECTRIC  # of index 1, which is passed
    if material.is_pane:
        return BsdfModel.THIN_DIELECTRIC
    return BsdfModel[material.model.replace("-", "_").upper()]


def _has_own_model(material: Material) -> bool:
    """Whether it is of the default model and has another one in the shader for what is over or in its base."""
    return material.is_coated or material.has_sheen or material.is_translucent


def _has_half_vector(material: Material) -> bool:
    return material.diffuse_factor == "half-vector"


def _is_rough(material: Material) -> bool:
    return material.alpha >= ALPHA_DELTA or material.roughness_texture is not None


def _is_rough_dielectric(material: Material) -> bool:
    return material.model in ("dielectric", "rough-thin-dielectric") and _is_rough(material)


def _dielectric(material: Material) -> dict[str, Any]:
    return {
        "transmittance": material.transmittance,
        "eta": material.relative_index,
        "absorption": material.absorption,
        "dispersion": material.dispersion,
    }


def _conductor(material: Material) -> dict[str, Any]:
    index, extinction = material.complex_index
    return {"index": index, "extinction": extinction}


def _coats(material: Material) -> list[dict[str, Any]]:
    """Records of the coat of a plastic: of its roughness, or, where a texture varies that, of several."""
    if material.model == "plastic" or not _is_rough(material):
        return []
    if material.roughness_texture is None:
        return [coat(material.alpha, material.index)]
    return [coat(float(roughness**2), material.index) for roughness in np.linspace(0, 1, ROUGHNESSES)]


def _plastics(materials: Mapping[str, Material], coats: Mapping[str, Sequence[object]]) -> list[dict[str, Any]]:
    """Records of the plastics, whose ``coats`` are numbered one after the other."""
    firsts = np.cumsum([0, *map(len, coats.values())])
    etas = [min(materials[name].index, LARGEST_ETA) for name in coats]
    return [
        {
            "eta": eta,
            "leaving": internal_diffuse_transmittance(eta),
            "nonlinear": materials[name].nonlinear,
            "coat": first,
            "coats": len(found),
        }
        for (name, found), first, eta in zip(coats.items(), firsts, etas, strict=False)
    ]


def _share_texture(material: Material) -> bool:
    """Whether roughness and metallic are channels of one texture, as in glTF, or neither has one."""
    rough, metal = material.roughness_texture, material.metallic_texture
    return rough == metal or (
        rough is not None and metal is not None and replace(rough, channel=metal.channel) == metal
    )


def _specular_from(material: Material, f0: Triple, f90: Triple) -> float:
    constant = max(*f0, *f90)
    return max(constant, material.specular) if material.metallic_texture else constant


def _material_words(
    materials: Sequence[Material],
    models: Sequence[BsdfModel],
    lobes: Sequence[tuple[Triple, Triple]],
    records: NDArray[np.int64],
    mapped: NDArray[np.bool_],
) -> Words:
    """Records of ``materials`` with their models, the f0 and f90 of their specular lobes, and the numbers of the
    ``records`` of dielectrics, conductors, plastics, clear coats and translucency, or 1 for the diffuse factor of the
    half vector; which of them are ``mapped``, having textures or the colours of vertices."""
    scatters = np.array([not m.unlit for m in materials], np.float64)
    black_backs = np.array([m.black_back for m in materials], bool)
    interfaces = np.array([m.exterior_ior is not None for m in materials], bool)
    flags = MATERIAL_UNLIT * (scatters == 0) + MATERIAL_MAPPED * mapped
    f0, f90 = np.array(lobes, np.float64).reshape(-1, 2, 3).transpose(1, 0, 2)
    columns = {
        "diffuse": np.array([m.diffuse_albedo for m in materials]).reshape(-1, 3) * scatters[:, None],
        "alpha": np.array([m.alpha for m in materials]) * scatters,
        "f0": f0 * scatters[:, None],
        "bsdf": np.array(models, np.int64),
        "f90": f90 * scatters[:, None],
        "flags": flags + MATERIAL_BLACK_BACK * black_backs + MATERIAL_INTERFACE * interfaces,
        "emission": np.array([m.base_color if m.unlit else m.emission for m in materials]).reshape(-1, 3),
        "record": records,
    }
    return words_of(MATERIAL_RECORDS["Material"], columns, len(materials))


def _maps(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    textures = material.textures
    dielectric = replace(material, metal=None, metallic=0.0) if material.model == DEFAULT_MODEL else material
    numbers = {f"{name}_texture": index[textures[name]] if name in textures else -1 for name in TEXTURED}
    transmittance = numbers.pop("transmittance_texture")
    others = ["anisotropy", "blend_weight", "coat", "coat_roughness", "coat_normal", "sheen_color", "sheen_roughness"]
    others += ["iridescence", "iridescence_thickness", "diffuse_transmission", "diffuse_transmission_color"]
    for name in others:  # of records of their own
        del numbers[f"{name}_texture"]
    if material.is_dielectric:  # in the place of an albedo, which it has not
        numbers["albedo_texture"] = transmittance
    channel = -1
    if material.metallic_texture is not None and _share_texture(material):
        numbers["metallic_texture"], channel = -1, "rgba".index(material.metallic_texture.channel)
    return {
        "albedo": material.transmittance if material.is_dielectric else material.base_color,
        "roughness": material.roughness,
        "dielectric_f0": dielectric.specular_f0,
        "metallic": material.metalness,
        "metallic_channel": channel,
        "dielectric_f90": dielectric.specular_f90,
        "normal_scale": material.normal_scale,
        "occlusion_strength": material.occlusion_strength,
        **numbers,
    }


def _clear_coat(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    weight, roughness, normal = material.coat_texture, material.coat_roughness_texture, material.coat_normal_texture
    return {
        "weight": material.coat,
        "roughness": material.coat_roughness,
        "f0": material.coat_f0,
        "half_vector": _has_half_vector(material),
        "weight_texture": -1 if weight is None else index[weight],
        "roughness_texture": -1 if roughness is None else index[roughness],
        "normal_texture": -1 if normal is None else index[normal],
        "normal_scale": material.coat_normal_scale,
    }


def _sheen(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    color, roughness = material.sheen_color_texture, material.sheen_roughness_texture
    return {
        "color": material.sheen_color if material.has_sheen else (0.0, 0.0, 0.0),
        "roughness": material.sheen_roughness,
        "color_texture": -1 if color is None else index[color],
        "roughness_texture": -1 if roughness is None else index[roughness],
    }


def _iridescence(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    weight, thickness = material.iridescence_texture, material.iridescence_thickness_texture
    return {
        "weight": material.iridescence if material.has_iridescence else 0.0,
        "ior": material.iridescence_ior,
        "thickness_minimum": material.iridescence_thickness_minimum,
        "thickness": material.iridescence_thickness,
        "weight_texture": -1 if weight is None else index[weight],
        "thickness_texture": -1 if thickness is None else index[thickness],
    }


def _translucency(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    color, factor = material.diffuse_transmission_color_texture, material.diffuse_transmission_texture
    metallic = material.metallic_texture
    return {
        "color": material.diffuse_transmission_color,
        "factor": material.diffuse_transmission,
        "color_texture": -1 if color is None else index[color],
        "factor_texture": -1 if factor is None else index[factor],
        "metallic": material.metalness,
        "metallic_texture": -1 if metallic is None else index[metallic],
    }


def _anisotropy(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    angle, texture = np.radians(material.anisotropy_rotation_degrees), material.anisotropy_texture
    number = -1 if texture is None else index[texture]
    return {"strength": material.anisotropy, "cosine": np.cos(angle), "sine": np.sin(angle), "texture_index": number}


def _opacity(material: Material, index: Mapping[Texture, int]) -> dict[str, Any]:
    return {
        "opacity": material.opacity,
        "mode": _ALPHA_MODES.index(material.alpha_mode),
        "cutoff": material.least_alpha,
        "texture_index": index[material.albedo_texture] if material.albedo_texture else -1,
    }


def _blend(number: int, material: Material, others: Mapping[int, int], index: Mapping[Texture, int]) -> dict[str, Any]:
    texture = material.blend_weight_texture
    return {
        "weight": material.blend_weight if number in others else 0.0,
        "texture_index": index[texture] if texture else -1,
        "other": others.get(number, number),
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
        **{name: getattr(region, name) for name in ("first", "width", "height")},
        "flags": region.flags | (TEXTURE_NEAREST if texture.filter == "nearest" else 0),
        "wrap_u": _WRAP_MODES.index(texture.wrap_u),
        "wrap_v": _WRAP_MODES.index(texture.wrap_v),
    }


def needed_attributes(scene: Scene) -> Iterable[str]:
    """Which attributes of vertices the materials of meshes need: "normal", "uv", "tangent", "color"."""
    parts = [
        (scene.materials[name], part.geometry)
        for mesh in scene.meshes
        for part in mesh.parts
        for name in scene.blended(mesh.material_of(part))
    ]
    has_bumps = any(material.normal_maps for material, _ in parts)
    has_brushing = any(material.anisotropy > 0 for material, _ in parts)
    if has_bumps or any(geometry.normals is not None for _, geometry in parts):
        yield "normal"
    if any(material.textures for material, _ in parts):
        yield "uv"
    if has_bumps or has_brushing:
        yield "tangent"
    if any(geometry.colors is not None for _, geometry in parts):
        yield "color"
