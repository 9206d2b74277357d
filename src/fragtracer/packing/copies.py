# SPDX-License-Identifier: MIT
"""Geometries at their places, each with its tree of boxes around it.

Each geometry has a tree of its own, kept on disk, which is fitted to where the geometry stands. One whose copies would
take much memory is there once, in its own space, and met through a matrix.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh import Bvh, Layout, build
from fragtracer.cache import cached
from fragtracer.scene import Geometry, Mesh

Floats = NDArray[np.float64]
Texels = NDArray[np.float32]

_BVH_VERSION = 6  # of fragtracer.bvh, for the files it leaves on disk
_TREES_KEPT = 64  # in memory
# Copies of a geometry are packed one by one while they add fewer triangles than this: rays then need no matrix.
MOST_COPIED = 100_000
# Copies through whose matrices boxes would grow by more than this, relative to the mesh, do not share a tree.
_MOST_BLUR = 1e-3


@dataclass(frozen=True)
class MeshMaterial:
    """What of a material decides how its triangles are packed."""

    index: int
    power: float  # emission, summed over the channels
    flags: int


@dataclass(frozen=True, eq=False)
class Copy:
    """A geometry at one of its places."""

    geometry: Geometry
    material: MeshMaterial
    matrix: Floats  # (3, 4), to the space of the shader

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
class Fitted:
    """A copy with its tree around it."""

    copy: Copy
    bvh: Bvh
    layout: Layout
    corners: Texels  # (n, 3, 3)
    child_boxes: Texels
    box: Texels  # (6,)


@dataclass(frozen=True, eq=False)
class Instance:
    """A copy that is a record with the way to a tree that it shares."""

    copy: Copy
    tree: Fitted
    box: Texels


def copies_of(meshes: Sequence[Mesh], materials: Mapping[str, MeshMaterial], origin: Floats) -> list[Copy]:
    """Every part of ``meshes`` at every place, (0, 0, 0) at ``origin`` (3,)."""
    copies = []
    for mesh in meshes:
        for matrix, part in mesh.placed():
            matrix[:3, 3] -= origin
            copies.append(Copy(part.geometry, materials[mesh.material_of(part)], matrix[:3]))
    return copies


def fit(copies: Sequence[Copy], growth: float) -> tuple[list[Fitted], list[Fitted | Instance]]:
    """The trees that are shared, and all copies in their order; boxes grow by so much."""
    blurs: dict[Geometry, list[float]] = {}
    for copy in copies:
        if (blur := _blur(copy, growth)) < np.inf:
            blurs.setdefault(copy.geometry, []).append(blur)
    trees = {
        geometry: _fitted(_in_own_space(geometry), max(found))
        for geometry, found in blurs.items()
        if (len(found) - 1) * len(geometry.triangles) > MOST_COPIED
    }
    placed: list[Fitted | Instance] = []
    for copy in copies:
        tree = trees.get(copy.geometry)
        if tree is not None and _blur(copy, growth) < np.inf:
            placed.append(Instance(copy, tree, _instance_box(copy, tree.box, growth)))
        else:
            placed.append(_fitted(copy, growth))
    return list(trees.values()), placed


def _blur(copy: Copy, growth: float) -> float:
    """By how much boxes have to grow, in units of its geometry, for rays that come through the copy's matrix.

    Infinite for a copy that needs triangles of its own: one that emits, since lights are drawn by triangle, each
    with its area; and one so small or flat that its boxes would overlap.
    """
    least = float(np.linalg.norm(copy.matrix[:, :3], -2))  # what a unit shrinks to at most
    blur = growth / least if least > 0 else np.inf
    size = float(np.ptp(copy.geometry.bounds, axis=0).max())
    return np.inf if copy.material.power or blur > _MOST_BLUR * size else blur


def _in_own_space(geometry: Geometry) -> Copy:
    """The geometry for all its copies to share, its middle in the origin; materials are theirs."""
    nothing = MeshMaterial(0, 0.0, 0)
    return Copy(geometry, nothing, np.column_stack([np.eye(3), -_middle(geometry)]))


def _fitted(copy: Copy, growth: float) -> Fitted:
    """A copy and its tree, boxes grown by so much."""
    bvh = _tree(copy.geometry)
    positions = (copy.geometry.positions @ copy.matrix[:, :3].T + copy.matrix[:, 3]).astype(np.float32)
    corners = positions[copy.triangles]
    boxes, box = bvh.child_boxes(triangle_boxes(corners))
    return Fitted(copy, bvh, bvh.layout(), corners, boxes - np.float32(growth), box - np.float32(growth))


def _instance_box(copy: Copy, box: Texels, growth: float) -> Texels:
    """The box (6,) of a copy whose triangles have ``box`` in their own space."""
    low, high = box[:3].astype(np.float64), -box[3:].astype(np.float64)
    linear = copy.matrix[:, :3]
    middle, half = linear @ ((low + high) / 2) + copy.middle, np.abs(linear) @ ((high - low) / 2) + growth
    return np.concatenate([middle - half, -(middle + half)]).astype(np.float32)


@lru_cache(maxsize=_TREES_KEPT)
def _tree(geometry: Geometry) -> Bvh:
    """The tree of a geometry, from the disk if it was built before."""

    def make() -> dict[str, NDArray[np.generic]]:
        positions = (geometry.positions - _middle(geometry)).astype(np.float32)
        bvh = build(triangle_boxes(positions[geometry.triangles]))
        return {"children": bvh.children, "depth": np.array(bvh.depth)}

    arrays = cached("bvh", f"{_BVH_VERSION}-{geometry.digest}", make)
    return Bvh(arrays["children"], int(arrays["depth"]))


def _middle(geometry: Geometry) -> Floats:
    middle: Floats = geometry.bounds.mean(axis=0)
    return middle


def triangle_boxes(corners: Texels) -> Texels:
    """Boxes (6, n) of triangles (n, 3, 3), as :mod:`fragtracer.bvh` wants them."""
    return np.concatenate([corners.min(axis=1).T, -corners.max(axis=1).T])
