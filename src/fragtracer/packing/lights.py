# SPDX-License-Identifier: MIT
"""All that emits, as records that light samples choose from."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.alias import chances
from fragtracer.packing.materials import plain_emission
from fragtracer.scene import Light, Material, Rectangle, Scene, Sphere, Triangle
from fragtracer.shader_composer import CONSTANTS

Floats = NDArray[np.float64]


def light_records(
    scene: Scene,
    spheres: Sequence[Sphere],
    materials: Mapping[str, Material],
    origin: Floats,
    mesh_power: float,
    distant: Sequence[dict[str, Any]],
) -> list[dict[str, Any]]:
    """The records of all that emits, the meshes together first and ``distant`` lights last, each with the power
    that decides how often it is chosen."""
    first_rectangle = len(spheres) + len(scene.planes)
    shapes: list[tuple[int, Any]] = list(enumerate(spheres))
    shapes += enumerate([*scene.rectangles, *scene.triangles], first_rectangle)
    found = [{"kind": CONSTANTS["LIGHT_MESH"], "primitive": -1, "power": mesh_power}] if mesh_power > 0 else []
    found += [
        _shape_light(shape, emission, origin) | {"primitive": primitive}
        for primitive, shape in shapes
        if max(emission := plain_emission(materials[shape.material])) > 0
    ]
    found += [_point_light(light, origin) for light in scene.lights if light.radius == 0 and max(light.intensity) > 0]
    found += distant
    power = np.array([light.pop("power") for light in found])
    probability = chances(power)
    for light, p, cumulative in zip(found, probability, np.cumsum(probability), strict=True):
        light |= {"probability": p, "cumulative": cumulative}
    return found


def _shape_light(shape: Sphere | Rectangle | Triangle, radiance: Sequence[float], origin: Floats) -> dict[str, Any]:
    light: dict[str, Any] = {"radiance": radiance}
    if isinstance(shape, Sphere):
        light |= {"kind": CONSTANTS["LIGHT_SPHERE"], "radius": shape.radius}
        light |= {"position": np.subtract(shape.center, origin)}
        return light | {"power": 4 * np.pi**2 * shape.radius**2 * sum(radiance)}
    if isinstance(shape, Rectangle):
        corner, edge_u, edge_v = (np.asarray(v, np.float64) for v in (shape.corner, shape.edge_u, shape.edge_v))
        light |= {"kind": CONSTANTS["LIGHT_RECTANGLE"]}
    else:
        corner, b, c = (np.asarray(v, np.float64) for v in shape.vertices)
        edge_u, edge_v = b - corner, c - corner
        light |= {"kind": CONSTANTS["LIGHT_TRIANGLE"]}
    normal = np.cross(edge_u, edge_v)
    light |= {"position": corner - origin, "edge_u": edge_u, "edge_v": edge_v, "area": shape.area}
    return light | {"normal": normal / np.linalg.norm(normal), "power": np.pi * shape.area * sum(radiance)}


def _point_light(light: Light, origin: Floats) -> dict[str, Any]:
    intensity = light.intensity
    place = {"kind": CONSTANTS["LIGHT_POINT"], "position": np.subtract(light.position, origin), "primitive": -1}
    return place | {"radiance": intensity, "power": 4 * np.pi * sum(intensity)}
