# SPDX-License-Identifier: MIT
"""Lights: a list, and the numbers of one."""

import numpy as np

from fragtracer.apps.viewer.panels import widgets
from fragtracer.scene import Light

_UNITS = ("power", "radiance")
_STRONGEST = 1e6


def edit(light: Light) -> Light:
    """Controls for ``light``; its colour and its strength are apart."""
    new: dict[str, object] = {"position": widgets.point("Position", light.position)}
    unit = "power" if light.power is not None else "radiance"
    if light.radius > 0:
        chosen = widgets.choice("Given as", unit, _UNITS, "Power stays when the radius changes; radiance does not.")
        if chosen != unit:
            return in_unit(light, chosen)
    value = light.power if light.power is not None else light.radiance
    assert value is not None
    strength = max(value)
    color = tuple(x / strength for x in value) if strength > 0 else (1.0, 1.0, 1.0)
    color = widgets.color("Colour", (color[0], color[1], color[2]))
    form = "%.2f W" if unit == "power" else "%.2f W/m²/sr"
    strength = widgets.number(unit.capitalize(), strength, max(strength, 0.1) * 0.01, 0.0, _STRONGEST, form)
    peak = max(*color, 1e-6)
    new[unit] = tuple(x / peak * strength for x in color)
    lowest = 0.0 if unit == "power" else 1e-4
    new["radius"] = widgets.number(
        "Radius", light.radius, 0.002, lowest, 1000.0, "%.3f m", "0 is a point: hard shadows."
    )
    return _unless_rounding(light, widgets.edited(light, **new))


def in_unit(light: Light, unit: str) -> Light:
    """The same light with its strength given as "power" or "radiance"; its radius is not 0."""
    radiance = light.surface_radiance
    if unit == "radiance":
        return Light(light.position, light.radius, radiance=radiance)
    r, g, b = (4 * np.pi**2 * light.radius**2 * x for x in radiance)
    return Light(light.position, light.radius, power=(r, g, b))


def _unless_rounding(before: Light, after: Light) -> Light:
    """``before`` if all that changed is the last digit of a strength that was taken apart and put together."""
    old, new = (light.power or light.radiance or (0.0, 0.0, 0.0) for light in (before, after))
    same = np.allclose(old, new, rtol=1e-9, atol=0)
    return before if same and (after.position, after.radius) == (before.position, before.radius) else after
