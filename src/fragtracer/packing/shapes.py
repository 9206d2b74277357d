# SPDX-License-Identifier: MIT
"""Shapes with a formula of their own as records of shaders/shape/, and the kinds of all records of u_shapes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.records import Record, Words, texel_count, words_of
from fragtracer.scene import SHAPES, Disk, Light, Material, Plane, Rectangle, Scene, Sphere, Triangle
from fragtracer.scene.content import content_digest

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


class Kind(IntEnum):
    """Of a record of u_shapes, KIND_... of scene/shape.glsl and shape/."""

    NODE = 0
    TRIANGLE = 1
    INSTANCE = 2
    PLANE = 3
    SPHERE = 4
    RECTANGLE = 16
    DISK = 17
    SINGLE_TRIANGLE = 18


SHAPE_RECORDS: dict[str, Record] = {
    "Plane": (("normal", "vec3"), ("kind", "uint"), ("offset", "float"), ("material", "uint")),
    "Sphere": (
        *(("center", "vec3"), ("kind", "uint"), ("radius", "float"), ("material", "uint"), ("light", "uint")),
        *(("curvature", "float"), ("nearest", "vec3")),
    ),
    "Flat": (
        *(("a", "vec3"), ("kind", "uint"), ("b", "vec3"), ("material", "uint"), ("c", "vec3"), ("light", "uint")),
        ("normal", "vec3"),
    ),
    "Node": (
        *(("origin", "vec3"), ("kind", "uint"), ("x", "uvec2"), ("y", "uvec2"), ("z", "uvec2")),
        *(("first", "uint"), ("count", "uint")),
    ),
    "Triangle": (
        *(("a", "vec3"), ("kind", "uint"), ("b", "vec3"), ("material", "uint"), ("c", "vec3"), ("density", "float")),
        ("vertices", "uvec3"),
    ),
    "Instance": (
        *(("row_x", "vec3"), ("kind", "uint"), ("row_y", "vec3"), ("root", "uint")),
        *(("row_z", "vec3"), ("material", "uint"), ("translation", "vec3")),
    ),
}

# Numbers of materials and lights, where flat shapes have coordinates, are stored larger by SHAPE_STORED of
# scene/shape.glsl. Compiled in, records are choices between constants, and where one is 0 and the other has the bits of
# -1.0 Mesa 22.3 and 25.0 take both for numbers of floating point, and give -0.0 for 0, whose bits are not those.
STORED = 1
SHAPE_TEXELS = 4  # of each record of u_shapes

Shape = Sphere | Rectangle | Disk | Triangle
CULLED = 1  # SHAPE_CULLED of scene/shape.glsl
_MOST_OBJECTS = 2**23  # whose numbers differ
_FINITE = [kind for kind in SHAPES if kind != "planes"]

# Flat shapes grow by this beyond their edges, relative to their coordinates, so that neighbours leave no crack; lights
# do not, whose samples are of the area that they have. Bounds grow, relative to the scene, since where a ray passes an
# edge is known no better.
GROWTH = 1e-6
_MOST_OF_TIP = 16.0  # times that, by which the tip of a thin triangle may move
_GLOBE = 32.0  # a globe's radius over its distance from the origin, and over the scene's detail, at the least


@dataclass(frozen=True, eq=False)
class Shapes:
    """Records (n, 4, 4) of shapes and their bounds (6, n), as :mod:`fragtracer.bvh` wants them: equal to others where
    their content is. ``counts`` are those of each kind of record by its noun, in the order of the records."""

    words: Words
    bounds: NDArray[np.float32]
    counts: Mapping[str, int]

    @property
    def flags(self) -> int:
        """Which kinds there are, BVH_... of shaders/shape/."""
        return sum((count > 0) << i for i, count in enumerate(self.counts.values()))

    def __len__(self) -> int:
        return len(self.words)

    @property
    def is_globe(self) -> Bools:
        """(n,) which are spheres that shaders/shape/sphere.glsl takes for globes."""
        found = np.zeros(len(self), bool)
        spheres = slice(self.counts["sphere"])
        found[spheres] = self.words[spheres, 1, 3] != 0
        return found

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
    materials = dict(scene.materials)
    for i, light in enumerate(scene.lights):
        if light.radius > 0:
            materials[f"light[{i}]"] = light_material(light)
    return sorted(_as_in_file(scene), key=lambda shape: _ORDER[type(shape)]), materials


def _as_in_file(scene: Scene) -> list[Shape]:
    shapes = [shape for kind in _FINITE for shape in getattr(scene, kind)]
    lights = enumerate(scene.lights)
    return shapes + [Sphere(light.position, light.radius, f"light[{i}]") for i, light in lights if light.radius > 0]


def bounds_of(shapes: Sequence[Shape]) -> tuple[Floats, Floats]:
    """Lower and upper corners (n, 3) of the bounds of ``shapes``, those of one kind of record after the other."""
    boxes = []
    for classes, geometry in _GEOMETRY.values():
        some = [shape for shape in shapes if isinstance(shape, classes)]
        boxes.append(geometry(some, np.zeros(3), np.zeros(len(some), bool))[1:])
    low, high = zip(*boxes, strict=True)
    return np.concatenate(low), np.concatenate(high)


def light_material(light: Light) -> Material:
    """What the sphere of a light with a radius is made of."""
    return Material(albedo=(0.0, 0.0, 0.0), specular=0.0, emission=light.surface_radiance)


def kind_words(kind: Any, flags: Any, objects: Any) -> Any:
    """The word of a record that says its kind, its flags and the number of the object that it is of."""
    return kind << 24 | np.minimum(objects, _MOST_OBJECTS - 1) << 1 | flags


def object_names(scene: Scene) -> list[str]:
    """The objects of ``scene`` by their numbers: meshes by their names, all others by their kind and place in the scene
    file, as "sphere[0]": planes, then what :func:`finite_shapes` gives."""
    planes = [f"plane[{i}]" for i in range(len(scene.planes))]
    finite = [f"{kind.removesuffix('s')}[{i}]" for kind in _FINITE for i in range(len(getattr(scene, kind)))]
    finite += [f"light[{i}]" for i, light in enumerate(scene.lights) if light.radius > 0]
    in_order = sorted(zip(finite, _as_in_file(scene), strict=True), key=lambda named: _ORDER[type(named[1])])
    return [mesh.name for mesh in scene.meshes] + planes + [name for name, _ in in_order]


def plane_records(
    planes: Sequence[Plane],
    materials: Mapping[str, Material],
    index: Mapping[str, int],
    origin: Floats,
    first_object: int = 0,
) -> Words:
    """Records (n, 4, 4) of planes about ``origin``; ``index`` has the numbers of materials, their objects are numbered
    from ``first_object`` on."""
    normals = _unit(_vectors([p.normal for p in planes]))
    points = _vectors([p.point for p in planes]) - origin
    columns = {
        "normal": normals,
        "kind": kind_words(Kind.PLANE, _flags(planes, materials), first_object + np.arange(len(planes))),
        "offset": (normals * points).sum(axis=1),
        "material": np.array([index[p.material] for p in planes], np.int64) + STORED,
    }
    return words_of(SHAPE_RECORDS["Plane"], columns, len(planes), SHAPE_TEXELS)


def shape_records(
    shapes: Sequence[Shape],
    materials: Mapping[str, Material],
    index: Mapping[str, int],
    lights: NDArray[np.int64],
    origin: Floats,
    extent: float,
    detail: float,
    first_object: int = 0,
) -> Shapes:
    """The records of ``shapes`` about ``origin``, in a scene that extends ``extent`` metres from there and has things
    of ``detail`` metres; their objects are numbered from ``first_object`` on.

    ``shapes`` are in the order of :func:`finite_shapes`, ``index`` has the numbers of materials, ``lights`` (n,) the
    number of the light that each shape is, or -1.
    """
    material = np.array([index[shape.material] for shape in shapes], np.int64)
    flags = _flags(shapes, materials)
    words, lows, highs, counts, first = [], [], [], {}, 0
    for noun, (classes, geometry) in _GEOMETRY.items():
        some = [shape for shape in shapes if isinstance(shape, classes)]
        part = slice(first, first + len(some))
        columns, low, high = geometry(some, origin, lights[part] < 0)
        columns["kind"] = kind_words(columns["kind"], flags[part], first_object + first + np.arange(len(some)))
        stored = STORED if noun == "sphere" else 0
        columns |= {"material": material[part] + stored, "light": lights[part] + 1 + stored}
        if noun == "sphere":
            columns |= _globes(columns["center"], columns["radius"], detail, lights[part] < 0)
        words.append(words_of(SHAPE_RECORDS[noun.capitalize()], columns, len(some), SHAPE_TEXELS))
        lows.append(low)
        highs.append(high)
        counts[noun] = len(some)
        first += len(some)
    low, high = np.concatenate(lows), np.concatenate(highs)
    around = GROWTH * np.maximum(extent, np.maximum(np.abs(low), np.abs(high)).max(axis=1, initial=0.0))[:, None]
    bounds = np.concatenate([(low - around).T, -(high + around).T]).astype(np.float32)
    return Shapes(np.concatenate(words), bounds, counts)


def _flags(shapes: Sequence[Shape | Plane], materials: Mapping[str, Material]) -> NDArray[np.int64]:
    return np.array([0 if materials[shape.material].double_sided else CULLED for shape in shapes], np.int64)


def _sphere_geometry(spheres: Sequence[Sphere], origin: Floats, grows: Bools) -> tuple[dict[str, Any], Floats, Floats]:
    centers = _vectors([s.center for s in spheres]) - origin
    radii = np.array([s.radius for s in spheres], np.float64)
    kinds = np.full(len(spheres), Kind.SPHERE, np.int64)
    return {"kind": kinds, "center": centers, "radius": radii}, centers - radii[:, None], centers + radii[:, None]


def _globes(centers: Floats, radii: Floats, detail: float, may_be: Bools) -> dict[str, Floats]:
    """The columns of spheres that say which of them are globes."""
    away = np.linalg.norm(centers, axis=1)
    height = away - radii  # of the origin above the sphere
    is_globe = may_be & (radii > _GLOBE * np.maximum(detail, np.abs(height)))
    nearest = centers * np.where(is_globe, height / np.where(away > 0, away, 1), 0)[:, None]
    return {"curvature": np.where(is_globe, 1 / radii, 0), "nearest": nearest}


def _flat_geometry(flats: Sequence[Shape], origin: Floats, grows: Bools) -> tuple[dict[str, Any], Floats, Floats]:
    reach = np.abs(flat_corners(flats, origin)[1]).max(axis=(1, 2), initial=0.0)
    kinds, corners = flat_corners(flats, origin, np.where(grows, GROWTH * reach, 0.0))
    columns: dict[str, Any] = dict(zip("abc", corners.transpose(1, 0, 2), strict=True))
    return {"kind": kinds, "normal": _normals(corners), **columns}, *_flat_bounds(kinds, corners)


def flat_corners(
    flats: Sequence[Shape], origin: Floats, growth: Floats | float = 0.0
) -> tuple[NDArray[np.int64], Floats]:
    """Flat shapes about ``origin``, all rectangles before all disks before all triangles: their kinds (n,) and their
    points with coordinates (0, 0), (1, 0) and (0, 1), (n, 3, 3); beyond the edges by ``growth`` metres, (n,) in that
    order or of all."""
    kinds, corners, growths = [], [], np.broadcast_to(growth, len(flats))[:, None]
    for cls, (kind, corners_of) in FLATS.items():
        some = [shape for shape in flats if isinstance(shape, cls)]
        corners.append(corners_of(some, growths[: len(some)]))
        growths = growths[len(some) :]
        kinds.append(np.full(len(some), kind, np.int64))
    return np.concatenate(kinds), np.concatenate(corners) - origin


def _rectangles(rectangles: Sequence[Rectangle], growth: Floats) -> Floats:
    corner = _vectors([r.corner for r in rectangles])
    u, v = _vectors([r.edge_u for r in rectangles]), _vectors([r.edge_v for r in rectangles])
    step_u, step_v = growth * _unit(u), growth * _unit(v)
    a = corner - step_u - step_v
    return np.stack([a, a + u + 2 * step_u, a + v + 2 * step_v], axis=1)


def _disks(disks: Sequence[Disk], growth: Floats) -> Floats:
    center = _vectors([d.center for d in disks])
    radius = np.array([d.radius for d in disks], np.float64)[:, None] + growth
    u, v = disk_axes([d.normal for d in disks])
    return np.stack([center, center + radius * u, center + radius * v], axis=1)


def disk_axes(normals: Sequence[Sequence[float]]) -> tuple[Floats, Floats]:
    """Unit vectors u and v (n, 3) in the planes of ``normals`` of any length, with u × v along them."""
    normal = _unit(_vectors(normals))
    u = _unit(np.cross(np.eye(3)[np.abs(normal).argmin(axis=1)], normal))
    return u, np.cross(normal, u)


def _triangles(triangles: Sequence[Triangle], growth: Floats) -> Floats:
    vertices = np.array([t.vertices for t in triangles], np.float64).reshape(-1, 3, 3)
    opposite = np.roll(vertices, -1, 1) - np.roll(vertices, -2, 1)
    sides = np.linalg.norm(opposite, axis=2)[..., None]
    perimeter = sides.sum(axis=1, keepdims=True)
    incenter = (sides * vertices).sum(axis=1, keepdims=True) / perimeter
    doubled_area = np.linalg.norm(np.cross(opposite[:, 0], opposite[:, 1]), axis=1)[:, None, None]
    from_incenter = vertices - incenter
    farthest = np.linalg.norm(from_incenter, axis=2).max(axis=1)[:, None, None]
    grown: Floats = incenter + from_incenter * (
        1 + growth[:, None] * np.minimum(perimeter / doubled_area, _MOST_OF_TIP / farthest)
    )
    return grown


def balls_of(records: Words) -> Floats:
    """Center and radius of a ball around each of these ``records`` (n, 4, 4) of finite shapes, (n, 4)."""
    kinds = records[:, 0, 3] >> 24
    values = np.ascontiguousarray(records).view(np.float32).astype(np.float64)
    a, b, c = values[:, 0, :3], values[:, 1, :3], values[:, 2, :3]
    is_sphere, is_disk = kinds == Kind.SPHERE, kinds == Kind.DISK
    center = np.where((is_sphere | is_disk)[:, None], a, (b + c) / 2)
    around = np.maximum(np.linalg.norm(a - center, axis=1), np.linalg.norm(b - center, axis=1))
    return np.column_stack([center, np.where(is_sphere, values[:, 1, 0], around)])


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


# Of flat shapes: the kind, and the points a, b and c (n, 3, 3), grown by so many metres (n, 1).
FLATS: Mapping[type, tuple[Kind, Callable[[Sequence[Any], Floats], Floats]]] = {
    Rectangle: (Kind.RECTANGLE, _rectangles),
    Disk: (Kind.DISK, _disks),
    Triangle: (Kind.SINGLE_TRIANGLE, _triangles),
}
# By the noun of the record, in the order of the records: columns about an origin, and lower and upper corners (n, 3) of
# the bounds; some of the shapes grow.
_Geometry = Callable[[Sequence[Any], Floats, Bools], tuple[dict[str, Any], Floats, Floats]]
_GEOMETRY: Mapping[str, tuple[tuple[type, ...], _Geometry]] = {
    "sphere": ((Sphere,), _sphere_geometry),
    "flat": (tuple(FLATS), _flat_geometry),
}
_ORDER = {cls: i for i, cls in enumerate(cls for classes, _ in _GEOMETRY.values() for cls in classes)}
# What may stand on the short list, in this order, and the texels that its records need.
LISTED = {noun: texel_count(SHAPE_RECORDS[noun.capitalize()]) for noun in ("plane", *_GEOMETRY)}
