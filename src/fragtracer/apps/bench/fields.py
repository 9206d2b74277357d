# SPDX-License-Identifier: MIT
"""Fields of any number of shapes that cover the same part of the picture: the shapes shrink as their number grows."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene import (
    Ambient,
    Camera,
    Geometry,
    Light,
    Material,
    Mesh,
    Part,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sphere,
)

Kind = Literal["spheres", "rectangles", "mesh triangles"]
KINDS: tuple[Kind, ...] = ("spheres", "rectangles", "mesh triangles")
LightKind = Literal["points", "spheres", "some of 10,000 spheres"]
LIGHT_KINDS: tuple[LightKind, ...] = ("points", "spheres", "some of 10,000 spheres")
MOST_LIGHTS = 10_000
SIDE = 3.0  # of the square that a field covers, metres
COVER = 0.4  # area of the shapes, seen by the camera, over that of the square
_GREY = {"grey": Material(albedo=(0.5,) * 3, specular=0.0)}
_FLOOR = (Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "grey"),)
_CAMERA = Camera((0.0, 3.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=40.0)
_UPWARDS = np.array([0.0, 1.0, -1.0]) / math.sqrt(2)  # in the plane of flat shapes, which face the camera


@dataclass(frozen=True)
class Field:
    """``scene`` and the bounds of its shapes (6, n), as :mod:`fragtracer.bvh` wants them."""

    scene: Scene
    bounds: NDArray[np.float32]


def shape_field(kind: Kind, count: int, render: RenderSettings) -> Field:
    """``count`` matte shapes of one kind on a plane, under a point light and an even sky.

    All face the camera with the same total area, whatever their kind and number.
    """
    size = SIDE * math.sqrt(COVER / count)  # of a square that has the area of one shape
    if kind == "spheres":
        radius = size / math.sqrt(math.pi)
        centers = _places(count, radius)
        spheres = tuple(Sphere(center, radius, "grey") for center in centers.tolist())
        return Field(_scene(render, spheres=spheres), _bounds(centers - radius, centers + radius))
    places = _places(count, 0.01 * size)  # clear of the plane
    if kind == "rectangles":
        u, v = np.array([size, 0.0, 0.0]), size * _UPWARDS
        corners = places - u / 2
        edges = tuple(u.tolist()), tuple(v.tolist())
        rectangles = tuple(Rectangle(corner, *edges, "grey") for corner in corners.tolist())
        return Field(_scene(render, rectangles=rectangles), _bounds(corners, corners + u, corners + v))
    edge = size * 2 / 3**0.25
    u, v = np.array([edge, 0.0, 0.0]), edge * math.sqrt(0.75) * _UPWARDS
    corners = np.stack([places - u / 2, places + u / 2, places + v], axis=1)
    geometry = Geometry(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    return Field(_scene(render, meshes=(Mesh((Part(geometry, "grey"),)),)), _bounds(*corners.transpose(1, 0, 2)))


def light_field(count: int, render: RenderSettings, kind: LightKind) -> Scene:
    """``count`` small lights over a plane with nine spheres, the same power together, whatever their number.

    Points; spheres with the same area together; or some of :data:`MOST_LIGHTS` spheres, of which the others are black.
    """
    spheres = [Sphere((x, 0.3, z), 0.3, "grey") for x, _, z in _places(9, 0.0).tolist()]
    shown = MOST_LIGHTS if kind == "some of 10,000 spheres" else count
    radius = 0.0 if kind == "points" else 0.1 / math.sqrt(shown)
    places, emitters = _places(shown, 2.5).tolist(), np.arange(count) * shown // count
    lights = tuple(Light(tuple(places[i]), radius, power=(300.0 / count,) * 3) for i in emitters)
    spheres += [Sphere(tuple(places[i]), radius, "black") for i in sorted({*range(shown)} - {*emitters.tolist()})]
    materials = _GREY | {"black": Material(albedo=(0.0,) * 3, specular=0.0)}
    return Scene(
        _CAMERA, materials, spheres=tuple(spheres), planes=_FLOOR, lights=lights, render=render, name=f"{count} lights"
    )


def _scene(render: RenderSettings, **shapes: object) -> Scene:
    light = Light((1.0, 4.0, 2.0), power=(300.0,) * 3)
    return Scene(_CAMERA, _GREY, planes=_FLOOR, lights=(light,), ambient=Ambient(0.2), render=render, **shapes)  # type: ignore[arg-type]


def _places(count: int, height: float) -> NDArray[np.float64]:
    """Points (n, 3) that cover the square evenly: a Fibonacci lattice."""
    i = np.arange(count)
    x, z = (i + 0.5) / count, (0.5 + i * (math.sqrt(5) - 1) / 2) % 1
    return np.stack([SIDE * (x - 0.5), np.full(count, height), SIDE * (z - 0.5)], axis=1)


def _bounds(*points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Bounds (6, n) of n shapes by some points of each, (n, 3)."""
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    return np.concatenate([low.T, -high.T]).astype(np.float32)
