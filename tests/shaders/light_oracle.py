# SPDX-License-Identifier: MIT
"""The table of all lights of a scene: what each is tried with, and the irradiance that it gives in closed form.

Whatever is asked of every light is asked of each entry of :data:`LIGHTS`: its irradiance, how often it is chosen and
the record that the shader reads (test_light.py, test_scene_layout.py), and the picture beside Mitsuba's
(test_reference_scenes.py). A new light needs an entry, and no test of its own for these.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fragtracer.scene import DirectionalLight, Light, SpotLight

from . import Floats


@dataclass(frozen=True)
class LightModel:
    """A field of the scene.

    Attributes
    ----------
    examples
        Lights about the origin, which they shine on from above.
    random
        From random numbers, a place (3,) and a scale in metres: lights that lie there.
    irradiance
        Of a light and a unit normal (3,): what it gives the origin, (3,) in W/m², if it is wholly above the horizon.
    """

    examples: Mapping[str, Any]
    random: Callable[[np.random.Generator, Floats, float], list[Any]]
    irradiance: Callable[[Any, Floats], Floats]


def sphere_irradiance(center: Floats, radius: float, normal: Floats) -> float:
    """Of radiance 1."""
    distance = np.linalg.norm(center)
    return float(np.pi * (radius / distance) ** 2 * (center @ normal) / distance)


def light_irradiance(light: Light, normal: Floats) -> Floats:
    place = np.array(light.position)
    if light.radius > 0:
        return sphere_irradiance(place, light.radius, normal) * np.array(light.surface_radiance)
    return np.array(light.intensity) * (place @ normal) / np.linalg.norm(place) ** 3


def random_lights(rng: np.random.Generator, place: Floats, scale: float) -> list[Light]:
    return [
        Light(place + scale * rng.normal(size=3), radius=0.2 * scale, power=(3.0, 2.0, 1.0)),
        Light(place + scale * rng.normal(size=3), power=(1.0, 2.0, 3.0)),
        Light(place + scale * rng.normal(size=3), radius=0.05 * scale, radiance=(5.0, 5.0, 5.0)),
    ]


def khronos_falloff(spot: SpotLight, direction: Floats) -> Floats:
    """Of unit directions (..., 3) from the light, as KHR_lights_punctual has it: the square of what is linear in the
    cosine of the angle, 1 at the inner and 0 at the outer angle. Cosines are subtracted as products of sines."""
    inner, outer = np.radians([spot.inner_degrees, spot.outer_degrees])
    axis = np.array(spot.direction) / np.linalg.norm(spot.direction)
    angle = np.arctan2(np.linalg.norm(np.cross(direction, axis), axis=-1), direction @ axis)
    fallen = np.sin((outer + angle) / 2) * np.sin((outer - angle) / 2)
    falloff: Floats = np.clip(fallen / (np.sin((outer + inner) / 2) * np.sin((outer - inner) / 2)), 0, 1) ** 2
    return falloff


def spot_irradiance(spot: SpotLight, normal: Floats) -> Floats:
    place = np.array(spot.position)
    distance = np.linalg.norm(place)
    intensity: Floats = np.array(spot.intensity) * khronos_falloff(spot, -place / distance)
    return intensity * (place @ normal) / distance**3


def directional_irradiance(light: DirectionalLight, normal: Floats) -> Floats:
    cosine = -(np.array(light.direction) @ normal) / np.linalg.norm(light.direction)
    return np.array(light.irradiance) * cosine


LIGHTS: dict[str, LightModel] = {
    "lights": LightModel(
        {
            "point": Light((0.5, 1.0, 1.0), power=(30.0, 20.0, 10.0)),
            "globe": Light((0.0, 1.5, -1.5), radius=0.5, radiance=(1.0, 2.0, 3.0)),
        },
        random_lights,
        light_irradiance,
    ),
    "spot_lights": LightModel(
        {"spot": SpotLight((0.4, 2.0, -0.3), (-0.2, -1.0, 0.3), (6.0, 5.0, 4.0), 10.0, 40.0)},
        lambda rng, place, scale: [
            SpotLight(place + scale * rng.normal(size=3), rng.normal(size=3), (2.0, 1.0, 3.0), 20.0, 50.0)
        ],
        spot_irradiance,
    ),
    "directional_lights": LightModel(
        {"directional": DirectionalLight((0.3, -2.0, 0.4), (0.9, 0.8, 0.7))},
        lambda rng, place, scale: [DirectionalLight(rng.normal(size=3), (0.5, 0.7, 0.2))],
        directional_irradiance,
    ),
}
