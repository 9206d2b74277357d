# SPDX-License-Identifier: MIT
"""Controls of one light, and new lights."""

from typing import Any

import numpy as np

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer.panels import widgets
from fragtracer.apps.viewer.panels.widgets import Triple
from fragtracer.scene import Camera, DirectionalLight, Light, SpotLight

NEW = {"lights": "light", "spot_lights": "spot light", "directional_lights": "directional light"}
_UNITS = ("power", "radiance")
_SMALLEST = 1e-6  # radius, of what is looked at, of a light that is no point
_NARROWEST = 0.1  # degrees from the inner to the outer angle of a spot light
_IRRADIANCE = 20 / np.pi  # W/m² that a new light gives to what the camera looks at


def edit(light: Any, around: float) -> Any:
    """Controls for ``light``, where ``around`` metres are looked at; its colour and its strength are apart."""
    match light:
        case SpotLight():
            return _spot(light, around)
        case DirectionalLight():
            return _directional(light)
        case Light():
            return _spherical(light, around)
    return light  # of a kind without controls


def _spherical(light: Light, around: float) -> Light:
    new: dict[str, object] = {"position": widgets.point("Position", light.position, around)}
    unit = "power" if light.power is not None else "radiance"
    if light.radius > 0:
        chosen = widgets.choice("Given as", unit, _UNITS, "Power stays when the radius changes; radiance does not.")
        if chosen != unit:
            return in_unit(light, chosen)
    value = light.power if light.power is not None else light.radiance
    assert value is not None
    new[unit] = _strength(unit.capitalize(), value, "W" if unit == "power" else "W/m²/sr")
    lowest = 0.0 if unit == "power" else _SMALLEST
    new["radius"] = widgets.length("Radius", light.radius, around, lowest, "0 is a point: hard shadows.")
    return widgets.edited(light, **new)


def _spot(light: SpotLight, around: float) -> SpotLight:
    inner, outer = light.inner_degrees, light.outer_degrees
    return widgets.edited(
        light,
        position=widgets.point("Position", light.position, around),
        direction=widgets.vector("Direction", light.direction),
        intensity=_strength("Intensity", light.intensity, "W/sr"),
        inner_degrees=widgets.slider("Inner angle", inner, 0.0, max(0.0, outer - _NARROWEST), "%.1f°"),
        outer_degrees=widgets.slider("Outer angle", outer, min(90.0, inner + _NARROWEST), 90.0, "%.1f°"),
    )


def _directional(light: DirectionalLight) -> DirectionalLight:
    return widgets.edited(
        light,
        direction=widgets.vector("Direction", light.direction),
        irradiance=_strength("Irradiance", light.irradiance, "W/m²"),
    )


def _strength(text: str, value: Triple, unit: str) -> Triple:
    """Controls for the colour of ``value`` and its largest channel; ``value`` itself unless one was changed."""
    strength = max(value)
    r, g, b = value
    color = (r / strength, g / strength, b / strength) if strength > 0 else (1.0, 1.0, 1.0)
    new_color = widgets.color("Colour", color)
    new_strength = widgets.quantity(text, strength, 0.01 * strength or 0.001, 0.0, unit)
    if (new_color, new_strength) == (color, strength):
        return value
    r, g, b = new_color
    scale = new_strength / max(*new_color, 1e-6)
    return r * scale, g * scale, b * scale


def in_unit(light: Light, unit: str) -> Light:
    """The same light with its strength given as "power" or "radiance"; its radius is not 0."""
    radiance = light.surface_radiance
    if unit == "radiance":
        return widgets.edited(light, power=None, radiance=radiance)
    r, g, b = (4 * np.pi**2 * light.radius**2 * x for x in radiance)
    return widgets.edited(light, power=(r, g, b), radiance=None)


def new_light(kind: str, camera: Camera) -> Light | SpotLight | DirectionalLight:
    """A white light of ``kind``, one of :data:`NEW`, from above on what ``camera`` looks at."""
    x, y, z = camera.target
    distance = cameras.distance(camera)
    height = 0.5 * distance
    above = (x, y + height, z)
    intensity = _IRRADIANCE * height**2
    match kind:
        case "spot_lights":
            return SpotLight(above, (0.0, -1.0, 0.0), _grey(intensity))
        case "directional_lights":
            return DirectionalLight((0.0, -1.0, 0.0), _grey(_IRRADIANCE))
        case _:
            return Light(above, 0.05 * distance, power=_grey(4 * np.pi * intensity))


def _grey(value: float) -> Triple:
    return value, value, value
