# SPDX-License-Identifier: MIT
"""Meshes -> texels: one tree of boxes over all of them, their triangles, vertices, copies and lights.

A small tree stands on top of those of :mod:`.copies`. So a mesh that moves costs no new tree.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh import Bvh, build
from fragtracer.errors import SceneError
from fragtracer.packing.alias import alias_table, chances
from fragtracer.packing.copies import Copy, Fitted, Instance, MeshMaterial, copies_of, fit
from fragtracer.packing.records import (
    MESH_RECORDS,
    MESH_TREE_RECORDS,
    MESH_TREE_TEXELS,
    texels_of_columns,
    vertex_record,
    words_of_columns,
)
from fragtracer.scene import Mesh
from fragtracer.shader_composer import CONSTANTS

Floats = NDArray[np.float64]
Texels = NDArray[np.float32]
Words = NDArray[np.uint32]

_MOST_RECORDS = 2**24  # that a float32 can number
# Boxes grow by this, relative to the scene: where a ray passes an edge is known no better.
_BOX_GROWTH = 1e-6
CULLED = 1  # a flag of triangles and instances: not there for rays from behind


@dataclass(frozen=True, eq=False)
class PackedMeshes:
    """Tables for the shader, (n, texels of a record, 4), the power of all that emits, the fields of a vertex, and
    defines. ``tree`` is uint32, the others float32."""

    tree: Words
    vertices: Texels
    lights: Texels
    power: float
    vertex_fields: tuple[str, ...]
    defines: Mapping[str, int]

    @property
    def usual_rounds(self) -> int:
        """How many steps few rays take more than: what is met grows with the depth of the tree."""
        return 16 + 4 * int(np.log2(len(self.tree)))

    @property
    def textures(self) -> dict[str, Texels | Words]:
        """(n, 4) texels, by the sampler that reads them."""
        tables: dict[str, Texels | Words] = {"u_mesh": self.tree}
        tables |= {"u_mesh_vertices": self.vertices, "u_mesh_lights": self.lights}
        return {name: table.reshape(-1, 4) for name, table in tables.items()}


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
    return _Packer(vertex_fields, extent).pack(copies_of(meshes, dict(materials), np.asarray(origin)))


@dataclass(frozen=True, eq=False)
class _Emitter:
    """The triangles of a copy that emits: their records and areas, (n,), and the power of a square metre."""

    records: NDArray[np.int64]
    areas: Floats
    strength: float


class _Packer:
    """Puts records one behind the other; the first is the root of all."""

    def __init__(self, vertex_fields: tuple[str, ...], extent: float) -> None:
        self._fields = vertex_fields
        self._growth = _BOX_GROWTH * extent
        self._tree: Words = np.empty((0, MESH_TREE_TEXELS, 4), np.uint32)
        self._vertices: list[Texels] = []
        self._emitters: list[_Emitter] = []
        self._vertex_count = 0

    def pack(self, copies: Sequence[Copy]) -> PackedMeshes:
        shared, placed = fit(copies, self._growth)
        boxes = np.stack([fitted.box for fitted in placed], axis=1)
        top = build(boxes)  # its boxes are the roots of all copies
        layout = top.layout()
        fitted = [*shared, *(copy for copy in placed if isinstance(copy, Fitted))]
        count = layout.count + sum(tree.layout.count for tree in fitted)
        if count > _MOST_RECORDS:
            raise SceneError(
                f"the meshes have too many triangles: their tree takes {count:,} records of at most "
                f"{_MOST_RECORDS:,}; use simpler meshes"
            )
        self._tree = np.zeros((count, MESH_TREE_TEXELS, 4), np.uint32)
        self._tree[layout.nodes] = _nodes(top, layout.first, top.child_boxes(boxes)[0])
        end = layout.count
        root_of = {}
        for tree in shared:
            root_of[tree] = end
            self._add(tree, end, end + 1)
            end += tree.layout.count
        for root, copy in zip(layout.boxes, placed, strict=True):
            if isinstance(copy, Instance):
                self._add_instance(copy, root, root_of[copy.tree])
            else:
                self._add(copy, root, end)
                end += copy.layout.count - 1

        lights, power = self._lights()
        vertices = np.concatenate(self._vertices) if self._vertices else np.zeros((1, 1, 4), np.float32)
        depth = top.depth + max(tree.bvh.depth for tree in fitted)
        defines = {
            "HAS_MESHES": 1,
            "HAS_INSTANCES": int(bool(shared)),
            "HAS_MESH_LIGHT": int(power > 0),
            "HAS_CULLING": int(any(copy.material.flags & CULLED for copy in copies)),
            "MESH_STACK": -(-(depth + 2) // 8) * 8,  # in steps, so that few edits compile
            "MESH_LIGHT_COUNT": len(lights),
            "MESH_VERTEX_TEXELS": vertices.shape[1] if self._vertices else 0,
        }
        defines |= {_FEATURES[name]: int(name in self._fields) for name in _FEATURES}
        return PackedMeshes(self._tree[:end], vertices, lights, power, self._fields, defines)

    def _add(self, fitted: Fitted, root: int, rest: int) -> None:
        """Write the records of a copy: its root to ``root``, the others from ``rest`` on."""
        layout, copy = fitted.layout, fitted.copy

        def moved(records: NDArray[np.int64]) -> NDArray[np.int64]:
            return np.where(records == 0, root, rest - 1 + records)

        self._tree[moved(layout.nodes)] = _nodes(fitted.bvh, moved(layout.first), fitted.child_boxes)
        triangles = copy.triangles
        columns: dict[str, Any] = {name: fitted.corners[:, i] for i, name in enumerate("abc")}
        columns |= {"kind": CONSTANTS["MESH_TRIANGLE"] << 24 | copy.material.flags, "material": copy.material.index}
        if self._fields:
            columns["vertices"] = triangles + self._vertex_count
            self._add_vertices(copy)
        place = moved(layout.boxes)
        self._tree[place] = words_of_columns(MESH_TREE_RECORDS["MeshTriangle"], columns, len(triangles))
        if copy.material.power:
            edges = fitted.corners[:, 1:].astype(np.float64) - fitted.corners[:, :1]
            areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
            self._emitters.append(_Emitter(place, areas, np.pi * copy.material.power))

    def _add_vertices(self, copy: Copy) -> None:
        geometry, count = copy.geometry, len(copy.geometry.positions)
        linear, handedness = copy.matrix[:, :3], -1.0 if copy.is_mirrored else 1.0
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

    def _add_instance(self, instance: Instance, place: int, root: int) -> None:
        copy = instance.copy
        inverse = np.linalg.inv(copy.matrix[:, :3])
        columns: dict[str, Any] = dict(zip(("row_x", "row_y", "row_z"), inverse, strict=True))
        columns |= {"kind": CONSTANTS["MESH_INSTANCE"] << 24 | copy.material.flags}
        columns |= {"root": root, "material": copy.material.index, "translation": copy.middle}
        self._tree[place] = words_of_columns(MESH_TREE_RECORDS["MeshInstance"], columns, 1)

    def _lights(self) -> tuple[Texels, float]:
        """The table that emitting triangles are drawn from, and the power of all; writes their densities per area."""
        nothing = np.zeros((1, 1, 4), np.float32), 0.0
        if not self._emitters:
            return nothing
        areas = np.concatenate([emitter.areas for emitter in self._emitters])
        power = np.concatenate([emitter.areas * emitter.strength for emitter in self._emitters])
        record = np.concatenate([emitter.records for emitter in self._emitters])
        there = np.flatnonzero(areas > 0)
        if not there.size:
            return nothing
        probability = chances(power[there])
        threshold, other = alias_table(probability)
        density = np.zeros(len(areas))
        density[there] = probability / areas[there]
        self._tree.view(np.float32)[record, 2, 3] = density
        columns = {"threshold": threshold, "record": record[there], "other": record[there][other]}
        return texels_of_columns(MESH_RECORDS["MeshLight"], columns, len(there)), float(power.sum())


_FEATURES = {
    "normal": "HAS_SHADING_NORMALS",
    "uv": "HAS_UV",
    "uv_1": "HAS_UV_1",
    "tangent": "HAS_TANGENTS",
    "color": "HAS_COLORS",
}


def _nodes(bvh: Bvh, first: NDArray[np.int64], boxes: Texels) -> Words:
    """Records of nodes; ``first`` (nodes,) are the records where their children begin, ``boxes`` (nodes, WIDTH, 6)
    those of the children.

    Bounds are rounded outwards to a byte each (Ylitie, Karras and Laine 2017, Efficient Incoherent Ray Traversal on
    GPUs Through Compressed Wide BVHs).
    """
    low, high = boxes[..., :3].astype(np.float64), -boxes[..., 3:].astype(np.float64)
    origin = low.min(axis=1)
    exponent = np.clip(np.frexp((high.max(axis=1) - origin) / 255)[1], -126, 127)
    step = np.ldexp(1.0, exponent)[:, None]
    lower = np.floor((low - origin[:, None]) / step).clip(0, 255)
    upper = np.ceil((high - origin[:, None]) / step).clip(0, 255)
    columns: dict[str, Any] = {
        axis: np.stack([_bytes(lower[..., i]), _bytes(upper[..., i])], axis=1) for i, axis in enumerate("xyz")
    }
    kind = CONSTANTS["MESH_NODE"] << 24 | _bytes(np.pad(exponent + 127, ((0, 0), (0, 1))))
    columns |= {"origin": origin, "kind": kind, "first": first, "count": bvh.is_there.sum(axis=1)}
    return words_of_columns(MESH_TREE_RECORDS["MeshNode"], columns, len(origin))


def _bytes(values: NDArray[Any]) -> NDArray[np.int64]:
    """Words of four bytes (n, 4), the first one lowest."""
    words: NDArray[np.int64] = (values.astype(np.int64) << np.arange(0, 32, 8)).sum(axis=1)
    return words


def _unit(vectors: NDArray[np.floating]) -> Texels:
    """Vectors (n, 3) of length 1; those of length 0 stay."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return (vectors / np.where(length > 0, length, 1)).astype(np.float32)
