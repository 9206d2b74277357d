# SPDX-License-Identifier: MIT
"""Emitters of a Mitsuba scene that belong to no shape.

Where the two differ, a note says so: the intensity of a ``spot`` falls linearly in the angle there, here as the square
of a linear function of its cosine. Skies are evaluated to maps, and their sun, with its mean radiance, is a sphere far
away. Rows of a map lie half a row nearer to the equator than there.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.io.images import read_image
from fragtracer.io.mitsuba.nodes import Node
from fragtracer.io.mitsuba.textures import Textures
from fragtracer.io.model import triple
from fragtracer.scene import DirectionalLight, Environment, Light, Panorama, SpotLight
from fragtracer.scene.environment import direction_of, lookup
from fragtracer.scene.fields import Triple
from fragtracer.scene.light import NARROWEST_SPOT

Floats = NDArray[np.float64]

_HALF_TURN = np.diag((-1.0, 1.0, -1.0))  # Mitsuba's map begins at -z, ours at +z
_SKY_ROWS = 256
_SUN_APERTURE = 0.5358  # degrees, where none is given
# In sizes of the scene, seen from all over which the sun is within 0.06 degrees then. Farther, and the bounds of all
# shapes grow for rounding (docs/meshes.md).
_SUN_DISTANCE = 1e3


@dataclass
class Emitters:
    """The lights of a scene, as they are added. ``notes`` are what is not as in Mitsuba."""

    mi: Any
    textures: Textures
    notes: list[str]
    lights: list[Light] = field(default_factory=list)
    spot_lights: list[SpotLight] = field(default_factory=list)
    directional_lights: list[DirectionalLight] = field(default_factory=list)
    environment: Environment | None = None
    _sun: tuple[Floats, float, Triple] | None = None  # towards it, half of its angle, and its radiance

    def add(self, node: Node) -> None:
        """An emitter of the scene."""
        with node.checked():
            self._add(node)

    def _add(self, node: Node) -> None:
        placed = node.matrix()
        match node.plugin:
            case "point":
                intensity = self._color(node, "intensity")
                position = triple(placed[:3, 3] + node.vector("position", (0.0, 0.0, 0.0)))
                self.lights.append(Light(position=position, power=_scaled(intensity, 4 * math.pi)))
            case "spot":
                self.spot_lights.append(self._spot(node, placed))
            case "directional":
                given = node.vector("direction", (0.0, 0.0, 1.0))
                direction = given if node.has("direction") else placed[:3, :3] @ given
                self.directional_lights.append(
                    DirectionalLight(direction=triple(direction), irradiance=self._color(node, "irradiance"))
                )
            case "constant":
                self._set(node, Environment(radiance=self._color(node, "radiance")))
            case "envmap":
                self._set(node, self._map(node, placed[:3, :3]))
            case "sunsky" | "timed_sunsky":
                self._set(node, Environment(image=self._sky(node)))
            case _:
                self.notes.append(f"{node.line}: {node.title}")

    def _set(self, node: Node, environment: Environment) -> None:
        if self.environment is not None:
            raise node.error("there is another environment; a scene has one")
        self.environment = environment

    def _color(self, node: Node, name: str) -> Triple:
        value = self.textures.radiance(node, name)
        if value.texture is not None:
            self.notes.append(f"{node.line}: the texture of {node.title}")
        return value.color

    def _spot(self, node: Node, placed: Floats) -> SpotLight:
        """One of about the same power, in the limit of a narrow cone (compare reference/lights.py)."""
        cutoff = min(node.number("cutoff_angle", 20.0), 90.0)
        beam = min(max(node.number("beam_width", 0.75 * cutoff), 0.0), cutoff)
        inner = math.sqrt(max(0.0, (cutoff * beam + beam**2) / 2))
        if node.named.get("texture") is not None:
            self.notes.append(f"{node.line}: the texture of {node.title}")
        self.notes.append(f"{node.line}: the falloff of {node.title}, that of glTF in its place")
        return SpotLight(
            position=triple(placed[:3, 3]),
            direction=triple(placed[:3, 2]),
            intensity=self._color(node, "intensity"),
            inner_degrees=max(0.0, min(inner, cutoff - NARROWEST_SPOT / 2)),
            outer_degrees=max(cutoff, NARROWEST_SPOT),
        )

    def _map(self, node: Node, rotation: Floats) -> Environment:
        """A map, resampled where it is turned about another axis than y."""
        path = node.file()
        try:
            pixels = read_image(path)
        except FragtracerError as error:
            raise node.error(str(error)) from None
        strength = node.number("scale", 1.0)
        turn = rotation @ _HALF_TURN
        if np.linalg.det(turn) > 0 and np.allclose(turn[1], (0, 1, 0), atol=1e-6):
            degrees = math.degrees(math.atan2(turn[0, 2], turn[0, 0]))
            return Environment(image=Panorama(pixels, str(path)), rotation_degrees=degrees, strength=strength)
        rows, columns, _ = pixels.shape
        u, v = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
        return Environment(image=Panorama(lookup(pixels, direction_of(u, v) @ turn)), strength=strength)

    def _sky(self, node: Node) -> Panorama:
        """What a sky emits, (256, 512, 3); its sun becomes a sphere, but for one that moves."""
        tree = node.as_dict()
        rows, columns = _SKY_ROWS, 2 * _SKY_ROWS
        v, u = np.divmod(np.arange(rows * columns), columns)
        directions = direction_of((u + 0.5) / columns, (v + 0.5) / rows)
        if node.plugin == "sunsky":
            half_angle = math.radians(node.number("sun_aperture", _SUN_APERTURE) / 2)
            sun = self.mi.load_dict(tree | {"sky_scale": 0.0})
            direction = np.array(self.mi.traverse(sun)["sun_direction"], np.float64)
            direction /= np.linalg.norm(direction)
            radiance = self._emitted(sun, _disc(direction, half_angle)).mean(axis=0)
            if radiance.max() > 0:
                self._sun = direction, half_angle, triple(radiance)
            tree["sun_scale"] = 0.0
        return Panorama(self._emitted(self.mi.load_dict(tree), directions).reshape(rows, columns, 3))

    def _emitted(self, emitter: Any, directions: Floats) -> Floats:
        """What an emitter at infinity emits from ``directions`` (n, 3), radiance (n, 3)."""
        si = self.mi.SurfaceInteraction3f()
        found = np.empty((len(directions), 3))
        for i, wi in enumerate((-directions).tolist()):
            si.wi = wi
            found[i] = emitter.eval(si)
        return found

    def sun(self, low: Floats, high: Floats) -> list[Light]:
        """The sun of a sky as a sphere, far from the bounding box of the scene, if there is one."""
        if self._sun is None:
            return []
        direction, half_angle, radiance = self._sun
        distance = _SUN_DISTANCE * (float(np.linalg.norm(high - low)) or 1.0)
        position = triple((low + high) / 2 + distance * direction)
        return [Light(position=position, radius=distance * math.sin(half_angle), radiance=radiance)]


def _disc(axis: Floats, half_angle: float) -> Floats:
    """Directions (n, 3) that are spread evenly over a cone."""
    steps = (np.arange(32) + 0.5) / 32
    one_minus_cos, phi = (x.ravel() for x in np.meshgrid(2 * math.sin(half_angle / 2) ** 2 * steps, 2 * np.pi * steps))
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x /= np.linalg.norm(x)
    around = np.cos(phi)[:, None] * x + np.sin(phi)[:, None] * np.cross(axis, x)
    sine = np.sqrt(one_minus_cos * (2 - one_minus_cos))
    found: Floats = sine[:, None] * around + (1 - one_minus_cos)[:, None] * axis
    return found


def _scaled(color: Triple, factor: float) -> Triple:
    r, g, b = (factor * channel for channel in color)
    return (r, g, b)
