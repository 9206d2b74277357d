# SPDX-License-Identifier: MIT
"""What lies under the mouse: one ray through the scene model, on the CPU, and marks of lights."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer.document import KINDS, Document, Part
from fragtracer.scene import (
    Camera,
    Disk,
    Geometry,
    Light,
    Mesh,
    Plane,
    Rectangle,
    Scene,
    Sphere,
    SpotLight,
    Triangle,
)

Vector = NDArray[np.float64]
_NEAR = 1e-9
_MARKED = 0.1  # metres around a light without a surface
MARK = 0.014  # radius of the mark of such a light, of the picture's height


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


def marked(document: Document) -> Iterator[tuple[Part, Light | SpotLight]]:
    """The visible lights that have a place, but no surface: point lights and spot lights."""
    for index, light in enumerate(document.scene.lights):
        if light.radius == 0 and ("lights", index) not in document.hidden:
            yield ("lights", index), light
    for index, spot in enumerate(document.scene.spot_lights):
        if ("spot_lights", index) not in document.hidden:
            yield ("spot_lights", index), spot


def pick_mark(document: Document, camera: Camera, x: float, y: float, aspect: float) -> Part | None:
    """The light whose mark is drawn over a place of the picture, as for :func:`fragtracer.apps.viewer.camera.ray`."""
    for part, light in marked(document):
        place = cameras.project(camera, light.position, aspect)
        if place is not None and math.hypot((place[0] - x) * aspect, place[1] - y) <= MARK:
            return part
    return None


def bounds(part: object) -> tuple[tuple[float, float, float], float] | None:
    """Centre and radius of a bounding sphere; None for what is infinite or has no place, and for a mesh
    without triangles."""
    match part:
        case Sphere() | Disk():
            return part.center, part.radius
        case Light():
            return part.position, max(part.radius, _MARKED)
        case SpotLight():
            return part.position, _MARKED
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
            case Disk():
                yield _disk(part, origin, direction)
            case Mesh():
                yield _mesh(part, origin, direction)
            case Sphere():
                yield _sphere(np.asarray(part.center), part.radius, origin, direction)
            case Light() if part.radius > 0:
                yield _sphere(np.asarray(part.position), part.radius, origin, direction)
            case _:
                yield None


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


def _disk(disk: Disk, origin: Vector, direction: Vector) -> float | None:
    center = np.asarray(disk.center)
    distance = _plane(center, np.asarray(disk.normal), origin, direction)
    if distance is None or np.linalg.norm(origin + distance * direction - center) > disk.radius:
        return None
    return distance


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
    found = [_instance(part.geometry, matrix, origin, direction) for matrix, part in mesh.placed()]
    return min((distance for distance in found if distance is not None), default=None)


def _instance(geometry: Geometry, matrix: Vector, origin: Vector, direction: Vector) -> float | None:
    """The distance to the nearest triangle of an instance: the same along the ray in its object space."""
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
