# SPDX-License-Identifier: MIT
"""Instances of geometries, each with its bottom-level BVH (BLAS).

The topology of a BLAS belongs to the geometry and is kept on disk; it is refitted to each instance in world space. A
geometry whose instances would take much memory has one BLAS in its own space, which rays enter through a matrix.
"""

from collections.abc import Iterable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh import Bvh, Layout, build
from fragtracer.cache import cached
from fragtracer.scene import Geometry, Mesh
from fragtracer.scene.content import content_digest

Floats = NDArray[np.float64]
Texels = NDArray[np.float32]

_BVH_VERSION = 9  # of fragtracer.bvh, for the files kept on disk
# BVHs of more geometries than this, of fewer triangles each, share a file on disk.
_FILES, _SMALL = 64, 1024
# Instances of a geometry have a BLAS each while they add fewer triangles than this: rays then need no matrix.
MOST_REPEATED = 100_000
# Those through whose matrices bounds grow by more than the first of these, relative to the mesh, share a looser BLAS
# where copies of them would add more triangles than that; by more than the second they share none.
_LOOSE_EPSILON, _MOST_EPSILON = 1e-3, 0.05
MOST_REPEATED_LOOSE = 1_000_000


@dataclass(frozen=True)
class MeshMaterial:
    """What of a material decides how its triangles are packed."""

    index: int
    power: float  # emission, summed over the channels
    flags: int


@dataclass(frozen=True, eq=False)
class Instance:
    """A geometry at one of its places."""

    geometry: Geometry
    material: MeshMaterial
    matrix: Floats  # (3, 4), to the space of the shader
    object: int  # its number

    @property
    def is_mirrored(self) -> bool:
        return bool(np.linalg.det(self.matrix[:, :3]) < 0)

    @property
    def middle(self) -> Floats:
        """(3,): where the middle of the geometry is."""
        middle: Floats = self.matrix[:, :3] @ _middle(self.geometry) + self.matrix[:, 3]
        return middle

    @property
    def triangles(self) -> NDArray[np.integer]:
        """(n, 3) vertices, turned if need be so that the front stays the front."""
        triangles = self.geometry.triangles
        return triangles[:, [0, 2, 1]] if self.is_mirrored else triangles


@dataclass(frozen=True, eq=False)
class Blas:
    """An instance with its BVH, refitted to where it stands."""

    instance: Instance
    bvh: Bvh
    layout: Layout
    corners: Texels  # (n, 3, 3)
    child_bounds: Texels
    bounds: Texels  # (6,)


@dataclass(frozen=True, eq=False)
class TransformedInstance:
    """An instance that shares a BLAS, which rays enter through its matrix."""

    instance: Instance
    blas: Blas
    bounds: Texels


def instances_of(meshes: Sequence[Mesh], materials: Mapping[str, MeshMaterial], origin: Floats) -> list[Instance]:
    """Every part of ``meshes`` at every place, (0, 0, 0) at ``origin`` (3,); the mesh is the object."""
    instances = []
    for i, mesh in enumerate(meshes):
        for matrix, part in mesh.placed():
            matrix[:3, 3] -= origin
            instances.append(Instance(part.geometry, materials[mesh.material_of(part)], matrix[:3], i))
    return instances


def fit(instances: Sequence[Instance], epsilon: float) -> tuple[list[Blas], list[Blas | TransformedInstance]]:
    """The BLAS that are shared, and all instances in their order; bounds grow by ``epsilon`` metres."""
    _find_topologies(instance.geometry for instance in instances)
    local = _local_epsilons(instances, epsilon)
    may_share: dict[tuple[Geometry, bool], list[int]] = {}
    for i, instance in enumerate(instances):
        if local[i] < np.inf:
            is_loose = bool(local[i] > _LOOSE_EPSILON * _size(instance.geometry))
            may_share.setdefault((instance.geometry, is_loose), []).append(i)
    shared: list[Blas] = []
    transformed: dict[int, TransformedInstance] = {}
    for (geometry, is_loose), numbers in may_share.items():
        most = MOST_REPEATED_LOOSE if is_loose else MOST_REPEATED
        if (len(numbers) - 1) * len(geometry.triangles) > most:
            blas = _blas(_in_own_space(geometry), local[numbers].max())
            shared.append(blas)
            bounds = _instance_bounds([instances[i] for i in numbers], blas.bounds, epsilon)
            for i, of_one in zip(numbers, bounds, strict=True):
                transformed[i] = TransformedInstance(instances[i], blas, of_one)
    placed = [transformed.get(i) or _blas(instance, epsilon) for i, instance in enumerate(instances)]
    return shared, placed


