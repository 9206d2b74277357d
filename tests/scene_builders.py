# SPDX-License-Identifier: MIT
"""Scenes that the image tests are made of, and ways to make another scene of one."""

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from fragtracer.scene import (
    Ambient,
    Camera,
    DirectionalLight,
    Disk,
    Light,
    Material,
    Plane,
    Rectangle,
    Scene,
    Sphere,
    SpotLight,
    Triangle,
)

Vector = tuple[float, float, float]

# In scene files.
RED = "\n[material.red]\n"
SPHERE = '[[sphere]]\ncenter = [0, 1, 2]\nradius = 1\nmaterial = "red"\n'


def lambert(albedo: Any, emission: Any = 0.0) -> Material:
    return Material(albedo=albedo, specular=0.0, emission=emission)


def all_lambert(scene: Scene) -> Scene:
    """The scene with a Lambert surface in place of every material, of the colour that most tells it apart."""
    changed = {name: lambert(m.base_color, m.emission) for name, m in scene.materials.items()}
    return replace(scene, materials=changed)


def stare(target: Vector, position: Vector) -> Camera:
    """A camera that sees one point: a spot of a ten-millionth of its distance."""
    view = np.subtract(target, position)
    up = (0.0, 1.0, 0.0) if abs(view[1]) < 0.9 * np.linalg.norm(view) else (0.0, 0.0, 1.0)
    return Camera(position, target, up, fov_degrees=1e-5)


def rectangle(center: Vector, edge_u: Vector, edge_v: Vector, material: str) -> Rectangle:
    """By its centre; the front is along edge_u × edge_v."""
    corner = np.subtract(center, np.add(edge_u, edge_v) / 2)
    return Rectangle(corner, edge_u, edge_v, material)


def triangles_of(rectangle: Rectangle) -> tuple[Triangle, Triangle]:
    """The two halves of a rectangle, their fronts the same."""
    a = np.asarray(rectangle.corner)
    u, v = np.asarray(rectangle.edge_u), np.asarray(rectangle.edge_v)
    first = (tuple(a), tuple(a + u), tuple(a + u + v))
    second = (tuple(a), tuple(a + u + v), tuple(a + v))
    return Triangle(first, rectangle.material), Triangle(second, rectangle.material)


def box(material: str, half: float = 1.0) -> list[Rectangle]:
    """Six rectangles around the origin, their fronts inside."""
    axes = np.eye(3) * 2 * half
    walls = []
    for i in range(3):
        u, v = axes[(i + 1) % 3], axes[(i + 2) % 3]
        walls.append(rectangle(tuple(-axes[i] / 2), tuple(u), tuple(v), material))
        walls.append(rectangle(tuple(axes[i] / 2), tuple(v), tuple(u), material))
    return walls


def everything() -> Scene:
    """Some of each kind of shape, light and material."""
    materials = {
        "matte": lambert((0.7, 0.6, 0.5)),
        "gold": Material(metal="gold", roughness=0.3),
        "lamp": lambert(0.2, (3.0, 2.0, 1.0)),
    }
    half = ((-2.0, 0.0, -1.0), (-1.0, 0.0, -1.0), (-1.5, 1.0, -1.0))
    return Scene(
        Camera((0.0, 1.0, 5.0), (0.0, 0.5, 0.0), fov_degrees=40.0),
        materials,
        spheres=[Sphere((0.0, 0.5, 0.0), 0.5, "gold"), Sphere((2.0, 1.5, -1.0), 0.2, "lamp")],
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matte")],
        rectangles=[rectangle((0.0, 1.0, -2.0), (3.0, 0.0, 0.0), (0.0, 2.0, 0.0), "matte")],
        disks=[Disk((0.0, 2.5, 0.0), (0.0, -1.0, 0.0), 0.5, "lamp")],
        triangles=[Triangle(half, "matte")],
        lights=[Light((1.0, 2.0, 2.0), power=10.0), Light((-1.0, 2.0, 2.0), 0.1, power=10.0)],
        spot_lights=[SpotLight((0.0, 3.0, 1.0), (0.0, -1.0, 0.0), 5.0)],
        directional_lights=[DirectionalLight((0.3, -1.0, -0.2), 0.5)],
        ambient=Ambient(0.1),
    )


# What each field of the scene model is, for the two functions below: a field that is not here raises.
_POINTS = {"position", "target", "center", "point", "corner", "vertices"}
_LENGTHS = {"edge_u", "edge_v", "radius", "aperture_radius", "focus_distance"}
_AREAS = {"power", "intensity"}  # W and W/sr; radiance and irradiance stay
_OTHERS = {
    *("up", "fov_degrees", "normal", "direction", "inner_degrees", "outer_degrees"),
    *("material", "radiance", "irradiance", "name", "description"),
    *("render", "materials", "media", "fog", "environment"),
}


def scaled(scene: Scene, factor: float) -> Scene:
    """The scene with every length times ``factor`` and every power times its square: the same image."""
    changes: dict[str, Callable[[Any], Any]] = {
        **dict.fromkeys(_POINTS | _LENGTHS, lambda x: _each(x, lambda v: v * factor)),
        **dict.fromkeys(_AREAS, lambda x: _each(x, lambda v: v * factor**2)),
    }
    return _changed(scene, changes)


def moved(scene: Scene, offset: Vector) -> Scene:
    """The scene with everything, the camera too, moved by ``offset``."""

    def move(point: Any) -> Any:
        if isinstance(point[0], tuple):
            return tuple(move(p) for p in point)
        return tuple(float(x) for x in np.add(point, offset))

    return _changed(scene, dict.fromkeys(_POINTS, move))


def _each(value: Any, change: Callable[[float], float]) -> Any:
    if value is None:
        return None
    return tuple(_each(v, change) for v in value) if isinstance(value, tuple) else change(value)


def _changed(item: Any, changes: dict[str, Callable[[Any], Any]]) -> Any:
    """A copy of a dataclass in which the fields named in ``changes`` are changed, at every depth."""
    new = {}
    for field in fields(item):
        value = getattr(item, field.name)
        if field.name in changes:
            new[field.name] = changes[field.name](value)
        elif field.name in _OTHERS | _POINTS | _LENGTHS | _AREAS:
            continue
        elif is_dataclass(value):
            new[field.name] = _changed(value, changes)
        elif isinstance(value, Sequence) and not isinstance(value, str):
            new[field.name] = tuple(_changed(v, changes) for v in value)
        else:
            raise TypeError(f"say in scene_builders.py what {type(item).__name__}.{field.name} is")
    return replace(item, **new)
