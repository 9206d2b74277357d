# SPDX-License-Identifier: MIT
"""The controls of a page: what each shows, and which uniforms and words of u_scene it changes (web/src/controls.ts)."""

from collections.abc import Iterator
from typing import Any

from fragtracer.display.look import Look
from fragtracer.display.tone import TONE_CURVES
from fragtracer.packing import PackedScene
from fragtracer.packing.lights import LIGHT_RECORDS
from fragtracer.packing.records import places
from fragtracer.scene import Environment, RenderSettings, Scene

Control = dict[str, Any]


def controls(scene: Scene, settings: RenderSettings, packed: PackedScene, look: Look) -> list[Control]:
    """The controls that a scene has, with their first values."""
    stops = round(float(look.exposure), 3)
    found = [
        _slider("exposure", "Exposure", "exposure", stops, min(-8.0, stops), max(8.0, stops), 0.1, unit="stops"),
        {
            "id": "tonemap",
            "label": "Tone curve",
            "effect": "tonemap",
            "value": look.tonemap,
            "choices": list(TONE_CURVES),
            "targets": [],
        },
        _number("bounces", "Bounces", settings.bounces, 0, 32, "u_bounces"),
        _number("light_samples", "Light samples", settings.light_samples, 1, 16, "u_light_samples"),
    ]
    if scene.environment is not None:
        found += _environment(scene.environment, packed)
    return found


def _slider(
    name: str, label: str, effect: str, value: float, least: float, most: float, step: float, **more: Any
) -> Control:
    shown = {"id": name, "label": label, "effect": effect, "value": value, "min": least, "max": most, "step": step}
    return {**shown, "targets": [], **more}


def _number(name: str, label: str, value: int, least: int, most: int, uniform: str) -> Control:
    return _slider(name, label, "set", value, least, max(most, value), 1, targets=[{"uniform": uniform}])


def _environment(environment: Environment, packed: PackedScene) -> Iterator[Control]:
    """What turns an environment and makes it brighter, its sun too, where it is one of the lights."""
    turned: list[dict[str, Any]] = []
    scaled: list[dict[str, Any]] = []
    strength = environment.strength
    if packed.environment is not None:
        turned.append({"uniform": "u_environment_rotation"})
        scale = [packed.environment.unit * tint for tint in environment.tint]
        scaled.append({"uniform": "u_environment_scale", "value": scale})
    disc = environment.sky.disc if environment.sky else None
    if disc is not None and environment.sun is not None:
        first = 4 * packed.uniforms["u_first_sun_light"]
        word = {name: first + place for name, _, place in places(LIGHT_RECORDS["SunLight"])}
        turned.append({"word": word["direction"], "value": list(disc.direction)})
        radiance = [c * tint for c, tint in zip(disc.radiance, environment.tint, strict=True)]
        scaled.append({"word": word["radiance"], "value": radiance})
    if turned:
        degrees = environment.rotation_degrees % 360
        yield _slider("rotation", "Environment turned", "turn", degrees, 0, 360, 1, unit="°", targets=turned)
        most = 4 * strength
        yield _slider("strength", "Environment strength", "scale", strength, 0, most, most / 400, targets=scaled)
