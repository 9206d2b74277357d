# SPDX-License-Identifier: MIT
"""Spheres, planes, rectangles and triangles as records."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene import Plane, Rectangle, Scene, Sphere, Triangle

Floats = NDArray[np.float64]

# Shapes reach this much beyond their edges, relative to the scene, so that neighbours leave no crack.
_EDGE_GROWTH = 1e-6


def shape_records(
    scene: Scene,
    spheres: Sequence[Sphere],
    materials: Mapping[str, int],
    lights: Mapping[int, int],
    origin: Floats,
    extent: float,
) -> dict[str, list[dict[str, Any]]]:
    """The records of each kind, about ``origin``, in a scene that reaches ``extent`` metres from there.

    ``spheres`` are those of ``scene`` and of its lights; ``materials`` are numbers by name, ``lights`` by the number
    of their primitive: spheres, planes, rectangles and triangles are counted on in this order (shape/intersect.glsl).
    """
    shapes: dict[str, list[Any]] = {
        "Sphere": [(s, _sphere(s, origin)) for s in spheres],
        "Plane": [(p, _plane(p, origin)) for p in scene.planes],
        "Rectangle": [(r, _rectangle(r, origin, extent)) for r in scene.rectangles],
        "Triangle": [(t, _triangle(t, origin, extent)) for t in scene.triangles],
    }
    records: dict[str, list[dict[str, Any]]] = {}
    primitive = 0
    for kind, found in shapes.items():
        records[kind] = [
            record | {"material": materials[shape.material], "light": lights.get(number, -1)}
            for number, (shape, record) in enumerate(found, primitive)
        ]
        primitive += len(found)
    return records


def _sphere(s: Sphere, origin: Floats) -> dict[str, Any]:
    return {"center": np.subtract(s.center, origin), "radius": s.radius}


def _plane(p: Plane, origin: Floats) -> dict[str, Any]:
    normal = np.asarray(p.normal) / np.linalg.norm(p.normal)
    return {"normal": normal, "offset": normal @ np.subtract(p.point, origin)}


def _rectangle(r: Rectangle, origin: Floats, extent: float) -> dict[str, Any]:
    u, v = np.asarray(r.edge_u), np.asarray(r.edge_v)
    growth = _EDGE_GROWTH * extent
    step_u, step_v = growth * u / np.linalg.norm(u), growth * v / np.linalg.norm(v)
    return _flat(np.subtract(r.corner, origin) - step_u - step_v, u + 2 * step_u, v + 2 * step_v)


def _triangle(t: Triangle, origin: Floats, extent: float) -> dict[str, Any]:
    vertices = np.asarray(t.vertices) - origin
    sides = np.linalg.norm(np.roll(vertices, -1, 0) - np.roll(vertices, -2, 0), axis=1)
    incenter = sides @ vertices / sides.sum()
    inradius = 2 * t.area / sides.sum()
    a, b, c = incenter + (vertices - incenter) * (1 + _EDGE_GROWTH * extent / inradius)
    return _flat(a, b - a, c - a)


def _flat(corner: Floats, edge_u: Floats, edge_v: Floats) -> dict[str, Any]:
    """Plane and rows so that p = corner + u edge_u + v edge_v has u = u_row . (p, 1), likewise v."""
    normal = np.cross(edge_u, edge_v)
    rows = np.linalg.inv(np.column_stack([edge_u, edge_v, normal]))
    unit = normal / np.linalg.norm(normal)
    return {
        "plane": np.append(unit, unit @ corner),
        "u_row": np.append(rows[0], -rows[0] @ corner),
        "v_row": np.append(rows[1], -rows[1] @ corner),
    }
