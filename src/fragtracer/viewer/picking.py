# SPDX-License-Identifier: MIT
"""What lies under the mouse: one ray through the scene model, on the CPU."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene import Plane, Rectangle, Scene, Sphere, Triangle
from fragtracer.viewer.document import KINDS, Document, Part

Vector = NDArray[np.float64]
_NEAR = 1e-9


def pick(document: Document, origin: Vector, direction: Vector) -> tuple[Part, float] | None:
    """The nearest visible object or light on a ray, and its distance; ``direction`` has length 1."""
    hits = [
        (distance, (kind, index))
        for kind in KINDS
        for index, distance in enumerate(_distances(document.scene, kind, origin, direction))
        if distance is not None and distance > _NEAR and (kind, index) not in document.hidden
    ]
    if not hits:
        return None
    distance, part = min(hits)
    return part, distance


def bounds(part: object) -> tuple[tuple[float, float, float], float] | None:
    """Centre and radius of a ball around an object or light; None for what is infinite."""
    match part:
        case Plane():
            return None
        case Rectangle():
            corners = np.asarray([part.corner, np.add(np.add(part.corner, part.edge_u), part.edge_v)])
            center = corners.mean(axis=0)
            radius = float(np.linalg.norm(corners[0] - center))
        case Triangle():
            vertices = np.asarray(part.vertices)
            center = vertices.mean(axis=0)
            radius = float(np.linalg.norm(vertices - center, axis=1).max())
        case Sphere():
            return part.center, part.radius
        case _:
            return getattr(part, "position"), max(getattr(part, "radius"), 0.1)  # noqa: B009
    return (float(center[0]), float(center[1]), float(center[2])), radius


def _distances(scene: Scene, kind: str, origin: Vector, direction: Vector) -> Iterator[float | None]:
    for part in getattr(scene, kind):
        match part:
            case Plane():
                yield _plane(np.asarray(part.point), np.asarray(part.normal), origin, direction)
            case Rectangle():
                yield _parallelogram(part.corner, part.edge_u, part.edge_v, origin, direction, 2.0)
            case Triangle():
                a, b, c = part.vertices
                yield _parallelogram(a, np.subtract(b, a), np.subtract(c, a), origin, direction, 1.0)
            case Sphere():
                yield _sphere(np.asarray(part.center), part.radius, origin, direction)
            case _:
                yield _sphere(np.asarray(part.position), part.radius, origin, direction) if part.radius else None


def _sphere(center: Vector, radius: float, origin: Vector, direction: Vector) -> float | None:
    to_center = center - origin
    middle = float(to_center @ direction)
    rest = radius**2 - float(np.sum((to_center - middle * direction) ** 2))
    if rest < 0:
        return None
    half = math.sqrt(rest)
    near, far = middle - half, middle + half
    return near if near > _NEAR else far


def _plane(point: Vector, normal: Vector, origin: Vector, direction: Vector) -> float | None:
    cosine = float(normal @ direction)
    return float(normal @ (point - origin)) / cosine if cosine else None


def _parallelogram(
    corner: object, edge_u: object, edge_v: object, origin: Vector, direction: Vector, most: float
) -> float | None:
    """``most`` is the largest sum of the two coordinates: 1 cuts a triangle, 2 leaves the whole."""
    u, v = np.asarray(edge_u, np.float64), np.asarray(edge_v, np.float64)
    normal = np.cross(u, v)
    base = np.asarray(corner, np.float64)
    distance = _plane(base, normal, origin, direction)
    if distance is None:
        return None
    place = origin + distance * direction - base
    area = float(normal @ normal)
    s, t = float(np.cross(place, v) @ normal / area), float(np.cross(u, place) @ normal / area)
    inside = bool(s >= 0 and t >= 0 and s <= 1 and t <= 1 and s + t <= most)
    return distance if inside else None
