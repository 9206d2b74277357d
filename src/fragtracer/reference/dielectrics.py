# SPDX-License-Identifier: MIT
"""Dielectrics, conductors, plastic and media as Mitsuba's own plugins, and what lies around each shape of a dielectric:
Mitsuba has interfaces without priorities, so that a shape must lie within one medium."""

from pathlib import Path

import numpy as np

from fragtracer.errors import FragtracerError
from fragtracer.io.volumes import write_volume
from fragtracer.reference.plugins import DELTA_ALPHA, ROUGH_PANE
from fragtracer.reference.shapes import Tree, rgb
from fragtracer.scene import Material, Medium, Plane, Scene, Sphere
from fragtracer.scene.fields import Triple
from fragtracer.scene.interiors import Solid, solids
from fragtracer.scene.microfacets import internal_reflectance, rough_interface
from fragtracer.scene.reflectance import internal_diffuse_transmittance

KINDS = ("dielectric", "roughdielectric", "thindielectric")


def dielectric_bsdf(material: Material, around: Material | None) -> Tree:
    """The plugin of a dielectric that lies in air, or within another one, or of the boundary of a medium."""
    if material.model == "null":
        return {"type": "null"}
    outside = around.index if around is not None else material.exterior_ior or 1.0
    tree: Tree = {"int_ior": float(material.index), "ext_ior": float(outside)}
    if is_rough_pane(material):
        widths = {"alpha_u": float(material.alpha_along), "alpha_v": float(material.alpha)}
        tree |= widths | {key: width for key, width in facets(material).items() if key in widths}
        return {"type": ROUGH_PANE, **tree, "specular_transmittance": list(material.transmittance)}
    tree["specular_transmittance"] = rgb(material.transmittance)
    if material.is_pane:
        return {"type": "thindielectric", **tree}
    if material.alpha < DELTA_ALPHA or tree["int_ior"] == tree["ext_ior"]:  # which roughdielectric refuses
        return {"type": "dielectric", **tree}
    return {"type": "roughdielectric", **facets(material), **tree}


def is_rough_pane(material: Material) -> bool:
    """Whether it is a pane that Mitsuba has no plugin of its own for."""
    return material.is_pane and material.alpha >= DELTA_ALPHA


def nearest_rough_pane(material: Material) -> Tree:
    """Mitsuba's own pane that is rough; what it transmits is scattered less, as its index says."""
    return {
        "type": "principledthin",
        "base_color": rgb(material.transmittance),
        "roughness": float(material.roughness),
        "spec_trans": 1.0,
        "eta": float(material.index),
    }


def facets(material: Material) -> Tree:
    """GGX facets of the widths of a material, along Mitsuba's tangents to the nearest quarter of a turn."""
    widths = float(material.alpha_along), float(material.alpha)
    if material.anisotropy == 0:
        return {"distribution": "ggx", "alpha": widths[1]}
    if round(material.anisotropy_rotation_degrees / 90) % 2:
        widths = widths[::-1]
    return {"distribution": "ggx", "alpha_u": widths[0], "alpha_v": widths[1]}


def conductor_bsdf(material: Material) -> Tree:
    """The plugin of a conductor, from both sides."""
    eta, k = material.complex_index
    tree: Tree = {"type": "conductor", "eta": rgb(eta), "k": rgb(k)}
    if material.alpha >= DELTA_ALPHA:
        tree |= {"type": "roughconductor", **facets(material)}
    return {"type": "twosided", "bsdf": tree}


def plastic_bsdf(material: Material) -> Tree:
    """The plugin of a coated base, from both sides."""
    tree: Tree = {"type": "plastic"}
    ours, theirs = 1 - internal_diffuse_transmittance(material.index), _polynomial_reflectance(material.index)
    if material.model == "rough-plastic" and material.alpha >= DELTA_ALPHA:
        tree = {"type": "roughplastic", "distribution": "ggx", "alpha": float(material.alpha)}
        ours, theirs = internal_reflectance(material.alpha, material.index), _sampled_reflectance(material)
    tree["diffuse_reflectance"] = rgb(_base_under_coat(material, ours, theirs))
    tree |= {"int_ior": float(material.index), "ext_ior": 1.0, "nonlinear": material.nonlinear}
    return {"type": "twosided", "bsdf": tree}


def _polynomial_reflectance(ior: float) -> float:
    """What ``plastic`` takes the coat to reflect of diffuse light within: a fit of Egan and Hilgeman 1973, which is up
    to 0.0006 too much for an index of 1.3 to 1.6, and wrong by more beyond 2."""
    return 0.0636 * ior + 0.6681 + 0.7099 / ior - 1.4399 / ior**2


