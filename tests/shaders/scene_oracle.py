# SPDX-License-Identifier: MIT
"""The table of all shapes of a scene, and where rays meet them, one by one and in float64.

Whatever is asked of every shape is asked of each entry of :data:`SHAPES`: hits in every kind of storage, distances and
surfaces (test_intersect.py), the record that the shader reads (test_scene_layout.py), and the picture beside Mitsuba's
(test_reference_scenes.py). A new shape needs an entry and its distances in :func:`bounds`, and no test of its own for
these.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from fragtracer import scene as model
from fragtracer.packing.shapes import FLATS, Kind, disk_axes
from fragtracer.scene import Disk, Plane, Rectangle, Scene, Sphere, Triangle

from . import Floats, shape_oracle

Flat = Rectangle | Disk | Triangle
Shape = Sphere | Plane | Flat


def shapes_of(scene: Scene) -> list[Shape]:
    """In the order of their records, where they are on the short list; a round light's material is "light[i]"."""
    lights = [Sphere(s.position, s.radius, f"light[{i}]") for i, s in enumerate(scene.lights) if s.radius > 0]
    others = [s for kind in model.SHAPES if kind not in ("planes", "spheres") for s in getattr(scene, kind)]
    return [*scene.planes, *scene.spheres, *lights, *others]


def kind_of(shape: Shape) -> Kind:
    """Of its record."""
    return FLATS[type(shape)][0] if type(shape) in FLATS else Kind[type(shape).__name__.upper()]


def corners_of(shape: Flat) -> Floats:
    """The points with coordinates (0, 0), (1, 0) and (0, 1), (3, 3), as the records have them."""
    match shape:
        case Rectangle():
            return np.add(shape.corner, [np.zeros(3), shape.edge_u, shape.edge_v])
        case Disk():
            u, v = (axes[0] for axes in disk_axes([shape.normal]))
            return np.add(shape.center, shape.radius * np.stack([np.zeros(3), u, v]))
        case Triangle():
            return np.array(shape.vertices)


def is_culled(scene: Scene, shape: Shape) -> bool:
    """Whether it is not there from behind."""
    return shape.material in scene.materials and not scene.materials[shape.material].double_sided


def plane_of(shape: Plane | Flat) -> tuple[Floats, Floats]:
    """A point and the unit normal on the front."""
    if isinstance(shape, Plane):
        point, normal = np.array(shape.point), np.array(shape.normal)
    elif isinstance(shape, Disk):
        point, normal = np.array(shape.center), np.array(shape.normal)
    else:
        point, b, c = corners_of(shape)
        normal = np.cross(b - point, c - point)
    return point, normal / np.linalg.norm(normal)


def bounds(
    shape: Shape, origin: Floats, direction: Floats, doubt: float, culled: bool = False
) -> tuple[Floats, Floats]:
    """The least and largest distance at which rays may meet a shape known to ``doubt`` metres, if near; one that is
    ``culled`` only from its front."""
    if isinstance(shape, Sphere):
        sizes = [max(0.0, shape.radius + e) for e in (doubt, -doubt)]
        larger, smaller = (shape_oracle.sphere(shape.center, r, origin, direction) for r in sizes)
        if culled:
            inside = np.linalg.norm(origin - shape.center, axis=1) < shape.radius
            larger, smaller = (np.where(inside, np.inf, x) for x in (larger, smaller))
        height = np.linalg.norm(origin - shape.center, axis=1) - shape.radius
        low, high = np.minimum(larger, smaller), np.maximum(larger, smaller)
    else:
        point, normal = plane_of(shape)
        match shape:
            case Plane():
                larger = smaller = shape_oracle.plane(point, normal, origin, direction)
            case Rectangle():
                sides = (shape.corner, shape.edge_u, shape.edge_v, origin, direction)
                larger, smaller = (shape_oracle.rectangle(*sides, e) for e in (doubt, -doubt))
            case Disk():
                round_one = (shape.center, normal, shape.radius, origin, direction)
                larger, smaller = (shape_oracle.disk(*round_one, e) for e in (doubt, -doubt))
            case Triangle():
                distance, margin = shape_oracle.triangle_margin(shape.vertices, origin, direction)
                larger, smaller = (np.where(margin >= -e, distance, np.inf) for e in (doubt, -doubt))
        height = (origin - point) @ normal
        far = np.where(np.isfinite(larger), larger, 0)
        slack = (doubt + 1e-6 * far) / np.maximum(np.abs(direction @ normal), 1e-12)
        low, high = larger - slack, smaller + slack
        if culled:
            behind = direction @ normal >= 0
            low, high = np.where(behind, np.inf, low), np.where(behind, np.inf, high)
    there = np.abs(height) < doubt  # the ray starts on it, and may meet it at once or never
    return np.where(there, 0, low), np.where(there, np.inf, high)


def _rectangle(rng: np.random.Generator, place: Floats, scale: float, material: str) -> Rectangle:
    u, v, _ = np.linalg.qr(rng.normal(size=(3, 3)))[0] * scale * rng.uniform(0.3, 2, (3, 1))
    return Rectangle(place, u, v, material)


# From random numbers, a place (3,), a scale in metres and a material: a shape that lies there.
SHAPES: dict[str, Callable[[np.random.Generator, Floats, float, str], Any]] = {
    "spheres": lambda rng, place, scale, material: Sphere(place, float(scale * rng.uniform(0.1, 0.7)), material),
    "planes": lambda rng, place, scale, material: Plane(place, rng.normal(size=3), material),
    "rectangles": _rectangle,
    "disks": lambda rng, place, scale, material: Disk(
        place, rng.normal(size=3), float(scale * rng.uniform(0.2, 1)), material
    ),
    "triangles": lambda rng, place, scale, material: Triangle(
        (place, *(place + scale * rng.normal(size=(2, 3)))), material
    ),
}
