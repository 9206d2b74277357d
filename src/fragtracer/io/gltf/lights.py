# SPDX-License-Identifier: MIT
"""Punctual lights of glTF (Khronos Group, KHR_lights_punctual) to lights of the scene model.

Photometric numbers are taken for radiometric ones: 1 cd is 1 W/sr, 1 lx is 1 W/m².
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.container import Container
from fragtracer.io.gltf.nodes import Matrix, PlacedNode
from fragtracer.io.model import triple
from fragtracer.scene import DirectionalLight, Light, SpotLight
from fragtracer.scene.fields import LARGEST, Triple
from fragtracer.scene.light import NARROWEST_SPOT

EXTENSION = "KHR_lights_punctual"
_WIDEST_INNER = 0.999  # of the outer cone angle, where a file gives both the same or the inner more


@dataclass
class Lights:
    """The lights of one model by kind, in world space."""

    point: list[Light] = field(default_factory=list)
    spot: list[SpotLight] = field(default_factory=list)
    directional: list[DirectionalLight] = field(default_factory=list)


def read_lights(container: Container, placed: Iterable[PlacedNode], notes: list[str]) -> Lights:
    """The lights of all nodes; ``notes`` takes what is ignored.

    Raises SceneError where a light does not exist or is not valid.
    """
    given = container.extension(gltf.PunctualLights, container.document, EXTENSION, "document")
    lights = Lights()
    for index, node, matrix in placed:
        place = f"nodes[{index}]"
        link = container.extension(gltf.NodeLight, node, EXTENSION, place)
        if link is not None:
            light: gltf.PunctualLight = container.item(given.lights if given else [], link.light, f"{place}.light")
            notes += ["the range of lights"] if light.range is not None else []
            if light.type != "point" and not matrix[:3, 2].any():
                notes.append(f"the light of {place} (its scale of 0 leaves it no direction)")
            else:
                _add(lights, light, matrix)
    return lights


def _add(lights: Lights, light: gltf.PunctualLight, matrix: Matrix) -> None:
    if light.type == "point":
        lights.point.append(Light(triple(matrix[:3, 3]), power=_strength(light, 4 * np.pi)))
        return
    along = -matrix[:3, 2] / np.abs(matrix[:3, 2]).max()
    direction = triple(along / np.linalg.norm(along))
    if light.type == "directional":
        lights.directional.append(DirectionalLight(direction, _strength(light)))
        return
    outer = min(max(float(np.degrees(light.spot.outerConeAngle)), NARROWEST_SPOT), 90.0)
    inner = min(float(np.degrees(light.spot.innerConeAngle)), _WIDEST_INNER * outer)
    lights.spot.append(SpotLight(triple(matrix[:3, 3]), direction, _strength(light), inner, outer))


def _strength(light: gltf.PunctualLight, factor: float = 1.0) -> Triple:
    r, g, b = (min(factor * light.intensity * channel, LARGEST) for channel in light.color)
    return (r, g, b)
