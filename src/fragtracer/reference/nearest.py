# SPDX-License-Identifier: MIT
"""The nearest materials that every Mitsuba has, for people who will not use our plugin."""

import math

from fragtracer.reference.bsdf import DELTA_ALPHA, NAME
from fragtracer.reference.shapes import Tree
from fragtracer.reference.translate import dielectric_f0, is_lambert, is_plain, lambert, rgb
from fragtracer.scene import Material


def nearest_bsdf(material: Material, geometry: str) -> Tree:
    """Mitsuba's own material nearest to ours; its geometry term is "smith" whatever ``geometry`` says.

    Rough dielectrics become ``principled``, since ``roughplastic`` loses light as it gets rougher: at
    alpha = 1 its base is less than half as bright as ours.
    """
    if is_lambert(material):
        return lambert(material)
    metallic = 1.0 if material.metal else material.metallic
    if metallic == 1:
        inner = _metal(material)
    elif metallic == 0:
        inner = _dielectric(material)
    else:
        inner = {"type": "blendbsdf", "weight": metallic, "bsdf_0": _dielectric(material), "bsdf_1": _metal(material)}
    return {"type": "twosided", "bsdf": inner}


def _metal(material: Material) -> Tree:
    f0 = material.specular_f0 if material.metal else material.albedo
    metal: Tree = {"type": "conductor", "material": "none", "specular_reflectance": rgb(f0)}
    if material.alpha >= DELTA_ALPHA:
        metal |= {"type": "roughconductor", "distribution": "ggx", "alpha": float(material.alpha)}
    return metal


def _dielectric(material: Material) -> Tree:
    """The dielectric part, its base made as bright as ours.

    Our base loses what the interface reflects, on the way in and out: on average (1 - F)² with
    F = F0 + (F90 - F0) / 21, Schlick's mean over the hemisphere. The base of ``principled`` loses next to
    nothing, that of ``plastic`` (1 - F)² / (1 - F) for its own F.
    """
    mean = min(max(material.specular * sum(dielectric_f0(material)) / 3, 1e-6), 0.99)  # Mitsuba wants an index above 1
    ior = (1 + math.sqrt(mean)) / (1 - math.sqrt(mean))
    passed = [1 - (f0 + (f90 - f0) / 21) for f0, f90 in zip(material.specular_f0, material.specular_f90, strict=True)]
    base = [c * p**2 for c, p in zip(material.albedo, passed, strict=True)]
    if material.alpha >= DELTA_ALPHA:
        return {"type": "principled", "base_color": rgb(base), "roughness": float(material.roughness), "eta": ior}
    lost = 1 - (mean + (1 - mean) / 21)
    base = [min(1.0, b / lost) for b in base]
    return {"type": "plastic", "int_ior": ior, "ext_ior": 1.0, "diffuse_reflectance": rgb(base)}


def note(material: Material, geometry: str, plugin: bool) -> str:
    """What a material becomes in an exported scene, and how near that is."""
    if is_lambert(material):
        return "diffuse, the same"
    if plugin:
        return f"{NAME}, the same"
    inner = nearest_bsdf(material, geometry)["bsdf"]
    kinds = [child["type"] for child in (inner.get("bsdf_0", inner), inner.get("bsdf_1")) if child]
    differs = []
    if "plastic" in kinds:
        differs.append("the exact Fresnel term in place of Schlick's")
    if "principled" in kinds:
        differs.append("the exact Fresnel term in place of Schlick's, a base brighter towards grazing")
    if kinds[-1].endswith("conductor"):
        differs.append("a metal of the same reflectance at every angle, no rise towards grazing")
    if geometry != "smith":
        differs.append(f"Smith's geometry term in place of {geometry}")
    return f"{' and '.join(kinds)}, nearly the same: {'; '.join(differs)}"
