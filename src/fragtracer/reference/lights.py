# SPDX-License-Identifier: MIT
"""Lights as Mitsuba's emitters."""

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.reference.plugins import SPHERE_LIGHT, SPOT
from fragtracer.reference.shapes import Tree, rgb, towards
from fragtracer.scene import DirectionalLight, Light, SpotLight
from fragtracer.scene.fields import Triple

TYPES = ("area", "point", "spot", "directional", SPOT, SPHERE_LIGHT)  # of emitters below


_FARTHEST = 400  # radii from a sphere, beyond which Mitsuba's 1 - cos of its cone is off by more than 1 %


def emitter(light: Any, target: Triple, plugins: bool) -> Tree:
    """A light of any kind, with fragtracer's own ``plugins`` where Mitsuba has none that is the same, or else the
    nearest to it as seen from the camera's ``target``."""
    match light:
        case SpotLight():
            return _spot(light) if plugins else _nearest_spot(light)
        case DirectionalLight():
            return _directional(light)
        case Light():
            return _light(light, target, plugins)
    raise TypeError(f"there is no {type(light).__name__} in Mitsuba")


def note(light: Any, target: Triple, plugins: bool) -> str | None:
    """What a light becomes in an exported scene, and how near that is; None where it is the same."""
    if isinstance(light, SpotLight):
        return _spot_note(light, plugins)
    if isinstance(light, Light) and light.radius > 0 and not plugins and _is_far(light, target):
        return "point, nearly the same: no width, of so small a sphere Mitsuba would round the solid angle"
    return None


def _is_far(light: Light, target: Triple) -> bool:
    return math.dist(light.position, target) > _FARTHEST * light.radius


def _light(light: Light, target: Triple, plugins: bool) -> Tree:
    """A ``point`` emitter, or a black sphere that emits."""
    if light.radius == 0 or (not plugins and _is_far(light, target)):
        area = math.pi * light.radius**2  # as seen from anywhere
        intensity = light.intensity if light.radius == 0 else [area * radiance for radiance in light.surface_radiance]
        return {"type": "point", "position": list(light.position), "intensity": rgb(intensity)}
    return black_sphere(light.position, light.radius, light.surface_radiance, plugins)


def black_sphere(center: Iterable[float], radius: float, radiance: Iterable[float], plugins: bool) -> Tree:
    """A sphere that emits ``radiance`` and reflects nothing."""
    sphere: Tree = {"type": "sphere", "center": [float(x) for x in center], "radius": float(radius)}
    emitter: Tree = {"type": "area", "radiance": rgb(radiance)}
    black = {"type": "diffuse", "reflectance": rgb((0, 0, 0))}
    return sphere | {"bsdf": black, "emitter": sphere_light(sphere, emitter) if plugins else emitter}


def sphere_light(shape: Tree, emitter: Tree) -> Tree:
    """fragtracer's own plugin where ``shape`` is a sphere and ``emitter`` uniform; else ``emitter``."""
    if shape["type"] != "sphere" or emitter["type"] != "area" or emitter["radiance"]["type"] != "rgb":
        return emitter
    size = {"center": shape["center"], "radius": shape["radius"]}
    return {"type": SPHERE_LIGHT, "radiance": emitter["radiance"]["value"]} | size


def _directional(light: DirectionalLight) -> Tree:
    """Mitsuba's ``directional``, the same."""
    return {"type": "directional", "direction": list(light.direction), "irradiance": rgb(light.irradiance)}


def _spot(light: SpotLight) -> Tree:
    """fragtracer's own plugin, the same."""
    return {
        "type": SPOT,
        "position": list(light.position),
        "direction": list(light.direction),
        "intensity": list(light.intensity),
        "inner_degrees": float(light.inner_degrees),
        "outer_degrees": float(light.outer_degrees),
    }


def _nearest_spot(light: SpotLight) -> Tree:
    """Mitsuba's ``spot`` of the same intensity on the axis, the same cone and nearly the same power."""
    return {
        "type": "spot",
        "to_world": towards(light.position, light.direction),
        "intensity": rgb(light.intensity),
        "cutoff_angle": float(light.outer_degrees),
        "beam_width": _beam_width(light),
    }


def _beam_width(light: SpotLight) -> float:
    """Degrees from the axis where Mitsuba's linear falloff begins, for equal powers in the limit of a narrow cone.

    There ours is (outer² + 2 inner²) / 3 per unit of pi times intensity, that of a linear falloff
    (outer² + outer beam + beam²) / 3.
    """
    inner, outer = light.inner_degrees, light.outer_degrees
    return (math.sqrt(outer**2 + 8 * inner**2) - outer) / 2


def _spot_note(light: SpotLight, plugin: bool) -> str:
    if plugin:
        return f"{SPOT}, the same"
    beam, outer = np.radians([_beam_width(light), light.outer_degrees])
    solid_angle = 2 * math.pi * (1 - (math.sin(outer) - math.sin(beam)) / (outer - beam))
    share = solid_angle / replace(light, intensity=(1.0, 1.0, 1.0)).power[0] - 1
    return f"spot, nearly the same: intensity falls linearly in the angle, power {100 * share:+.1f} %"
