# SPDX-License-Identifier: MIT
"""Meshes -> texels: one tree of boxes over all of them, their triangles, vertices, copies and lights.

Each geometry has a tree of its own, kept on disk, which is fitted to where the geometry stands; a
small tree over all of them stands on top. So a mesh that moves costs no new tree. A geometry whose
copies would take much memory is packed once, in its own space, and met through a matrix.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh import Bvh, build
from fragtracer.cache import cached
from fragtracer.errors import SceneError
from fragtracer.packing.alias import alias_table
from fragtracer.packing.records import MESH_RECORDS, texels_of_columns, vertex_record
from fragtracer.scene import Geometry, Mesh
from fragtracer.shader_composer import CONSTANTS

Floats = NDArray[np.float64]
Texels = NDArray[np.float32]

_BVH_VERSION = 2  # of fragtracer.bvh, for the files it leaves on disk
_TREES_KEPT = 64  # in memory
# Copies of a geometry are packed one by one while they add fewer triangles than this: rays then need no matrix.
MOST_COPIED = 100_000
_MOST_RECORDS = 2**24  # that a float32 can number
# Boxes grow by this, relative to the scene: where a ray passes an edge is known no better.
_BOX_GROWTH = 1e-6
_UNIFORM_CHOICE = 0.1  # the share of light choices that ignores power
CULLED = 1  # a flag of triangles and instances: not there for rays from behind


@dataclass(frozen=True)
class MeshMaterial:
    """What of a material decides how its triangles are packed."""

    index: int
    power: float  # emission, summed over the channels
    flags: int


@dataclass(frozen=True, eq=False)
class PackedMeshes:
    """Texels (records, texels of each, 4) float32 for the shader, the power of all that emits, the fields
    of a vertex, and defines."""

    records: Texels
    vertices: Texels
    lights: Texels
    power: float
    vertex_fields: tuple[str, ...]
    defines: Mapping[str, int]

    @property
    def usual_rounds(self) -> int:
        """How many steps few rays take more than: what is met grows with the depth of the tree."""
        return 16 + 6 * int(np.log2(len(self.records)))

    @property
    def textures(self) -> dict[str, Texels]:
        """(n, 4) texels, by the sampler that reads them."""
        tables = {"u_mesh": self.records, "u_mesh_vertices": self.vertices, "u_mesh_lights": self.lights}
        return {name: table.reshape(-1, 4) for name, table in tables.items()}


@dataclass(frozen=True, eq=False)
class _Copy:
    """A geometry at one of its places."""

    geometry: Geometry
    material: MeshMaterial
    matrix: Floats  # (3, 4), to the space of the shader

    @property
    def is_sharing(self) -> bool:
        """Whether it can be met through its matrix. One that emits has triangles of its own: lights are
        drawn by triangle, and each has its own area."""
        return not self.material.power and abs(np.linalg.det(self.matrix[:, :3])) > 0


@lru_cache(maxsize=2)
def pack_meshes(
    meshes: tuple[Mesh, ...],
    materials: tuple[tuple[str, MeshMaterial], ...],
    vertex_fields: tuple[str, ...],
    origin: tuple[float, float, float],
    extent: float,
) -> PackedMeshes:
    """Pack ``meshes``, at least one triangle; what was packed last is kept, and is the same object again.

    ``vertex_fields`` are those of MeshVertex that the shader needs. ``origin`` and ``extent`` are the middle and
    the half size of the scene.
    """
    return _Packer(vertex_fields, extent).pack(_copies(meshes, dict(materials), np.asarray(origin)))


def _copies(meshes: Sequence[Mesh], materials: Mapping[str, MeshMaterial], origin: Floats) -> list[_Copy]:
    copies = []
    for mesh in meshes:
        for matrix, part in mesh.placed():
            matrix[:3, 3] -= origin
            copies.append(_Copy(part.geometry, materials[mesh.material_of(part)], matrix[:3]))
    return copies


@lru_cache(maxsize=_TREES_KEPT)
def _tree(geometry: Geometry) -> Bvh:
    """The tree of a geometry, from the disk if it was built before."""

    def make() -> dict[str, NDArray[np.generic]]:
        positions = (geometry.positions - _middle(geometry)).astype(np.float32)
        bvh = build(triangle_boxes(positions[geometry.triangles]))
        return {"children": bvh.children, "order": bvh.order, "last": bvh.last, "depth": np.array(bvh.depth)}

    arrays = cached("bvh", f"{_BVH_VERSION}-{geometry.digest}", make)
    return Bvh(arrays["children"], arrays["order"], arrays["last"], int(arrays["depth"]))


def _middle(geometry: Geometry) -> Floats:
    middle: Floats = geometry.bounds.mean(axis=0)
    return middle


def triangle_boxes(corners: Texels) -> Texels:
    """Boxes (6, n) of triangles (n, 3, 3), as :mod:`fragtracer.bvh` wants them."""
    return np.concatenate([corners.min(axis=1).T, -corners.max(axis=1).T])


class _Packer:
    """Puts records one behind the other; the first is the root of all."""

    def __init__(self, vertex_fields: tuple[str, ...], extent: float) -> None:
        self._fields = vertex_fields
        self._growth = _BOX_GROWTH * extent
        self._records: list[Texels] = []
        self._vertices: list[Texels] = []
        self._emitters: list[tuple[int, Floats, float]] = []  # first record, areas, power of a square metre
        self._record_count = self._vertex_count = 0

    def pack(self, copies: Sequence[_Copy]) -> PackedMeshes:
        shared = _shared(copies)
        # A node of the tree on top has two children; with one copy there is none.
        self._record_count = len(copies) - 1
        roots: dict[Geometry, tuple[int, Texels, int]] = {}
        placed = []
        depth = 0
        for copy in copies:
            if copy.geometry in shared and copy.is_sharing:
                if copy.geometry not in roots:
                    same = [c for c in copies if c.is_sharing and c.geometry == copy.geometry]
                    reach = max(np.linalg.norm(np.linalg.inv(c.matrix[:, :3]), 2) for c in same)
                    roots[copy.geometry] = self._add_triangles(_in_own_space(copy), self._growth * float(reach))
                root, box, below = roots[copy.geometry]
                placed.append(self._add_instance(copy, root, box))
                below += 1
            else:
                root, box, below = self._add_triangles(copy, self._growth)
                placed.append((root, box))
            depth = max(depth, below)
        depth += self._add_top([root for root, _ in placed], np.stack([box for _, box in placed], axis=1))
        records = np.concatenate(self._records)
        if len(records) > _MOST_RECORDS:
            raise SceneError(
                f"the meshes have too many triangles: their tree takes {len(records):,} records of at most "
                f"{_MOST_RECORDS:,}; use simpler meshes"
            )
        density, lights, power = self._lights()
        for first, values in density:
            records[first : first + len(values), 2, 3] = values
        vertices = np.concatenate(self._vertices) if self._vertices else np.zeros((1, 1, 4), np.float32)
        defines = {
            "HAS_MESHES": 1,
            "HAS_INSTANCES": int(bool(roots)),
            "HAS_MESH_LIGHT": int(power > 0),
            "HAS_CULLING": int(any(copy.material.flags & CULLED for copy in copies)),
            "MESH_STACK": -(-(depth + 2) // 8) * 8,  # in steps, so that few edits compile
            "MESH_LIGHT_COUNT": len(lights),
            "MESH_VERTEX_TEXELS": vertices.shape[1] if self._vertices else 0,
        }
        defines |= {_FEATURES[name]: int(name in self._fields) for name in _FEATURES}
        return PackedMeshes(records, vertices, lights, power, self._fields, defines)

    def _add_triangles(self, copy: _Copy, growth: float) -> tuple[int, Texels, int]:
        """The root, its box (6,) and the depth of the tree of a copy, which is added."""
        bvh = _tree(copy.geometry)
        linear, move = copy.matrix[:, :3], copy.matrix[:, 3]
        mirrored = np.linalg.det(linear) < 0
        triangles = copy.geometry.triangles[bvh.order]
        if mirrored:  # so that the front stays the front
            triangles = triangles[:, [0, 2, 1]]
        positions = (copy.geometry.positions @ linear.T + move).astype(np.float32)
        corners = positions[triangles]
        boxes, root_box = bvh.child_boxes(triangle_boxes(corners))
        boxes -= np.float32(growth)

        first_node = self._record_count
        first_triangle = first_node + len(bvh.children)
        children = np.where(bvh.children < 0, first_triangle + ~bvh.children, first_node + bvh.children)
        self._add(_nodes(boxes, children))
        columns = {
            **{name: corners[:, i] for i, name in enumerate("abc")},
            "kind": np.where(bvh.last, CONSTANTS["MESH_LAST_TRIANGLE"], CONSTANTS["MESH_TRIANGLE"]),
            "material": copy.material.index,
            "flags": copy.material.flags,
        }
        if self._fields:
            columns["vertices"] = triangles + self._vertex_count
            self._add_vertices(copy, -1.0 if mirrored else 1.0)
        self._add(texels_of_columns(MESH_RECORDS["MeshTriangle"], columns, len(triangles)))
        if copy.material.power:
            edges = corners[:, 1:].astype(np.float64) - corners[:, :1]
            areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
            self._emitters.append((first_triangle, areas, np.pi * copy.material.power))
        return first_node, root_box - np.float32(growth), bvh.depth

    def _add_vertices(self, copy: _Copy, handedness: float) -> None:
        geometry, count = copy.geometry, len(copy.geometry.positions)
        linear = copy.matrix[:, :3]
        cofactors = handedness * np.cross(
            linear[[1, 2, 0]], linear[[2, 0, 1]]
        )  # the inverse transposed, but for its length
        columns: dict[str, Texels | float] = {"color": 1.0}
        if geometry.normals is not None:
            columns["normal"] = _unit(geometry.normals @ cofactors.T)
        if geometry.tangents is not None:
            tangents = _unit(geometry.tangents[:, :3] @ linear.T)
            columns["tangent"] = np.column_stack([tangents, handedness * geometry.tangents[:, 3]]).astype(np.float32)
        if geometry.colors is not None:
            opaque = np.ones((count, 4), np.float32)
            opaque[:, : geometry.colors.shape[1]] = geometry.colors
            columns["color"] = opaque
        columns |= {k: v for k, v in (("uv", geometry.uvs), ("uv_1", geometry.uvs_1)) if v is not None}
        self._vertices.append(texels_of_columns(vertex_record(self._fields), columns, count))
        self._vertex_count += count
        if self._vertex_count > _MOST_RECORDS:
            raise SceneError(f"the meshes have more than {_MOST_RECORDS:,} vertices; use simpler meshes")

    def _add_instance(self, copy: _Copy, root: int, box: Texels) -> tuple[int, Texels]:
        """The record of an instance and its box in the space of the shader."""
        linear = copy.matrix[:, :3]
        move = linear @ _middle(copy.geometry) + copy.matrix[:, 3]
        inverse = np.linalg.inv(linear)
        columns = dict(zip(("row_x", "row_y", "row_z"), inverse, strict=True))
        columns |= {"translation": move, "root": root, "kind": CONSTANTS["MESH_INSTANCE"]}
        columns |= {"material": copy.material.index, "flags": copy.material.flags}
        place = self._record_count
        self._add(texels_of_columns(MESH_RECORDS["MeshInstance"], columns, 1))
        low, high = box[:3].astype(np.float64), -box[3:].astype(np.float64)
        middle, half = linear @ ((low + high) / 2) + move, np.abs(linear) @ ((high - low) / 2) + self._growth
        return place, np.concatenate([middle - half, -(middle + half)]).astype(np.float32)

    def _add_top(self, roots: Sequence[int], boxes: Texels) -> int:
        """The tree over all copies, in the place that was left for it; returns its depth."""
        bvh = build(boxes, max_leaf=1)
        child_boxes, _ = bvh.child_boxes(boxes[:, bvh.order])
        leaves = np.asarray(roots)[bvh.order]
        children = np.where(bvh.children < 0, leaves[~np.minimum(bvh.children, -1)], bvh.children)
        self._records.insert(0, _nodes(child_boxes, children))
        return bvh.depth

    def _add(self, records: Texels) -> None:
        self._records.append(records)
        self._record_count += len(records)

    def _lights(self) -> tuple[list[tuple[int, Floats]], Texels, float]:
        """The density per area of each emitting triangle, by first record; the table they are drawn from;
        and the power of all."""
        if not self._emitters:
            return [], np.zeros((1, 1, 4), np.float32), 0.0
        areas = np.concatenate([areas for _, areas, _ in self._emitters])
        power = np.concatenate([areas * strength for _, areas, strength in self._emitters])
        record = np.concatenate([first + np.arange(len(areas)) for first, areas, _ in self._emitters])
        there = np.flatnonzero(areas > 0)
        if not there.size:
            return [], np.zeros((1, 1, 4), np.float32), 0.0
        probability = (1 - _UNIFORM_CHOICE) * power[there] / power.sum() + _UNIFORM_CHOICE / len(there)
        threshold, other = alias_table(probability)
        density = np.zeros(len(areas))
        density[there] = probability / areas[there]
        ends = np.cumsum([len(areas) for _, areas, _ in self._emitters])[:-1]
        densities = list(zip([first for first, _, _ in self._emitters], np.split(density, ends), strict=True))
        columns = {"threshold": threshold, "record": record[there], "other": record[there][other]}
        return densities, texels_of_columns(MESH_RECORDS["MeshLight"], columns, len(there)), float(power.sum())


_FEATURES = {
    "normal": "HAS_SHADING_NORMALS",
    "uv": "HAS_UV",
    "uv_1": "HAS_UV_1",
    "tangent": "HAS_TANGENTS",
    "color": "HAS_COLORS",
}


def _shared(copies: Sequence[_Copy]) -> set[Geometry]:
    """The geometries that are packed once, however many copies there are."""
    uses = Counter(copy.geometry for copy in copies)
    return {geometry for geometry, n in uses.items() if (n - 1) * len(geometry.triangles) > MOST_COPIED}


def _in_own_space(copy: _Copy) -> _Copy:
    """The copy where it is, but for its middle in the origin."""
    return _Copy(copy.geometry, copy.material, np.column_stack([np.eye(3), -_middle(copy.geometry)]))


def _nodes(boxes: Texels, children: NDArray[np.int64]) -> Texels:
    """Records of inner nodes with the boxes (n, 2, 6) of their ``children`` (n, 2)."""
    columns: dict[str, NDArray[Any]] = {f"low_{side}": boxes[:, side, :3] for side in (0, 1)}
    columns |= {f"high_{side}": -boxes[:, side, 3:] for side in (0, 1)}
    columns |= {f"child_{side}": children[:, side] for side in (0, 1)}
    return texels_of_columns(MESH_RECORDS["MeshNode"], columns | {"kind": CONSTANTS["MESH_NODE"]}, len(children))


def _unit(vectors: NDArray[np.floating]) -> Texels:
    """Vectors (n, 3) of length 1; those of length 0 stay."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return (vectors / np.where(length > 0, length, 1)).astype(np.float32)
