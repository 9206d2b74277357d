# SPDX-License-Identifier: MIT
"""The shapes that photons are sent to: all that may scatter narrowly or let light pass, as
shaders/integrator/target.glsl reads them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing import PackedScene, matte_names
from fragtracer.packing.alias import alias_table
from fragtracer.packing.hierarchy import rows_of
from fragtracer.packing.records import Record, Words, words_of
from fragtracer.packing.shapes import CULLED, STORED, Kind
from fragtracer.packing.space import boxes_of
from fragtracer.scene import Material, Scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TARGET: Record = (
    *(("threshold", "float"), ("other", "int"), ("record", "int"), ("instance", "int")),
    *(("density", "float"), ("cells", "uint"), ("cell", "int"), ("is_culled", "int")),
)
_WIDEST = 0.5  # GGX width of a lobe that may be narrow somewhere
_CELLS = (16, 8)  # into which shapes that are no triangles of meshes are divided, columns and rows
_MOST_DIVIDED = 512  # with more of them, none is
_FAR_LARGER = 8.0  # times the extent of all that is smaller: such shapes are a ground or a wall behind that
_LEAST_NEAR = 0.2  # of all shapes and parts of meshes that is: fewer may be a speck on what it is about
_FINEST = 0.25  # of the distance from what is near, or of its radius: parts of targets are no larger
_MOST_CELLS = 2**15  # along an edge: the shader has 16 bits for their number
_MOST_PARTS = 2**18  # of all targets together, until which they are divided
_PIECES = 16  # of all meshes together
_EVEN = 0.2  # of the photons are spread by area
_MOST = 2**21  # triangles that are targets: to list them takes 500 MB and some seconds


@dataclass(frozen=True, eq=False)
class Near:
    """A ball around what there is besides grounds and walls that are far larger than it, about the origin of the
    packing, in metres."""

    middle: Floats
    radius: float

    @staticmethod
    def of(scene: Scene, origin: Floats) -> "Near":
        """All smaller things of ``scene``, if they are a fifth at least, than one that is larger than all these
        together; else all that is finite. What has no size is no thing."""
        low, high = boxes_of(scene)
        size = np.linalg.norm(high - low, axis=1)
        order = np.argsort(size, kind="stable")[np.count_nonzero(size == 0) :]
        if not len(order):
            return Near(origin, math.inf)
        low, high = np.minimum.accumulate(low[order]), np.maximum.accumulate(high[order])
        extent = np.linalg.norm(high - low, axis=1)
        is_far_larger = size[order][1:] > _FAR_LARGER * extent[:-1]
        are_enough = np.arange(1, len(order)) >= _LEAST_NEAR * len(order)
        larger = np.flatnonzero(is_far_larger & are_enough)
        last = larger[0] if len(larger) else -1
        return Near((low[last] + high[last]) / 2 - origin, float(extent[last]) / 2)

    def share(self, distance: Floats) -> Floats:
        """Of their area that targets are worth at a ``distance`` from the middle, (n,)."""
        return np.asarray(np.minimum(1, self.radius / np.maximum(distance, 1e-300)) ** 2)


@dataclass(frozen=True, eq=False)
class Targets:
    """Shapes (n,), or parts of them, by the ``record`` of the shape, and that of its ``instance`` or -1, with their
    ``area`` in m^2. Each is one ``cell`` (n, 2) of so many columns and rows of ``cells`` (n, 2); ``is_culled`` says
    that only its front is met. The parts of a shape, and triangles of meshes that are near to each other, have a
    ``group`` in common. A ``kind`` of shape has its place by ``corners`` (n, 3, 3), the first three texels of its
    record about the origin of the packing. ``worth`` is the area, or less far away from what is near. Of planes, which
    are infinite, it is what lies within ``reach`` metres of the point that is nearest to the origin."""

    reach: float
    record: Ints
    instance: Ints
    area: Floats
    worth: Floats
    is_culled: NDArray[np.bool_]
    cells: Ints
    cell: Ints
    group: Ints
    kind: Ints
    corners: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.record)

    @staticmethod
    def joined(some: "Sequence[Targets]") -> "Targets":
        """All of some, with the same reach."""
        return Targets(some[0].reach, *map(np.concatenate, zip(*(t.columns() for t in some), strict=True)))

    def taken(self, places: Ints) -> "Targets":
        """Those at some places."""
        return Targets(self.reach, *(column[places] for column in self.columns()))

    def columns(self) -> list[NDArray[Any]]:
        """What there is of each."""
        return [column for name, column in vars(self).items() if name != "reach"]

    def weights(self, squares: Floats | None = None) -> Floats:
        """In what proportion photons go to each target, (n,): by what it is worth, or so that what they bring has the
        least variance, where photons spread by that have brought ``squares`` (n,), the sum for each target."""
        even: Floats = self.worth / self.worth.sum()
        best = np.zeros(len(self)) if squares is None else np.sqrt(even * squares)
        if not best.any():
            return even
        weights: Floats = (1 - _EVEN) * best / best.sum() + _EVEN * even
        return weights

    def texels(self, weights: Floats) -> Words:
        """The table (2 n, 4), where photons go to each target in proportion to its weight, (n,), all above 0."""
        probability = weights / weights.sum()
        threshold, other = alias_table(probability)
        columns = {
            "threshold": threshold,
            "other": other,
            "record": self.record,
            "instance": self.instance + 1,
            "density": probability / self.area,
            "cells": self.cells[:, 1] << 16 | self.cells[:, 0],
            "cell": self.cell[:, 1] * self.cells[:, 0] + self.cell[:, 0],
            "is_culled": self.is_culled,
        }
        return words_of(TARGET, columns, len(self)).reshape(-1, 4)

    def points(self, x: float, y: float) -> Floats:
        """One of each, (n, 3), about the origin of the packing, by coordinates from 0 to 1 within its cell, as
        shaders/integrator/target.glsl places them; of planes the middle of all of it."""
        u = (self.cell + np.array((x, y))) / self.cells
        a, b, c = self.corners.astype(np.float64).swapaxes(0, 1)
        turns = 2 * np.pi * u[:, :1]
        circle = np.concatenate([np.cos(turns), np.sin(turns)], axis=1)
        by_kind = self.kind[:, None]
        folded = np.where(u[:, 1:] > u[:, :1], u @ [[0.5, -0.5], [0, 1]], u @ [[1, 0], [-0.5, 0.5]])
        place = np.select([by_kind == Kind.RECTANGLE, by_kind == Kind.DISK], [u, np.sqrt(u[:, 1:]) * circle], folded)
        flat = a + place[:, :1] * (b - a) + place[:, 1:] * (c - a)
        z = 1 - 2 * u[:, 1:]
        sphere = a + b[:, :1] * np.concatenate([np.sqrt(np.maximum(0, 1 - z**2)) * circle, z], axis=1)
        return np.select([by_kind == Kind.SPHERE, by_kind == Kind.PLANE], [sphere, b[:, :1] * a], flat)


def may_be_narrow(material: Material) -> bool:
    """Whether some part of a surface may scatter light narrowly (FOCUS in shaders/photons.frag)."""
    is_rough = material.alpha > _WIDEST and material.roughness_texture is None
    specular = max(*material.specular_f0, *material.specular_f90, float(material.has_iridescence))
    if material.metallic_texture is not None:
        specular = max(specular, material.specular)
    has_narrow_coat = material.is_coated and (
        material.coat_alpha <= _WIDEST or material.coat_roughness_texture is not None
    )
    return not material.unlit and ((specular > 0 and not is_rough) or has_narrow_coat)


def _is_target(material: Material) -> bool:
    """Whether light may be traced from a surface: it also is from a dielectric that reflects nothing."""
    return may_be_narrow(material) or (material.is_dielectric and material.model != "null")


def too_many(scene: Scene) -> str:
    """Why :func:`targets_of` ``scene`` would be too many; empty if they are not."""
    targets = target_names(scene)
    parts = ((mesh, part) for mesh in scene.meshes for part in mesh.parts)
    count = sum(
        len(part.geometry.triangles) * len(mesh.instances)
        for mesh, part in parts
        if not targets.isdisjoint(scene.blended(mesh.material_of(part)))
    )
    return f"{count} triangles may scatter light narrowly, more than {_MOST}" if count > _MOST else ""


def target_names(scene: Scene) -> set[str]:
    """The names of the materials from which light may be traced."""
    return {name for name, material in scene.materials.items() if _is_target(material)}


def targets_of(packed: PackedScene, scene: Scene, reach: float = 0.0) -> Targets:
    """The shapes of ``scene``, as it is ``packed``, from which light may be traced, without those that have no area;
    planes as far as they ``reach``, in metres."""
    names = target_names(scene)
    numbered = enumerate(matte_names(scene)[1])
    materials = [i for i, name in numbered if name in scene.materials and not names.isdisjoint(scene.blended(name))]
    found, first = [], 0
    parts = [part.reshape(-1, 4, 4) for part in packed.tables["u_shapes"]] or [np.zeros((0, 4, 4), np.uint32)]
    for part in parts:
        found.append(_of_part(part, first, np.array(materials, np.int64), reach))
        first += rows_of(len(part))
    targets = Targets.joined(found)
    divided = _divided(_grouped(targets.taken(np.flatnonzero(targets.area > 0))))
    return _refined(divided, Near.of(scene, packed.origin)) if len(divided) else divided


def _grouped(targets: Targets) -> Targets:
    """A group for each shape, and for each piece of the meshes: in the order of their records, which is that of the
    BVH, neighbours follow each other."""
    is_shape = targets.kind != Kind.TRIANGLE
    group = np.cumsum(is_shape) - 1
    triangles = np.flatnonzero(~is_shape)
    in_order = triangles[np.lexsort((targets.record[triangles], targets.instance[triangles]))]
    group[in_order] = is_shape.sum() + np.arange(len(in_order)) * _PIECES // max(1, len(in_order))
    return replace(targets, group=group)


def _divided(targets: Targets) -> Targets:
    """Large shapes in parts, so that photons can go to those that throw light."""
    is_shape = targets.kind != Kind.TRIANGLE
    if not 0 < is_shape.sum() <= _MOST_DIVIDED:
        return targets
    cells = _CELLS[0] * _CELLS[1]
    times = np.where(is_shape, cells, 1)
    parts = targets.taken(np.repeat(np.arange(len(targets)), times))
    cell = np.arange(len(parts)) - np.repeat(np.cumsum(times) - times, times)
    rows, columns = np.divmod(cell, _CELLS[0])
    counts = np.where(np.repeat(is_shape, times)[:, None], _CELLS, 1)
    return replace(
        parts, area=parts.area / np.repeat(times, times), cell=np.stack([columns, rows], axis=1), cells=counts
    )


def _refined(targets: Targets, near: Near) -> Targets:
    """Parts that are large for their distance from what is ``near`` in halves, again and again; photons go to far ones
    by the inverse square of the distance."""
    edges = np.linalg.norm(targets.corners[:, 1:] - targets.corners[:, :1], axis=2).max(axis=1)
    may_be_large = (targets.kind != Kind.TRIANGLE) | (edges > _FINEST * near.radius)
    rest = targets.taken(np.flatnonzero(~may_be_large))
    distance = np.linalg.norm(rest.corners.mean(axis=1) - near.middle, axis=1)
    done = [replace(rest, worth=rest.area * near.share(distance))]
    left, count = targets.taken(np.flatnonzero(may_be_large)), len(targets)
    while len(left):
        middle = left.points(0.5, 0.5)
        sides = [
            sum(np.linalg.norm(left.points(*end) - middle, axis=1) for end in ends)
            for ends in (((0, 0.5), (1, 0.5)), ((0.5, 0), (0.5, 1)))
        ]
        size = np.hypot(*sides) / 2
        distance = np.linalg.norm(middle - near.middle, axis=1)
        is_large = size > _FINEST * np.maximum(near.radius, distance - size)
        along = np.eye(2, dtype=np.int64)[np.argmax(sides, axis=0)]
        is_split = is_large & (left.kind != Kind.PLANE) & ((left.cells * along).max(axis=1) < _MOST_CELLS)
        is_split &= count + is_split.sum() <= _MOST_PARTS
        share = np.where(left.kind == Kind.PLANE, 1, near.share(distance))
        done.append(replace(left, worth=left.area * share).taken(np.flatnonzero(~is_split)))
        left, along = left.taken(np.repeat(np.flatnonzero(is_split), 2)), np.repeat(along[is_split], 2, axis=0)
        second = along * (np.arange(len(left)) % 2)[:, None]
        left = replace(left, area=left.area / 2, cells=left.cells * (1 + along), cell=left.cell * (1 + along) + second)
        count += len(left) // 2
    return Targets.joined(done)


def _of_part(words: Words, first: int, materials: Ints, reach: float) -> Targets:
    """Of records (n, 4, 4) that are numbered from ``first`` on; shapes of instances are in the same part."""
    kind = words[:, 0, 3].astype(np.int64)
    of_kind = kind >> 24
    root = words[:, 1, 3].astype(np.int64) - first
    instances = np.flatnonzero(of_kind == Kind.INSTANCE)
    local = np.zeros(len(words), bool)  # whether it is a record of a BLAS that instances share
    below = {}
    for i in np.unique(root[instances]):
        below[i] = _triangles_below(words, int(i), first)
        local[below[i]] = True

    is_sphere = (of_kind == Kind.SPHERE) & ~local
    is_flat = ((of_kind == Kind.TRIANGLE) | (of_kind >= Kind.RECTANGLE)) & ~local
    is_plane = (of_kind == Kind.PLANE) & (np.abs(words[:, 1, 0].view(np.float32)) < reach)
    material = np.where(is_flat, words[:, 1, 3].astype(np.int64), words[:, 1, 1].astype(np.int64) - STORED)
    own = np.flatnonzero((is_sphere | is_flat | is_plane) & np.isin(material, materials))
    record, instance, corners = [own], [np.full(len(own), -1)], [_corners(words[own])]
    carrier = [own]
    for i in instances[np.isin(words[instances, 2, 3], materials)]:
        triangles = below[root[i]]
        matrix: Floats = np.linalg.inv(words[i, :3, :3].view(np.float32)).astype(np.float64)
        record.append(triangles)
        instance.append(np.full(len(triangles), i + first))
        placed = _corners(words[triangles]) @ matrix.T + words[i, 3, :3].view(np.float32)
        corners.append(placed.astype(np.float32))
        carrier.append(np.full(len(triangles), i))
    records, all_corners = np.concatenate(record), np.concatenate(corners)
    area = _areas(all_corners, of_kind[records], reach)
    return Targets(
        reach,
        records + first,
        np.concatenate(instance),
        area,
        area,
        (kind[np.concatenate(carrier)] & CULLED) > 0,
        np.ones((len(records), 2), np.int32),
        np.zeros((len(records), 2), np.int32),
        np.zeros(len(records), np.int64),
        of_kind[records].astype(np.uint8),
        all_corners,
    )


def _corners(words: Words) -> NDArray[np.float32]:
    """What records (n, 4, 4) have as corners, (n, 3, 3)."""
    return np.ascontiguousarray(words[:, :3, :3]).view(np.float32)


def _areas(corners: NDArray[np.float32], kinds: Ints, reach: float) -> Floats:
    """In m^2, by what records (n, 3, 3) have as corners; of planes as far as they ``reach``."""
    u, v = (np.subtract(corners[:, i], corners[:, 0], dtype=np.float64) for i in (1, 2))
    parallelogram = np.linalg.norm(np.cross(u, v), axis=1)
    ball = 4 * np.pi * np.square(corners[:, 1, 0], dtype=np.float64)
    is_kind = [kinds == kind for kind in (Kind.PLANE, Kind.SPHERE, Kind.RECTANGLE, Kind.DISK)]
    return np.select(is_kind, [np.pi * reach**2, ball, parallelogram, np.pi * parallelogram], parallelogram / 2)


def _triangles_below(words: Words, root: int, first: int) -> Ints:
    """The records of the triangles below the node ``root``, or it alone."""
    found, level = [], np.array([root])
    while level.size:
        is_node = words[level, 0, 3] >> 24 == Kind.NODE
        found.append(level[~is_node])
        nodes = level[is_node]
        begin = words[nodes, 2, 2].astype(np.int64) - first
        count = words[nodes, 2, 3].astype(np.int64)
        level = np.repeat(begin - (np.cumsum(count) - count), count) + np.arange(count.sum())
    return np.concatenate(found)
