# SPDX-License-Identifier: MIT
"""Everything under the BVH as records of shaders/scene/shape.glsl, attributes of vertices, and the mesh light.

The BVH has two levels: the leaves of the upper one (TLAS) are the roots of the BLAS of :mod:`.instances`, and single
shapes. So a mesh that moves, or a shape that changes, builds no BLAS.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh import Bvh, build
from fragtracer.errors import SceneError
from fragtracer.packing.alias import alias_table, choice_probabilities
from fragtracer.packing.instances import Blas, Instance, MeshMaterial, TransformedInstance, fit, instances_of
from fragtracer.packing.lights import MESH_LIGHT
from fragtracer.packing.openness import walls_of
from fragtracer.packing.records import Words, words_of
from fragtracer.packing.shapes import GROWTH, SHAPE_RECORDS, SHAPE_TEXELS, Kind, Shapes, kind_words
from fragtracer.scene import Mesh

Floats = NDArray[np.float64]
Texels = NDArray[np.float32]

MOST_RECORDS = 2**24  # what the stack of shape/bvh.glsl can hold
RECORDS_IN_ROW = 1024  # of the texture
# Attributes of vertices: the width of a table, and what a vertex has that brings none.
ATTRIBUTES = {"normal": (3, 0.0), "uv": (4, 0.0), "tangent": (4, 0.0), "color": (4, 1.0)}


@dataclass(frozen=True, eq=False)
class PackedBvh:
    """Records (n, 4, 4) from record ``first`` on, tables of attributes (vertices, 4) by name, the mesh light.

    ``shape_records`` are the records of single shapes, in their order, ``walls`` those of :func:`.walls_of` that are
    not of instances, which lie in a space of their own.
    """

    words: Words
    first: int
    vertices: Mapping[str, Texels]
    mesh_lights: Words
    mesh_power: float
    shape_records: NDArray[np.int64]
    walls: Words
    features: Mapping[str, int]
    uniforms: Mapping[str, int]

    @cached_property
    def texels(self) -> Words:
        """The records as texels (n, 4), the same array each time: what is the same is not uploaded again."""
        return self.words.reshape(-1, 4)

    @cached_property
    def mesh_light_texels(self) -> Words:
        """The mesh light as texels (n, 4), the same array each time."""
        return self.mesh_lights.reshape(-1, 4)

    @property
    def root(self) -> dict[str, Words]:
        """The record that the BVH begins with, (1, 3, 4), by its noun, if it is a node."""
        return {"bvh_root": self.words[:1, :3]} if self.words[0, 0, 3] >> 24 == Kind.NODE else {}

    @property
    def usual_rounds(self) -> int:
        """How many steps few rays take more than: what is met grows with the depth of the BVH."""
        return 16 + 4 * int(np.log2(len(self.words)))


def rows_of(count: int) -> int:
    """Records that ``count`` of them take up in the texture, of which each part begins a row, and has one at least."""
    return RECORDS_IN_ROW * max(1, -(-count // RECORDS_IN_ROW))


@lru_cache(maxsize=2)
def pack_bvh(
    meshes: tuple[Mesh, ...],
    materials: tuple[tuple[str, MeshMaterial], ...],
    attributes: tuple[str, ...],
    shapes: Shapes,
    first: int,
    origin: tuple[float, float, float],
    extent: float,
) -> PackedBvh:
    """Pack meshes and shapes, at least one triangle or shape; what was packed last is kept, and is the same object
    again.

    ``attributes`` are those of :data:`ATTRIBUTES` that the shader needs. Records are numbered from ``first`` on.
    ``origin`` and ``extent`` are the middle and the half size of the scene.
    """
    instances = instances_of(meshes, dict(materials), np.asarray(origin))
    return _Packer(attributes, first, extent).pack(instances, shapes)


@dataclass(frozen=True, eq=False)
class _Emitter:
    """The triangles of an instance that emits: their records and areas, (n,), and the power of a square metre."""

    records: NDArray[np.int64]
    areas: Floats
    radiosity: float


class _Packer:
    """Puts records one behind the other; the first is the root of all."""

    def __init__(self, attributes: tuple[str, ...], first: int, extent: float) -> None:
        self._first = first
        self._epsilon = GROWTH * extent
        self._words: Words = np.empty((0, SHAPE_TEXELS, 4), np.uint32)
        self._vertices: dict[str, list[Texels]] = {name: [] for name in attributes}
        self._emitters: list[_Emitter] = []
        self._vertex_count = 0

    def pack(self, instances: Sequence[Instance], shapes: Shapes) -> PackedBvh:
        shared, placed = fit(instances, self._epsilon)
        roots = np.array([instance.bounds for instance in placed], np.float32).reshape(-1, 6).T
        bounds = np.concatenate([roots, shapes.bounds], axis=1)
        top = build(bounds)
        layout = top.layout
        blas = [*shared, *(instance for instance in placed if isinstance(instance, Blas))]
        count = (
            layout.count + sum(b.layout.count for b in shared) + sum(b.layout.count - 1 for b in blas[len(shared) :])
        )
        if count > MOST_RECORDS:
            raise SceneError(
                f"the scene has too many triangles and shapes: its BVH takes {count:,} records of at most "
                f"{MOST_RECORDS:,}; use simpler meshes"
            )
        self._words = np.zeros((count, SHAPE_TEXELS, 4), np.uint32)
        self._write(layout.nodes, _nodes(top, self._first + layout.first, top.child_bounds(bounds)[0]))
        end = layout.count
        root_of = {}
        for one in shared:
            root_of[one] = end
            self._add(one, end, end + 1)
            end += one.layout.count
        shared_records = slice(layout.count, end)
        transformed: list[TransformedInstance] = []
        places: list[int] = []
        for root, instance in zip(layout.leaves, placed, strict=False):
            if isinstance(instance, TransformedInstance):
                transformed.append(instance)
                places.append(root)
            else:
                self._add(instance, root, end)
                end += instance.layout.count - 1
        if transformed:
            self._add_instances(transformed, places, [root_of[instance.blas] for instance in transformed])
        of_shapes = layout.leaves[len(placed) :]
        self._write(of_shapes, shapes.words)

        lights, power = self._lights()
        features = {"HAS_MESHES": int(bool(placed)), "HAS_INSTANCES": int(bool(shared))}
        uniforms = {"u_bvh_root": self._first, "u_mesh_light_count": len(lights)}
        uniforms["u_bvh_shapes"] = shapes.flags
        # What is left to do beside the way to a leaf: a group at each level but that of the root; the traversal itself
        # holds one of them.
        uniforms["u_bvh_stack"] = max(0, top.depth + max((b.bvh.depth for b in blas), default=0) - 2)
        vertices = {name: np.concatenate(tables) for name, tables in self._vertices.items() if tables}
        walls = np.concatenate(
            [walls_of(self._words[: shared_records.start]), walls_of(self._words[shared_records.stop :])]
        )
        return PackedBvh(
            self._words, self._first, vertices, lights, power, self._first + of_shapes, walls, features, uniforms
        )

    def _write(self, places: NDArray[np.int64], words: Words) -> None:
        self._words[places] = words

    def _add(self, blas: Blas, root: int, rest: int) -> None:
        """Write the records of a BLAS: its root to ``root``, the others from ``rest`` on."""
        layout, instance = blas.layout, blas.instance

        def moved(records: NDArray[np.int64]) -> NDArray[np.int64]:
            return np.where(records == 0, root, rest - 1 + records)

        self._write(moved(layout.nodes), _nodes(blas.bvh, self._first + moved(layout.first), blas.child_bounds))
        triangles = instance.triangles
        columns: dict[str, Any] = {name: blas.corners[:, i] for i, name in enumerate("abc")}
        kind = kind_words(Kind.TRIANGLE, instance.material.flags, instance.object)
        columns |= {"kind": kind, "material": instance.material.index}
        if self._vertices:
            columns["vertices"] = triangles + self._vertex_count
            self._add_vertices(instance)
        place = moved(layout.leaves)
        self._write(place, words_of(SHAPE_RECORDS["Triangle"], columns, len(triangles)))
        if instance.material.power:
            edges = blas.corners[:, 1:].astype(np.float64) - blas.corners[:, :1]
            areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
            self._emitters.append(_Emitter(place, areas, np.pi * instance.material.power))

    def _add_vertices(self, instance: Instance) -> None:
        geometry, count = instance.geometry, len(instance.geometry.positions)
        linear, handedness = instance.matrix[:, :3], -1.0 if instance.is_mirrored else 1.0
        # The inverse transposed, but for its length.
        cofactors = handedness * np.cross(linear[[1, 2, 0]], linear[[2, 0, 1]])
        found: dict[str, Texels] = {}
        if geometry.normals is not None:
            found["normal"] = _unit(geometry.normals @ cofactors.T)
        if geometry.tangents is not None:
            tangents = _unit(geometry.tangents[:, :3] @ linear.T)
            found["tangent"] = np.column_stack([tangents, handedness * geometry.tangents[:, 3]])
        if geometry.colors is not None:
            found["color"] = geometry.colors
        nothing = np.zeros((count, 2), np.float32)
        sets = (uvs if uvs is not None else nothing for uvs in (geometry.uvs, geometry.uvs_1))
        found["uv"] = np.concatenate(list(sets), axis=1)
        for name, tables in self._vertices.items():
            table = np.full((count, 4), ATTRIBUTES[name][1], np.float32)
            if name in found:
                table[:, : found[name].shape[1]] = found[name]
            tables.append(table)
        self._vertex_count += count
        if self._vertex_count > MOST_RECORDS:
            raise SceneError(f"the meshes have more than {MOST_RECORDS:,} vertices; use simpler meshes")

    def _add_instances(self, transformed: Sequence[TransformedInstance], places: list[int], roots: list[int]) -> None:
        """Write the records of instances that share BLAS to ``places``; ``roots`` are those of their BLAS."""
        instances = [each.instance for each in transformed]
        inverse = np.linalg.inv(np.array([instance.matrix[:, :3] for instance in instances]))
        columns: dict[str, Any] = {f"row_{axis}": inverse[:, i] for i, axis in enumerate("xyz")}
        flags, objects = (
            np.array(kind) for kind in zip(*((i.material.flags, i.object) for i in instances), strict=True)
        )
        columns |= {"kind": kind_words(Kind.INSTANCE, flags, objects), "root": self._first + np.array(roots)}
        columns["material"] = np.array([instance.material.index for instance in instances])
        columns["translation"] = np.array([instance.middle for instance in instances])
        self._write(np.array(places), words_of(SHAPE_RECORDS["Instance"], columns, len(instances)))

    def _lights(self) -> tuple[Words, float]:
        """The alias table over emitting triangles (n, 1, 4), and the power of all; writes their densities per area."""
        nothing = np.zeros((0, 1, 4), np.uint32), 0.0
        if not self._emitters:
            return nothing
        areas = np.concatenate([emitter.areas for emitter in self._emitters])
        power = np.concatenate([emitter.areas * emitter.radiosity for emitter in self._emitters])
        record = np.concatenate([emitter.records for emitter in self._emitters])
        there = np.flatnonzero(areas > 0)
        if not there.size:
            return nothing
        probability = choice_probabilities(power[there])
        threshold, other = alias_table(probability)
        density = np.zeros(len(areas))
        density[there] = probability / areas[there]
        self._words.view(np.float32)[record, 2, 3] = density
        records = self._first + record[there]
        columns = {"threshold": threshold, "record": records, "other": records[other]}
        return words_of(MESH_LIGHT, columns, len(there)), float(power.sum())


def _nodes(bvh: Bvh, first: NDArray[np.int64], bounds: Texels) -> Words:
    """Records of nodes; ``first`` (nodes,) are the records where their children begin, ``bounds`` (nodes, WIDTH, 6)
    those of the children, rounded outwards to a byte for each side."""
    low, high = bounds[..., :3].astype(np.float64), -bounds[..., 3:].astype(np.float64)
    origin = low.min(axis=1)
    exponent = np.clip(np.frexp((high.max(axis=1) - origin) / 255)[1], -126, 127)
    step = np.ldexp(1.0, exponent)[:, None]
    lower = np.floor((low - origin[:, None]) / step).clip(0, 255)
    upper = np.ceil((high - origin[:, None]) / step).clip(0, 255)
    columns: dict[str, Any] = {
        axis: np.stack([_bytes(lower[..., i]), _bytes(upper[..., i])], axis=1) for i, axis in enumerate("xyz")
    }
    kind = Kind.NODE << 24 | _bytes(exponent + 127)
    columns |= {"origin": origin, "kind": kind, "first": first, "count": bvh.is_there.sum(axis=1)}
    return words_of(SHAPE_RECORDS["Node"], columns, len(origin), SHAPE_TEXELS)


def _bytes(values: NDArray[Any]) -> NDArray[np.int64]:
    """Words of up to four bytes (n, 4), the first one lowest."""
    words: NDArray[np.int64] = (values.astype(np.int64) << np.arange(0, 8 * values.shape[1], 8)).sum(axis=1)
    return words


def _unit(vectors: NDArray[np.floating]) -> Texels:
    """Vectors (n, 3) of length 1; those of length 0 stay."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return (vectors / np.where(length > 0, length, 1)).astype(np.float32)
