# SPDX-License-Identifier: MIT
"""Controls of a material, with presets."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

from fragtracer.apps.viewer.panels import media, widgets
from fragtracer.scene import Material
from fragtracer.scene.material import DEFAULT_MODEL, MODELS, PANES, SOLIDS
from fragtracer.scene.reflectance import DIELECTRIC_F0, METAL_F0, METAL_INDEX

CUSTOM = "custom"
_MATTE = "matte"
_NO_BLEND = "none"
_ALPHA_MODES = get_args(get_type_hints(Material)["alpha_mode"])
_DIFFUSE_FACTORS = get_args(get_type_hints(Material)["diffuse_factor"])
PRESETS = (CUSTOM, _MATTE, *DIELECTRIC_F0, *sorted(METAL_F0))


def edit(material: Material, of_mesh: bool = False, known: Sequence[str] = (), others: Sequence[str] = ()) -> Material:
    """Controls for ``material``; ``of_mesh`` adds those of meshes alone, ``known`` are the names of media,
    ``others`` of materials that it may be blended with."""
    model = widgets.choice("Model", material.model, list(MODELS))
    if model != material.model:
        return with_model(material, model)
    new: dict[str, object] = {}
    if model == DEFAULT_MODEL:
        preset = preset_of(material)
        chosen = widgets.choice("Preset", preset, PRESETS, "Measured metals and dielectrics.")
        if chosen != preset:
            return with_preset(material, chosen)
        new |= {key: _CONTROLS[key](material) for key in ("roughness", "anisotropy", "anisotropy_rotation_degrees")}
    else:
        values = {key: control(material) for key, control in _CONTROLS.items() if key in MODELS[model]}
        new |= {key: value for key, value in values.items() if value is not None}
        if "interior" in MODELS[model]:
            new["interior"] = media.choose("Interior", material.interior, known)
            new |= {"attenuation_color": (1.0, 1.0, 1.0)} if new["interior"] is not None else {}
    if model == DEFAULT_MODEL and material.metal is None:
        new["albedo"] = widgets.color("Albedo", material.albedo)
        new["metallic"] = widgets.slider("Metallic", material.metallic, 0.0, 1.0, "%.2f")
        new["specular"] = widgets.slider("Specular", material.specular, 0.0, 1.0, "%.2f")
        if not material.is_translucent:
            new["diffuse_factor"] = widgets.choice("Diffuse factor", material.diffuse_factor, _DIFFUSE_FACTORS)
        if material.f0 is not None:
            new["f0"] = widgets.color("F0", material.f0)
        else:
            new["ior"] = _index(material)
    if model == DEFAULT_MODEL:
        if not material.is_translucent:
            new |= _coat(material)
            new |= _sheen(material)
            new |= _iridescence(material)
        new |= _translucency(material)
    new |= _blend(material, others)
    if material.is_emissive:
        new["emission"] = widgets.color("Emission", material.emission, hdr=True)
    if of_mesh:
        new |= _surface(material)
        _textures(material)
    return widgets.edited(material, **new)


def with_model(material: Material, model: str) -> Material:
    """``material`` of another model: what means something to both stays."""
    default, keys = Material(), set(MODELS[material.model]) | set(MODELS[model])
    textured = {f"{key}_texture" for key in keys} & set(vars(default))
    made = {name: getattr(default, name) for name in {*keys, *textured} if name not in MODELS[model] or name in _UNLIKE}
    made |= {"metal": material.metal if material.metal in METAL_INDEX else "gold"} if model == "conductor" else {}
    made |= {"double_sided": True, "black_back": False} if model in (*SOLIDS, *PANES) else {}
    made |= {} if "albedo" in MODELS[model] else {"unlit": False}
    return replace(material, **{"model": model, **made})


# Keys that have another meaning, or another range of values, in each model.
_UNLIKE = {"metal", "ior", "eta", "k", "f0"}
# A control for each key of the models but the default one.
_CONTROLS: dict[str, Callable[[Material], Any]] = {
    "albedo": lambda m: widgets.color("Albedo", m.albedo),
    "roughness": lambda m: widgets.slider("Roughness", m.roughness, 0.0, 1.0, "%.2f"),
    "anisotropy": lambda m: widgets.slider("Anisotropy", m.anisotropy, 0.0, 1.0, "%.2f"),
    "anisotropy_rotation_degrees": lambda m: widgets.slider(
        "turned by", m.anisotropy_rotation_degrees, -180.0, 180.0, "%.0f°"
    ),
    "ior": lambda m: _index(m),
    "exterior_ior": lambda m: _exterior_index(m),
    "transmittance": lambda m: widgets.color("Transmittance", m.transmittance),
    "attenuation_color": lambda m: widgets.at_least(
        1e-4, m.attenuation_color, widgets.color("Attenuation", m.attenuation_color)
    ),
    "attenuation_distance": lambda m: widgets.length(
        "at a distance", m.attenuation_distance, 5 * m.attenuation_distance, 1e-6
    ),
    "abbe_number": lambda m: (
        widgets.number("Abbe number", m.abbe_number or 0.0, 0.2, 0.0, 100.0, "%.1f", "0: none") or None
    ),
    "priority": lambda m: widgets.whole("Priority", m.priority, -10, 10, "Of two that overlap the higher is there."),
    "nonlinear": lambda m: widgets.check("Nonlinear", m.nonlinear),
    "metal": lambda m: widgets.choice("Metal", m.metal, sorted(METAL_INDEX)) if m.metal else None,
    "eta": lambda m: widgets.color("eta", m.eta, hdr=True) if m.eta else None,
    "k": lambda m: widgets.color("k", m.k, hdr=True) if m.k else None,
}


def _index(material: Material) -> float | None:
    after = widgets.slider("Index of refr.", material.index, 1.0, 3.0, "%.3f")
    return after if after != material.index else material.ior


def _exterior_index(material: Material) -> float | None:
    """Of an interface, which a solid does not become."""
    if material.exterior_ior is None:
        return None
    return widgets.slider("Index outside", material.exterior_ior, 1.0, 3.0, "%.3f")


def _coat(material: Material) -> dict[str, object]:
    new: dict[str, object] = {"coat": widgets.slider("Coat", material.coat, 0.0, 1.0, "%.2f")}
    if material.coat > 0:
        new["coat_roughness"] = widgets.slider("Coat roughness", material.coat_roughness, 0.0, 1.0, "%.2f")
        new["coat_ior"] = widgets.slider("Coat index", material.coat_ior, 1.0, 3.0, "%.3f")
        if material.coat_normal_texture is not None:
            scale = widgets.number("Coat normal scale", material.coat_normal_scale, 0.01, -10.0, 10.0, "%.2f")
            new["coat_normal_scale"] = scale
    return new


def _sheen(material: Material) -> dict[str, object]:
    new: dict[str, object] = {"sheen_color": widgets.color("Sheen", material.sheen_color)}
    if max(material.sheen_color) > 0:
        new["sheen_roughness"] = widgets.slider("Sheen roughness", material.sheen_roughness, 0.0, 1.0, "%.2f")
    return new


def _iridescence(material: Material) -> dict[str, object]:
    new: dict[str, object] = {"iridescence": widgets.slider("Iridescence", material.iridescence, 0.0, 1.0, "%.2f")}
    if material.iridescence > 0:
        new["iridescence_ior"] = widgets.slider("Film index", material.iridescence_ior, 1.0, 3.0, "%.3f")
        thickness = widgets.slider("Film thickness", material.iridescence_thickness, 0.0, 1200.0, "%.0f nm")
        new["iridescence_thickness"] = thickness
        if material.iridescence_thickness_texture is not None:
            least = material.iridescence_thickness_minimum
            new["iridescence_thickness_minimum"] = widgets.slider("at least", least, 0.0, 1200.0, "%.0f nm")
    return new


def _translucency(material: Material) -> dict[str, object]:
    """Where nothing is in its way that it is not possible together with."""
    is_layered = material.is_coated or material.has_sheen or material.has_iridescence
    if is_layered or material.unlit or material.diffuse_factor != "interface":
        return {}
    share = widgets.slider("Diffuse transm.", material.diffuse_transmission, 0.0, 1.0, "%.2f")
    new: dict[str, object] = {"diffuse_transmission": share}
    if material.is_translucent:
        new["diffuse_transmission_color"] = widgets.color("of a colour", material.diffuse_transmission_color)
    return new


def _blend(material: Material, others: Sequence[str]) -> dict[str, object]:
    """With what it is blended, and how much of it is that."""
    if not others or material.unlit:
        return {}
    chosen = widgets.choice("Blend with", material.blend or _NO_BLEND, [_NO_BLEND, *others])
    if chosen == _NO_BLEND:
        default = Material()
        return {name: getattr(default, name) for name in ("blend", "blend_weight", "blend_weight_texture")}
    weight = widgets.slider("Weight of it", material.blend_weight, 0.0, 1.0, "%.2f")
    return {"blend": chosen, "blend_weight": weight}


def _surface(material: Material) -> dict[str, object]:
    new: dict[str, object] = {"alpha_mode": widgets.choice("Alpha", material.alpha_mode, _ALPHA_MODES)}
    if material.alpha_mode != "opaque":
        new["opacity"] = widgets.slider("Opacity", material.opacity, 0.0, 1.0, "%.2f")
    if material.alpha_mode == "mask":
        new["alpha_cutoff"] = widgets.slider("Cutoff", material.alpha_cutoff, 0.0, 1.0, "%.2f")
    if material.normal_texture is not None:
        new["normal_scale"] = widgets.number("Normal scale", material.normal_scale, 0.01, -10.0, 10.0, "%.2f")
    new["double_sided"] = widgets.check("Double-sided", material.double_sided)
    if new["double_sided"] and not (material.is_dielectric or material.is_translucent):
        new["black_back"] = widgets.check("Black back", material.black_back)
    else:
        new["black_back"] = False
    if "albedo" in MODELS[material.model] and material.blend is None and not material.is_translucent:
        new["unlit"] = widgets.check("Unlit", material.unlit)
    return new


def _textures(material: Material) -> None:
    """List its textures."""
    for name, texture in material.textures.items():
        height, width = texture.image.pixels.shape[:2]
        file = Path(texture.image.file).name if texture.image.file else "not from a file"
        widgets.pair(f"{name} map".replace("_", " ").capitalize(), f"{file}, {width} × {height}")


def preset_of(material: Material) -> str:
    """The name of the preset that ``material`` equals, or "custom"."""
    if material.metal is not None:
        return material.metal
    if material.specular == 0 and material.metallic == 0:
        return _MATTE
    grey = material.f0 is not None and len(set(material.f0)) == 1
    known = {value: name for name, value in reversed(DIELECTRIC_F0.items())}
    return known.get(material.f0[0], CUSTOM) if material.f0 and grey else CUSTOM


def with_preset(material: Material, preset: str) -> Material:
    """``material`` with the reflectance of ``preset``; its roughness, emission and textures stay."""
    default = Material()
    names = ("albedo", "metallic", "ior", "f0", "metal", "specular")
    made = {name: getattr(default, name) for name in names}
    if preset in METAL_F0:
        return replace(material, **made | {"metal": preset})
    made["albedo"] = material.base_color
    if preset in DIELECTRIC_F0:
        return replace(material, **made | {"f0": (DIELECTRIC_F0[preset],) * 3})
    if preset == _MATTE:
        return replace(material, **made | {"specular": 0.0})
    return replace(material, **made | {"metallic": 1.0 if material.metal else 0.0, "ior": 1.5})