def _local_epsilons(instances: Sequence[Instance], epsilon: float) -> Floats:
    """By how much bounds have to grow, in units of its geometry, for rays through the matrix of each instance, (n,).

    Infinite for an instance that needs triangles of its own: one that emits, since lights are drawn by triangle, each
    with its area; and one so small or flat that its bounds would overlap.
    """
    matrices = np.array([instance.matrix[:, :3] for instance in instances]).reshape(-1, 3, 3)
    least = np.linalg.svd(matrices, compute_uv=False)[:, 2]  # what a unit shrinks to at most
    size = np.array([_size(instance.geometry) for instance in instances])
    emits = np.array([instance.material.power > 0 for instance in instances], bool)
    local = np.divide(epsilon, least, out=np.full(len(least), np.inf), where=least > 0)
    return np.where(emits | (local > _MOST_EPSILON * size), np.inf, local)


def _in_own_space(geometry: Geometry) -> Instance:
    """The geometry for all its instances to share, its middle in the origin; materials are theirs."""
    nothing = MeshMaterial(0, 0.0, 0)
    return Instance(geometry, nothing, np.column_stack([np.eye(3), -_middle(geometry)]), 0)


def _blas(instance: Instance, epsilon: float) -> Blas:
    """An instance and its BVH, bounds grown by ``epsilon``."""
    bvh = _topologies[instance.geometry]
    positions = (instance.geometry.positions @ instance.matrix[:, :3].T + instance.matrix[:, 3]).astype(np.float32)
    corners = positions[instance.triangles]
    child_bounds, bounds = bvh.child_bounds(triangle_bounds(corners))
    growth = np.float32(epsilon)
    return Blas(instance, bvh, bvh.layout, corners, child_bounds - growth, bounds - growth)


def _instance_bounds(instances: Sequence[Instance], bounds: Texels, epsilon: float) -> Texels:
    """The bounds (n, 6) of instances of a geometry whose triangles have ``bounds`` (6,) in their own space."""
    low, high = bounds[:3].astype(np.float64), -bounds[3:].astype(np.float64)
    linear = np.array([instance.matrix[:, :3] for instance in instances])
    middle = linear @ ((low + high) / 2) + [instance.middle for instance in instances]
    half = np.abs(linear) @ ((high - low) / 2) + epsilon
    return np.concatenate([middle - half, -(middle + half)], axis=1).astype(np.float32)


# BVHs, for as long as there are their geometries.
_topologies: MutableMapping[Geometry, Bvh] = WeakKeyDictionary()


def refit(before: Mesh, after: Mesh) -> None:
    """Have ``after``, the mesh ``before`` in another pose, share its BVHs, as far as they are packed: there is none to
    be built then, but rays through it take the longer the more is deformed."""
    for old, new in zip(before.parts, after.parts, strict=False):
        has_bvh, is_known = old.geometry in _topologies, new.geometry in _topologies
        if has_bvh and not is_known and len(new.geometry.triangles) == len(old.geometry.triangles):
            _topologies[new.geometry] = _topologies[old.geometry]


def _find_topologies(geometries: Iterable[Geometry]) -> None:
    """Have the BVHs of ``geometries`` in memory, from the disk if they were built before."""
    missing: dict[str, list[Geometry]] = {}
    for geometry in geometries:
        if geometry not in _topologies:
            missing.setdefault(geometry.digest, []).append(geometry)
    small = sorted(digest for digest, (first, *_) in missing.items() if len(first.triangles) < _SMALL)
    files = [[digest] for digest in missing]
    if len(small) > _FILES:
        files = [small, *([digest] for digest in missing.keys() - small)]
    for digests in files:
        for digest, bvh in zip(digests, _built([missing[digest][0] for digest in digests]), strict=True):
            for geometry in missing[digest]:
                _topologies[geometry] = bvh


def _built(geometries: Sequence[Geometry]) -> list[Bvh]:
    """The BVHs of geometries, from one file if they were built before."""

    def make() -> dict[str, NDArray[np.generic]]:
        found = []
        for geometry in geometries:
            positions = (geometry.positions - _middle(geometry)).astype(np.float32)
            found.append(build(triangle_bounds(positions[geometry.triangles])))
        children = np.concatenate([bvh.children for bvh in found])
        nodes, depth = (np.array(values) for values in zip(*((len(b.children), b.depth) for b in found), strict=True))
        return {"children": children, "nodes": nodes, "depth": depth}

    digests = [geometry.digest for geometry in geometries]
    arrays = cached("bvh", f"{_BVH_VERSION}-{content_digest(*digests)}", make, "building BVHs")
    ends = np.cumsum(arrays["nodes"])
    parts = np.split(arrays["children"], ends[:-1])
    return [Bvh(children, int(depth)) for children, depth in zip(parts, arrays["depth"], strict=True)]


def _size(geometry: Geometry) -> float:
    return float(np.ptp(geometry.bounds, axis=0).max())


def _middle(geometry: Geometry) -> Floats:
    middle: Floats = geometry.bounds.mean(axis=0)
    return middle


def triangle_bounds(corners: Texels) -> Texels:
    """Bounds (6, n) of triangles (n, 3, 3), as :mod:`fragtracer.bvh` wants them."""
    return np.concatenate([corners.min(axis=1).T, -corners.max(axis=1).T])
