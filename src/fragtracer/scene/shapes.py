# SPDX-License-Identifier: MIT
"""Analytic shapes: spheres, planes, rectangles, disks and single triangles.

Each has ``bounds``, the lower and the upper corner of its bounding box if it is finite, and ``intersect(origin,
direction)``, the distance along a ray with unit ``direction`` (both (3,)) to where it is met first, from either side,
infinite if it is missed.
"""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from fragtracer.scene.fields import (
    CONFIG,
    Many,
    Point,
    Points,
    Positive,
    Triple,
    Vector,
    cross,
    difference,
    dot,
    kinds_of,
    length,
)

__all__ = ["Disk", "Plane", "Rectangle", "Sphere", "Triangle"]

Floats = NDArray[np.float64]
Bounds = tuple[Triple, Triple]
NEAREST = 1e-9  # metres from the origin of a ray; what lies nearer is what it starts on


def _between(points: Floats) -> Bounds:
    """The bounds of points (n, 3)."""
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def _plane_distance(point: Floats, normal: Floats, origin: Floats, direction: Floats) -> float:
    cosine = float(normal @ direction)
    distance = float(normal @ (point - origin)) / cosine if cosine else math.inf
    return distance if distance > NEAREST else math.inf


def _flat_coordinates(
    corner: Vector, edge_u: Floats, edge_v: Floats, origin: Floats, direction: Floats
) -> tuple[float, float, float]:
    """The distance to the plane of two edges, and the coordinates along these where it is met."""
    normal, a = np.cross(edge_u, edge_v), np.asarray(corner)
    distance = _plane_distance(a, normal, origin, direction)
    if distance == math.inf:
        return distance, math.nan, math.nan
    place, area = origin + distance * direction - a, float(normal @ normal)
    return distance, float(np.cross(place, edge_v) @ normal) / area, float(np.cross(edge_u, place) @ normal) / area


@dataclass(frozen=True, config=CONFIG)
class Sphere:
    """A sphere; its front is outside."""

    center: Point
    radius: Positive
    material: str

    @property
    def bounds(self) -> Bounds:
        (x, y, z), r = self.center, self.radius
        return (x - r, y - r, z - r), (x + r, y + r, z + r)

    def intersect(self, origin: Floats, direction: Floats) -> float:
        to_center = np.asarray(self.center) - origin
        middle = float(to_center @ direction)
        rest = self.radius**2 - float(np.sum((to_center - middle * direction) ** 2))
        if rest < 0:
            return math.inf
        near, far = middle - math.sqrt(rest), middle + math.sqrt(rest)
        return near if near > NEAREST else far if far > NEAREST else math.inf


@dataclass(frozen=True, config=CONFIG)
class Plane:
    """An infinite plane through ``point``, its front on the side of ``normal`` (of any length)."""

    point: Point
    normal: Vector
    material: str

    def __post_init__(self) -> None:
        if not length(self.normal) > 0:
            raise ValueError("normal must not have length zero; [0, 1, 0] is a floor")

    def intersect(self, origin: Floats, direction: Floats) -> float:
        return _plane_distance(np.asarray(self.point), np.asarray(self.normal), origin, direction)


@dataclass(frozen=True, config=CONFIG)
class Rectangle:
    """A rectangle ``corner + s edge_u + t edge_v``, 0 ≤ s, t ≤ 1; its front is along edge_u × edge_v."""

    corner: Point
    edge_u: Vector
    edge_v: Vector
    material: str

    def __post_init__(self) -> None:
        lengths = length(self.edge_u) * length(self.edge_v)
        if not lengths > 0:
            raise ValueError("edge_u and edge_v must not have length zero")
        if abs(dot(self.edge_u, self.edge_v)) > 1e-4 * lengths:
            raise ValueError("edge_u and edge_v must be perpendicular; use two triangles for another shape")

    @property
    def area(self) -> float:
        return length(cross(self.edge_u, self.edge_v))

    @property
    def bounds(self) -> Bounds:
        a, u, v = (np.asarray(x) for x in (self.corner, self.edge_u, self.edge_v))
        return _between(np.stack([a, a + u, a + v, a + u + v]))

    def intersect(self, origin: Floats, direction: Floats) -> float:
        u, v = np.asarray(self.edge_u), np.asarray(self.edge_v)
        distance, s, t = _flat_coordinates(self.corner, u, v, origin, direction)
        return distance if 0 <= s <= 1 and 0 <= t <= 1 else math.inf


@dataclass(frozen=True, config=CONFIG)
class Disk:
    """A flat disk around ``center``, its front on the side of ``normal`` (of any length)."""

    center: Point
    normal: Vector
    radius: Positive
    material: str

    def __post_init__(self) -> None:
        if not length(self.normal) > 0:
            raise ValueError("normal must not have length zero; [0, 1, 0] faces up")

    @property
    def area(self) -> float:
        return float(np.pi * self.radius**2)

    @property
    def bounds(self) -> Bounds:
        center, normal = np.asarray(self.center), np.asarray(self.normal) / length(self.normal)
        half = self.radius * np.sqrt(np.maximum(0.0, 1 - normal**2))
        return _between(np.stack([center - half, center + half]))

    def intersect(self, origin: Floats, direction: Floats) -> float:
        center = np.asarray(self.center)
        distance = _plane_distance(center, np.asarray(self.normal), origin, direction)
        is_met = distance < math.inf and length(origin + distance * direction - center) <= self.radius
        return distance if is_met else math.inf


@dataclass(frozen=True, config=CONFIG)
class Triangle:
    """A triangle; seen from its front the ``vertices`` run counter-clockwise."""

    vertices: Points
    material: str

    def __post_init__(self) -> None:
        a, b, c = self.vertices
        u, v = difference(b, a), difference(c, a)
        longest = max(length(u), length(v), length(difference(c, b)))
        if not length(cross(u, v)) > 1e-12 * longest**2:
            raise ValueError("the three vertices lie on a line or in a point; a triangle needs an area")

    @property
    def area(self) -> float:
        a, b, c = self.vertices
        return length(cross(difference(b, a), difference(c, a))) / 2

    @property
    def bounds(self) -> Bounds:
        return _between(np.asarray(self.vertices))

    def intersect(self, origin: Floats, direction: Floats) -> float:
        a, b, c = self.vertices
        distance, s, t = _flat_coordinates(a, np.subtract(b, a), np.subtract(c, a), origin, direction)
        return distance if s >= 0 and t >= 0 and s + t <= 1 else math.inf


@dataclass(frozen=True, config=CONFIG, kw_only=True)
class ShapeLists:
    """The analytic shapes of a scene. The tables of a scene file have the names of the fields without their s."""

    spheres: Many[Sphere] = ()
    planes: Many[Plane] = ()
    rectangles: Many[Rectangle] = ()
    disks: Many[Disk] = ()
    triangles: Many[Triangle] = ()


SHAPES = kinds_of(ShapeLists)