def _sampled_reflectance(material: Material) -> float:
    """What ``roughplastic`` takes it for, the mean over 64 cosines from 0 to 1, both ends counted whole: about 1.5 %
    too little."""
    cosine = np.maximum(np.linspace(0, 1, 64), 1e-6)
    return float(2 * np.mean(cosine * rough_interface(material.alpha, 1 / material.index, cosine)[0]))


def _base_under_coat(material: Material, ours: float, theirs: float) -> Triple:
    """The albedo that makes Mitsuba's as bright as ours, where coats reflect so much of diffuse light within. One close
    to 1 would have to exceed 1, and is off by up to 1 % if the coat is rough."""
    albedo = np.array(material.albedo)
    once = albedo / (1 - ours * (albedo if material.nonlinear else 1))
    r, g, b = np.minimum(once / (1 + theirs * once) if material.nonlinear else once * (1 - theirs), 1).tolist()
    return (r, g, b)


def media(scene: Scene) -> dict[str, Medium]:
    """The fog, and the media of all shapes that absorb or scatter, by their keys in the tree of the scene."""
    names = dict.fromkeys(["", *(solid.material for solid in solids(scene))])
    return {medium_key(scene, name): medium for name in names if (medium := _medium_of(scene, name))}


def medium_tree(medium: Medium, file: Path) -> Tree:
    """The plugin of a medium; a grid is written to ``file``. The extinction coefficient in 1/m is a colour, which must
    not exceed 1, and its scale. A colour that is not extinguished at all has a millionth of the greatest coefficient:
    for one of 0 Mitsuba's ``volpath`` finds NaN, and its ``volpathmis`` too little light (3.9)."""
    scale = max(*medium.sigma_t, 1e-30)
    color = [max(s / scale, 1e-6) for s in medium.sigma_t]
    tree: Tree = {"albedo": rgb(medium.single_albedo), "scale": scale, "phase": {"type": "hg", "g": float(medium.g)}}
    if medium.density is None or medium.bounds is None:
        return {"type": "homogeneous", "sigma_t": rgb(color), **tree}
    write_volume(file, medium.density.values[..., None] * np.array(color))
    low, high = map(np.array, medium.bounds)
    box = np.eye(4)
    box[:3] = np.column_stack([np.diag(high - low), low])
    grid = {"type": "gridvolume", "filename": str(file), "raw": True, "to_world": box}
    return {"type": "heterogeneous", "sigma_t": grid, **tree}


def _medium_of(scene: Scene, name: str) -> Medium | None:
    """What is behind the surface of the material ``name``, if it does anything; without a name, the fog."""
    if not name:
        return scene.media[scene.fog.medium] if scene.fog else None
    material = scene.materials[name]
    if material.interior is not None:
        return scene.media[material.interior]
    return Medium(extinction=material.absorption, albedo=(0.0, 0.0, 0.0)) if max(material.absorption) > 0 else None


def medium_key(scene: Scene, name: str) -> str:
    return f"medium_{list(scene.materials).index(name)}" if name else "medium_fog"


def surroundings(scene: Scene) -> dict[str, str]:
    """By the name of each solid of ``scene`` the dielectric that it lies in, empty where that is air.

    Raises
    ------
    FragtracerError
        If one lies in another one only in part.
    """
    found = list(solids(scene))
    return {solid.name: _around(scene, solid, found) for solid in found}


def of_camera(scene: Scene) -> str:
    """The dielectric that the camera is in, empty where that is air."""
    found = [solid.material for solid in solids(scene) if solid.contains(scene.camera.position)]
    return max(found, key=lambda name: scene.materials[name].priority, default="")


def _around(scene: Scene, solid: Solid, others: list[Solid]) -> str:
    """The name of the dielectric that ``solid`` lies in, empty where that is air.

    Raises
    ------
    FragtracerError
        If it lies in one only in part.
    """
    found = ""
    for other in others:
        if other is solid or not other.overlaps(solid) or _contains(solid, other):
            continue
        priority = scene.materials[other.material].priority
        if not _contains(other, solid) or priority >= scene.materials[solid.material].priority:
            raise FragtracerError(
                f"Mitsuba cannot show the dielectrics {solid.material!r} and {other.material!r}, whose bounding boxes "
                "overlap: it knows no priorities; move them apart, or put one of them within the other"
            )
        if not found or priority > scene.materials[found].priority:
            found = other.material
    return found


def _contains(outer: Solid, inner: Solid) -> bool:
    """Whether all of ``inner`` lies in ``outer``, which is convex."""
    if isinstance(inner.shape, Plane):
        return False
    if isinstance(outer.shape, Sphere) and isinstance(inner.shape, Sphere):
        distance = np.linalg.norm(np.subtract(outer.shape.center, inner.shape.center))
        return float(distance) + inner.shape.radius < outer.shape.radius
    corners = np.stack(np.meshgrid(*zip(inner.low, inner.high, strict=True)), -1).reshape(-1, 3)
    return all(map(outer.contains, corners))
