# SPDX-License-Identifier: MIT
"""Analytic shapes: spheres, planes, rectangles, disks and single triangles."""

from typing import Annotated

import numpy as np
from pydantic import BeforeValidator
from pydantic.dataclasses import dataclass

from fragtracer.scene.fields import CONFIG, Positive, Vector, as_tuple, length


@dataclass(frozen=True, config=CONFIG)
class Sphere:
    """A sphere; its front is outside."""

    center: Vector
    radius: Positive
    material: str


@dataclass(frozen=True, config=CONFIG)
class Plane:
    """An infinite plane through ``point``, its front on the side of ``normal`` (of any length)."""

    point: Vector
    normal: Vector
    material: str

    def __post_init__(self) -> None:
        if not length(self.normal) > 0:
            raise ValueError("normal must not have length zero; [0, 1, 0] is a floor")


@dataclass(frozen=True, config=CONFIG)
class Rectangle:
    """A rectangle ``corner + s edge_u + t edge_v``, 0 ≤ s, t ≤ 1; its front is along edge_u × edge_v."""

    corner: Vector
    edge_u: Vector
    edge_v: Vector
    material: str

    def __post_init__(self) -> None:
        lengths = length(self.edge_u) * length(self.edge_v)
        if not lengths > 0:
            raise ValueError("edge_u and edge_v must not have length zero")
        if abs(float(np.dot(self.edge_u, self.edge_v))) > 1e-4 * lengths:
            raise ValueError("edge_u and edge_v must be perpendicular; use two triangles for another shape")

    @property
    def area(self) -> float:
        return float(np.linalg.norm(np.cross(self.edge_u, self.edge_v)))


@dataclass(frozen=True, config=CONFIG)
class Disk:
    """A flat disk around ``center``, its front on the side of ``normal`` (of any length)."""

    center: Vector
    normal: Vector
    radius: Positive
    material: str

    def __post_init__(self) -> None:
        if not length(self.normal) > 0:
            raise ValueError("normal must not have length zero; [0, 1, 0] faces up")

    @property
    def area(self) -> float:
        return float(np.pi * self.radius**2)


@dataclass(frozen=True, config=CONFIG)
class Triangle:
    """A triangle; seen from its front the ``vertices`` run counter-clockwise."""

    vertices: Annotated[tuple[Vector, Vector, Vector], BeforeValidator(as_tuple)]
    material: str

    def __post_init__(self) -> None:
        a, b, c = (np.asarray(v) for v in self.vertices)
        longest = max(np.linalg.norm(b - a), np.linalg.norm(c - a), np.linalg.norm(c - b))
        if not np.linalg.norm(np.cross(b - a, c - a)) > 1e-12 * longest**2:
            raise ValueError("the three vertices lie on a line or in a point; a triangle needs an area")

    @property
    def area(self) -> float:
        a, b, c = (np.asarray(v) for v in self.vertices)
        return float(np.linalg.norm(np.cross(b - a, c - a))) / 2
