# SPDX-License-Identifier: MIT
"""What lies under the mouse: one ray through the scene model, on the CPU, and marks of lights."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer.document import KINDS, Document, Part, is_light
from fragtracer.scene import Camera, Disk, Geometry, Light, Mesh, Sphere, SpotLight
from fragtracer.scene.shapes import NEAREST

Vector = NDArray[np.float64]
_SLACK = 1e-9  # of their distance, by which spheres are taken to be larger as they are sought
MARK = 0.014  # radius of the mark of such a light, of the picture's height


def pick(document: Document, origin: Vector, direction: Vector) -> tuple[Part, float] | None:
    """The nearest visible object or light on a ray, and its distance; ``direction`` has length 1."""
    spheres = _near(document.scene.spheres, origin, direction)
    hits = [
        (distance, (kind, index))
        for kind in KINDS
        for index, part in (spheres if kind == "spheres" else enumerate(getattr(document.scene, kind)))
        if (kind, index) not in document.hidden and (distance := _distance(part, origin, direction)) < math.inf
    ]
    if not hits:
        return None
    distance, part = min(hits)
    return part, distance


def _near(spheres: Sequence[Sphere], origin: Vector, direction: Vector) -> list[tuple[int, Sphere]]:
    """Those that the line through ``origin`` meets or nearly meets, with their indices."""
    if not spheres:
        return []
    to_center = np.array([sphere.center for sphere in spheres]) - origin
    radius = np.array([sphere.radius for sphere in spheres])
    aside = np.linalg.norm(to_center - np.outer(to_center @ direction, direction), axis=1)
    slack = _SLACK * np.linalg.norm(to_center, axis=1)
    return [(index, spheres[index]) for index in np.flatnonzero(aside <= radius + slack).tolist()]


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


def bounds(part: Any) -> tuple[tuple[float, float, float], float] | None:
    """Centre and radius of a bounding sphere; None for what is infinite or has no place, and for a mesh
    without triangles."""
    match part:
        case Light():
            return part.position, part.radius
        case SpotLight():
            return part.position, 0.0
        case Sphere() | Disk():
            return part.center, part.radius
        case Mesh():
            corners = part.box_corners()
            if not len(corners):
                return None
            low, high = corners.min(axis=0), corners.max(axis=0)
        case _ if hasattr(part, "bounds"):
            low, high = np.asarray(part.bounds)
        case _:
            return None
    center = (low + high) / 2
    return (float(center[0]), float(center[1]), float(center[2])), float(np.linalg.norm(high - center))


def _distance(part: Any, origin: Vector, direction: Vector) -> float:
    """To an object or a light with a surface, infinite where the ray misses it."""
    match part:
        case Mesh():
            return _mesh(part, origin, direction)
        case Light():
            return Sphere(part.position, part.radius, "").intersect(origin, direction) if part.radius > 0 else math.inf
        case _ if is_light(part):
            return math.inf
        case _:
            return float(part.intersect(origin, direction))


def _mesh(mesh: Mesh, origin: Vector, direction: Vector) -> float:
    found = (_instance(part.geometry, matrix, origin, direction) for matrix, part in mesh.placed())
    return min(found, default=math.inf)


def _instance(geometry: Geometry, matrix: Vector, origin: Vector, direction: Vector) -> float:
    """The distance to the nearest triangle of an instance: the same along the ray in its object space."""
    if not np.linalg.det(matrix):  # a node of a model may be flat
        return math.inf
    inverse = np.linalg.inv(matrix)
    local, along = inverse[:3, :3] @ origin + inverse[:3, 3], inverse[:3, :3] @ direction
    low, high = geometry.bounds
    if not _meets_box(low, high, local, along):
        return math.inf
    a, b, c = (geometry.positions[geometry.triangles[:, k]] for k in range(3))
    u, v, to_a = b - a, c - a, local - a
    normal = np.cross(u, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = -1 / (normal @ along)
        distance = (normal * to_a).sum(axis=1) * scale
        turned = np.cross(to_a, along)
        s, t = (v * turned).sum(axis=1) * scale, -(u * turned).sum(axis=1) * scale
        inside = (s >= 0) & (t >= 0) & (s + t <= 1) & (distance > NEAREST)
    return float(distance[inside].min()) if inside.any() else math.inf


def _meets_box(low: Vector, high: Vector, origin: Vector, direction: Vector) -> bool:
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - origin) / direction, (high - origin) / direction
    near, far = np.fmax.reduce(np.fmin(a, b)), np.fmin.reduce(np.fmax(a, b))
    return bool(far >= max(near, 0.0))
