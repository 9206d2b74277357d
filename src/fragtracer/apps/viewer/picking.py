# SPDX-License-Identifier: MIT
"""What lies under the mouse: one ray through the scene model, on the CPU."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.viewer.document import KINDS, Document, Part
from fragtracer.scene import Geometry, Light, Mesh, Plane, Rectangle, Scene, Sphere, Triangle

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
    """Centre and radius of a ball around an object or light; None for what is infinite, and for a mesh
    without triangles."""
    match part:
        case Sphere():
            return part.center, part.radius
        case Light():
            return part.position, max(part.radius, 0.1)
        case Rectangle():
            corners = np.asarray([part.corner, np.add(np.add(part.corner, part.edge_u), part.edge_v)])
            center = corners.mean(axis=0)
            radius = float(np.linalg.norm(corners[0] - center))
        case Triangle():
            vertices = np.asarray(part.vertices)
            center = vertices.mean(axis=0)
            radius = float(np.linalg.norm(vertices - center, axis=1).max())
        case Mesh():
            corners = part.box_corners()
            if not len(corners):
                return None
            center = (corners.min(axis=0) + corners.max(axis=0)) / 2
            radius = float(np.linalg.norm(corners - center, axis=1).max())
        case _:
            return None
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
            case Mesh():
                yield _mesh(part, origin, direction)
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


def _mesh(mesh: Mesh, origin: Vector, direction: Vector) -> float | None:
    found = [_copy(part.geometry, matrix, origin, direction) for matrix, part in mesh.placed()]
    return min((distance for distance in found if distance is not None), default=None)


def _copy(geometry: Geometry, matrix: Vector, origin: Vector, direction: Vector) -> float | None:
    """The nearest triangle of a copy; distances along a ray are the same in its own space."""
    if not np.linalg.det(matrix):  # a node of a model may be flat
        return None
    inverse = np.linalg.inv(matrix)
    local, along = inverse[:3, :3] @ origin + inverse[:3, 3], inverse[:3, :3] @ direction
    low, high = geometry.bounds
    if not _meets_box(low, high, local, along):
        return None
    a, b, c = (geometry.positions[geometry.triangles[:, k]] for k in range(3))
    u, v, to_a = b - a, c - a, local - a
    normal = np.cross(u, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = -1 / (normal @ along)
        distance = (normal * to_a).sum(axis=1) * scale
        turned = np.cross(to_a, along)
        s, t = (v * turned).sum(axis=1) * scale, -(u * turned).sum(axis=1) * scale
        inside = (s >= 0) & (t >= 0) & (s + t <= 1) & (distance > _NEAR)
    return float(distance[inside].min()) if inside.any() else None


def _meets_box(low: Vector, high: Vector, origin: Vector, direction: Vector) -> bool:
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - origin) / direction, (high - origin) / direction
    near, far = np.fmax.reduce(np.fmin(a, b)), np.fmin.reduce(np.fmax(a, b))
    return bool(far >= max(near, 0.0))
