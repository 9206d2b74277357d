# SPDX-License-Identifier: MIT
"""The shapes that photons are sent to: all that may scatter narrowly, as shaders/integrator/target.glsl reads them."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing import PackedScene
from fragtracer.packing.alias import alias_table
from fragtracer.packing.hierarchy import RECORDS_IN_ROW
from fragtracer.packing.records import Record, Words, words_of
from fragtracer.packing.shapes import CULLED, Kind

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TARGET: Record = (
    *(("threshold", "float"), ("other", "int"), ("record", "int"), ("instance", "int")),
    *(("density", "float"), ("group", "int"), ("is_culled", "int")),
)


@dataclass(frozen=True, eq=False)
class Targets:
    """Shapes (n,) by their ``record``, and that of their ``instance`` or -1, with their ``area`` in m^2; ``group`` is
    the object that each is of, numbered from 0, and ``is_culled`` says that only its front is met."""

    record: Ints
    instance: Ints
    area: Floats
    group: Ints
    is_culled: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.record)

    @property
    def groups(self) -> int:
        """Number of objects."""
        return int(self.group.max()) + 1 if len(self) else 0

    def texels(self, share: Floats) -> Words:
        """The table (2 n, 4), where a photon goes to a group with the probability ``share`` (groups,), and there to
        a point by area."""
        probability = share[self.group] * self.area / np.bincount(self.group, self.area)[self.group]
        threshold, other = alias_table(probability / probability.sum())
        columns = {
            "threshold": threshold,
            "other": other,
            "record": self.record,
            "instance": self.instance + 1,
            "density": probability / probability.sum() / self.area,
            "group": self.group,
            "is_culled": self.is_culled,
        }
        return words_of(TARGET, columns, len(self)).reshape(-1, 4)


def targets_of(packed: PackedScene, materials: Iterable[int]) -> Targets:
    """The finite shapes of ``packed`` whose material is one of those numbers, without those that have no area."""
    found, first = [], 0
    parts = [part.reshape(-1, 4, 4) for part in packed.tables["u_shapes"]]
    for part in parts:
        found.append(_of_part(part, first, np.array(sorted(materials), np.int64)))
        first += -(-len(part) // RECORDS_IN_ROW) * RECORDS_IN_ROW
    targets = Targets(*(np.concatenate(columns) for columns in zip(*(vars(t).values() for t in found), strict=True)))
    there = np.flatnonzero(targets.area > 0)
    targets = Targets(*(column[there] for column in vars(targets).values()))
    return replace(targets, group=np.unique(targets.group, return_inverse=True)[1])


def _of_part(words: Words, first: int, materials: Ints) -> Targets:
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
    material = np.where(is_sphere, words[:, 1, 1], words[:, 1, 3]).astype(np.int64)
    own = np.flatnonzero((is_sphere | is_flat) & np.isin(material, materials))
    record, instance, area = [own], [np.full(len(own), -1)], [_areas(words[own], of_kind[own])]
    carrier = [own]
    for i in instances[np.isin(words[instances, 2, 3], materials)]:
        triangles = below[root[i]]
        matrix: Floats = np.linalg.inv(words[i, :3, :3].view(np.float32)).astype(np.float64)
        record.append(triangles)
        instance.append(np.full(len(triangles), i + first))
        area.append(_areas(words[triangles], of_kind[triangles], matrix))
        carrier.append(np.full(len(triangles), i))
    flags = kind[np.concatenate(carrier)]
    return Targets(
        np.concatenate(record) + first,
        np.concatenate(instance),
        np.concatenate(area),
        (flags & 0xFFFFFF) >> 1,
        (flags & CULLED) > 0,
    )


def _areas(words: Words, kinds: Ints, matrix: Floats | None = None) -> Floats:
    """Of records (n, 4, 4), in m^2; of triangles that ``matrix`` (3, 3) takes to the scene there."""
    a, b, c = (words[:, texel, :3].view(np.float32).astype(np.float64) for texel in range(3))
    u, v = b - a, c - a
    if matrix is not None:
        u, v = u @ matrix.T, v @ matrix.T
    parallelogram = np.linalg.norm(np.cross(u, v), axis=1)
    factor = np.select([kinds == Kind.RECTANGLE, kinds == Kind.DISK], [1.0, np.pi], 0.5)
    radius = words[:, 1, 0].view(np.float32).astype(np.float64)
    return np.where(kinds == Kind.SPHERE, 4 * np.pi * radius**2, factor * parallelogram)


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
