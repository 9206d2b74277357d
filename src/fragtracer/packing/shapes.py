# SPDX-License-Identifier: MIT
"""Shapes with a formula of their own as records of shaders/scene/shape.glsl."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.records import SHAPE_RECORDS, SHAPE_TEXELS, Kind, Words, words_of
from fragtracer.scene import Disk, Light, Material, Plane, Rectangle, Scene, Sphere, Triangle
from fragtracer.scene.content import content_digest

Floats = NDArray[np.float64]
Shape = Sphere | Rectangle | Disk | Triangle
CULLED = 1  # SHAPE_CULLED of scene/shape.glsl

# Flat shapes grow by this beyond their edges, relative to the scene, so that neighbours leave no crack; and bounds,
# since where a ray passes an edge is known no better.
GROWTH = 1e-6


@dataclass(frozen=True, eq=False)
class Shapes:
    """Records (n, 4, 4) of shapes and their bounds (6, n), as :mod:`fragtracer.bvh` wants them: equal to others where
    their content is. ``spheres`` come first."""

    words: Words
    bounds: NDArray[np.float32]
    spheres: int

    def __len__(self) -> int:
        return len(self.words)

    @cached_property
    def _digest(self) -> str:
        return content_digest(self.words)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shapes) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)


def finite_shapes(scene: Scene) -> tuple[list[Shape], dict[str, Material]]:
    """The shapes of ``scene`` that are finite, those of its lights with a radius among them, in the order of their
    records: spheres, then flat shapes. And all materials, those of such lights included."""
    spheres, materials = list(scene.spheres), dict(scene.materials)
    for i, light in enumerate(scene.lights):
        if light.radius > 0:
            name = f"light[{i}]"
            materials[name] = light_material(light)
            spheres.append(Sphere(light.position, light.radius, name))
    return [*spheres, *scene.rectangles, *scene.disks, *scene.triangles], materials


def light_material(light: Light) -> Material:
    """What the sphere of a light with a radius is made of."""
    return Material(albedo=(0.0, 0.0, 0.0), specular=0.0, emission=light.surface_radiance)


def plane_records(
    planes: Sequence[Plane], materials: Mapping[str, Material], index: Mapping[str, int], origin: Floats
) -> Words:
    """Records (n, 4, 4) of planes about ``origin``; ``index`` has the numbers of materials."""
    normals = _unit(_vectors([p.normal for p in planes]))
    points = _vectors([p.point for p in planes]) - origin
    columns = {
        "normal": normals,
        "kind": Kind.PLANE << 24 | _flags(planes, materials),
        "offset": (normals * points).sum(axis=1),
        "material": np.array([index[p.material] for p in planes], np.int64),
    }
    return words_of(SHAPE_RECORDS["Plane"], columns, len(planes), SHAPE_TEXELS)


def shape_records(
    shapes: Sequence[Shape],
    materials: Mapping[str, Material],
    index: Mapping[str, int],
    lights: NDArray[np.int64],
    origin: Floats,
    extent: float,
) -> Shapes:
    """The records of ``shapes`` about ``origin``, in a scene that extends ``extent`` metres from there.

    ``shapes`` are in the order of :func:`finite_shapes`, ``index`` has the numbers of materials, ``lights`` (n,) the
    number of the light that each shape is, or -1.
    """
    spheres = [shape for shape in shapes if isinstance(shape, Sphere)]
    flats = shapes[len(spheres) :]
    material = np.array([index[shape.material] for shape in shapes], np.int64)
    flags = _flags(shapes, materials)
    centers = _vectors([s.center for s in spheres]) - origin
    radii = np.array([s.radius for s in spheres], np.float64)
    count = len(spheres)
    columns = {
        "center": centers,
        "kind": Kind.SPHERE << 24 | flags[:count],
        "radius": radii,
        "material": material[:count],
        "light": lights[:count] + 1,
    }
    records = words_of(SHAPE_RECORDS["Sphere"], columns, count, SHAPE_TEXELS)
    kinds, corners = _corners(flats, origin, GROWTH * extent)
    columns = dict(zip("abc", corners.transpose(1, 0, 2), strict=True))
    columns["normal"] = _normals(corners)
    columns |= {"kind": kinds << 24 | flags[count:], "material": material[count:], "light": lights[count:] + 1}
    flat_records = words_of(SHAPE_RECORDS["Flat"], columns, len(flats), SHAPE_TEXELS)

    low, high = _flat_bounds(kinds, corners)
    low = np.concatenate([centers - radii[:, None], low])
    high = np.concatenate([centers + radii[:, None], high])
    growth = GROWTH * np.maximum(extent, np.maximum(np.abs(low), np.abs(high)).max(axis=1, initial=0.0))[:, None]
    bounds = np.concatenate([(low - growth).T, -(high + growth).T]).astype(np.float32)
    return Shapes(np.concatenate([records, flat_records]), bounds, count)


def _flags(shapes: Sequence[Shape | Plane], materials: Mapping[str, Material]) -> NDArray[np.int64]:
    return np.array([0 if materials[shape.material].double_sided else CULLED for shape in shapes], np.int64)


def _corners(flats: Sequence[Shape], origin: Floats, growth: float) -> tuple[NDArray[np.int64], Floats]:
    """The kinds (n,) of flat shapes and their points a, b and c (n, 3, 3), grown by so many metres."""
    rectangles = [shape for shape in flats if isinstance(shape, Rectangle)]
    disks = [shape for shape in flats if isinstance(shape, Disk)]
    triangles = [shape for shape in flats if isinstance(shape, Triangle)]
    counts = [len(rectangles), len(disks), len(triangles)]
    kinds = np.repeat([Kind.RECTANGLE, Kind.DISK, Kind.SINGLE_TRIANGLE], counts).astype(np.int64)
    corners = [_rectangles(rectangles, growth), _disks(disks, growth), _triangles(triangles, growth)]
    return kinds, np.concatenate(corners) - origin


def _rectangles(rectangles: Sequence[Rectangle], growth: float) -> Floats:
    corner = _vectors([r.corner for r in rectangles])
    u, v = _vectors([r.edge_u for r in rectangles]), _vectors([r.edge_v for r in rectangles])
    step_u, step_v = growth * _unit(u), growth * _unit(v)
    a = corner - step_u - step_v
    return np.stack([a, a + u + 2 * step_u, a + v + 2 * step_v], axis=1)


def _disks(disks: Sequence[Disk], growth: float) -> Floats:
    center = _vectors([d.center for d in disks])
    radius = np.array([d.radius + growth for d in disks], np.float64)[:, None]
    u, v = disk_axes([d.normal for d in disks])
    return np.stack([center, center + radius * u, center + radius * v], axis=1)


def disk_axes(normals: Sequence[Sequence[float]]) -> tuple[Floats, Floats]:
    """Unit vectors u and v (n, 3) in the planes of ``normals`` of any length, with u × v along them."""
    normal = _unit(_vectors(normals))
    u = _unit(np.cross(np.eye(3)[np.abs(normal).argmin(axis=1)], normal))
    return u, np.cross(normal, u)


def _triangles(triangles: Sequence[Triangle], growth: float) -> Floats:
    vertices = np.array([t.vertices for t in triangles], np.float64).reshape(-1, 3, 3)
    opposite = np.roll(vertices, -1, 1) - np.roll(vertices, -2, 1)
    sides = np.linalg.norm(opposite, axis=2)[..., None]
    perimeter = sides.sum(axis=1, keepdims=True)
    incenter = (sides * vertices).sum(axis=1, keepdims=True) / perimeter
    doubled_area = np.linalg.norm(np.cross(opposite[:, 0], opposite[:, 1]), axis=1)[:, None, None]
    grown: Floats = incenter + (vertices - incenter) * (1 + growth * perimeter / doubled_area)
    return grown


def _vectors(vectors: Sequence[Sequence[float]]) -> Floats:
    return np.array(vectors, np.float64).reshape(-1, 3)


def _flat_bounds(kinds: NDArray[np.int64], corners: Floats) -> tuple[Floats, Floats]:
    """Lower and upper corners (n, 3) of the bounds of flat shapes."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    points = np.concatenate([corners, (a + u + v)[:, None]], axis=1)
    points[kinds == Kind.SINGLE_TRIANGLE, 3] = a[kinds == Kind.SINGLE_TRIANGLE]
    low, high = points.min(axis=1), points.max(axis=1)
    half = np.sqrt(u**2 + v**2)
    is_disk = (kinds == Kind.DISK)[:, None]
    return np.where(is_disk, a - half, low), np.where(is_disk, a + half, high)


def _normals(corners: Floats) -> Floats:
    """Unit normals (n, 3) on the front of flat shapes. Edges are scaled first: the area of a tiny one is no float64."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return _unit(np.cross(_unit(u), _unit(v)))


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit
