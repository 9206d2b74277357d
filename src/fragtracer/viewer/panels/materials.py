# SPDX-License-Identifier: MIT
"""A material: presets, and every number of it."""

from fragtracer.materials import DIELECTRIC_F0, METAL_F0
from fragtracer.scene import Material
from fragtracer.viewer.panels import widgets

CUSTOM = "custom"
_MATTE = "matte"
PRESETS = (CUSTOM, _MATTE, *DIELECTRIC_F0, *sorted(METAL_F0))


def edit(material: Material) -> Material:
    """Controls for ``material``."""
    preset = preset_of(material)
    chosen = widgets.choice("Preset", preset, PRESETS, "Measured metals and dielectrics.")
    if chosen != preset:
        return with_preset(material, chosen)
    new: dict[str, object] = {"roughness": widgets.slider("Roughness", material.roughness, 0.0, 1.0, "%.2f")}
    if material.metal is None:
        new["albedo"] = widgets.color("Albedo", material.albedo)
        new["metallic"] = widgets.slider("Metallic", material.metallic, 0.0, 1.0, "%.2f")
        new["specular"] = widgets.slider("Specular", material.specular, 0.0, 1.0, "%.2f")
        if material.f0 is not None:
            new["f0"] = widgets.color("F0", material.f0)
        else:
            before = 1.5 if material.ior is None else material.ior
            after = widgets.slider("Index of refr.", before, 1.0, 3.0, "%.3f")
            new["ior"] = after if after != before else material.ior
    if material.is_emissive:
        new["emission"] = widgets.color("Emission", material.emission, hdr=True)
    return widgets.edited(material, **new)


def preset_of(material: Material) -> str:
    """The name of the preset that ``material`` is."""
    if material.metal is not None:
        return material.metal
    if material.specular == 0 and material.metallic == 0:
        return _MATTE
    grey = material.f0 is not None and len(set(material.f0)) == 1
    known = {value: name for name, value in reversed(DIELECTRIC_F0.items())}
    return known.get(material.f0[0], CUSTOM) if material.f0 and grey else CUSTOM


def with_preset(material: Material, preset: str) -> Material:
    """``material`` made of something else; its roughness and emission stay."""
    kept = {"roughness": material.roughness, "emission": material.emission}
    if preset in METAL_F0:
        return Material(metal=preset, **kept)  # type: ignore[arg-type]
    albedo = METAL_F0[material.metal] if material.metal else material.albedo
    if preset in DIELECTRIC_F0:
        return Material(albedo=albedo, f0=(DIELECTRIC_F0[preset],) * 3, **kept)  # type: ignore[arg-type]
    if preset == _MATTE:
        return Material(albedo=albedo, specular=0.0, **kept)  # type: ignore[arg-type]
    return Material(albedo=albedo, metallic=1.0 if material.metal else 0.0, ior=1.5, **kept)  # type: ignore[arg-type]
