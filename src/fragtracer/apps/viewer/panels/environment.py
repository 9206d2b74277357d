# SPDX-License-Identifier: MIT
"""Controls of the environment: a preset or an image, its rotation and its strength."""

from dataclasses import replace
from pathlib import Path

from fragtracer.apps.viewer.panels import widgets
from fragtracer.scene import Environment, Gradient, Sky

PRESETS = {
    "Even light": Environment(radiance=(1.0, 1.0, 1.0)),
    "Overcast": Environment(gradient=Gradient((1.2, 1.23, 1.29), (0.4, 0.41, 0.43), (0.1, 0.09, 0.08))),
    "Studio": Environment(gradient=Gradient((2.0, 2.0, 2.0), (0.15, 0.15, 0.16), (0.05, 0.05, 0.05))),
    "Clear sky": Environment(sky=Sky(), strength=0.03),
    "Low sun": Environment(sky=Sky(turbidity=4.0, sun_elevation_degrees=6.0, sun_azimuth_degrees=110.0), strength=0.06),
}
_STRONGEST = 1e6
_GRADIENT = ("zenith", "horizon", "ground")


def edit(environment: Environment | None, last: Environment | None) -> Environment | None:
    """Controls for ``environment``; ``last`` is restored when it is switched on again."""
    lit = widgets.check("Light", environment is not None)
    if not lit:
        return None
    if environment is None:
        return last or PRESETS["Clear sky"]
    name = name_of(environment)
    names = [*PRESETS] if name in PRESETS else [name, *PRESETS]
    chosen = widgets.choice("Preset", name, names, "Or drop an .hdr or .exr file on the window.")
    if chosen != name:
        return replace(PRESETS[chosen], rotation_degrees=environment.rotation_degrees, visible=environment.visible)
    if environment.image is not None:
        height, width, _ = environment.image.pixels.shape
        widgets.pair("Picture", f"{width} × {height}")
    changes: dict[str, object] = {
        "rotation_degrees": widgets.slider("Rotation", environment.rotation_degrees, -180.0, 180.0, "%.1f°"),
        "strength": widgets.number(
            "Strength", environment.strength, max(environment.strength, 1e-3) * 0.01, 0.0, _STRONGEST, "%.4g"
        ),
        "tint": widgets.color("Tint", environment.tint),
        "visible": widgets.check("Visible", environment.visible),
    }
    if not environment.visible:
        changes["background"] = widgets.color("Background", environment.background, hdr=True)
    if environment.radiance is not None:
        changes["radiance"] = widgets.color("Radiance", environment.radiance, hdr=True)
    if environment.gradient is not None:
        changes["gradient"] = _gradient(environment.gradient)
    if environment.sky is not None:
        changes["sky"] = _sky(environment.sky)
    return widgets.edited(environment, **changes)


def name_of(environment: Environment) -> str:
    """The name of the preset with the same source, or of its file."""
    if environment.image is not None:
        return Path(environment.image.file).name if environment.image.file else "Picture"
    return next((name for name, preset in PRESETS.items() if preset.source == environment.source), "Edited")


def _gradient(gradient: Gradient) -> Gradient:
    colors = {name: widgets.color(name.capitalize(), getattr(gradient, name), hdr=True) for name in _GRADIENT}
    return widgets.edited(gradient, **colors)


def _sky(sky: Sky) -> Sky:
    return widgets.edited(
        sky,
        sun=widgets.check("Sun", sky.sun),
        sun_elevation_degrees=widgets.slider("Elevation", sky.sun_elevation_degrees, -10.0, 90.0, "%.1f°"),
        sun_azimuth_degrees=widgets.slider("Azimuth", sky.sun_azimuth_degrees, -180.0, 180.0, "%.1f°"),
        sun_radius_degrees=widgets.slider("Sun radius", sky.sun_radius_degrees, 0.05, 10.0, "%.2f°", log=True),
        turbidity=widgets.slider("Turbidity", sky.turbidity, 1.0, 10.0, "%.1f"),
        ground_albedo=widgets.slider("Ground albedo", sky.ground_albedo, 0.0, 1.0, "%.2f"),
    )
