# SPDX-License-Identifier: MIT
"""The shapes that photons are sent to: all that may scatter narrowly or let light pass, as
shaders/integrator/target.glsl reads them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing import PackedScene, matte_names
from fragtracer.packing.alias import alias_table
from fragtracer.packing.hierarchy import rows_of
from fragtracer.packing.records import Record, Words, words_of
from fragtracer.packing.shapes import CULLED, STORED, Kind
from fragtracer.scene import Material, Scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TARGET: Record = (
    *(("threshold", "float"), ("other", "int"), ("record", "int"), ("instance", "int")),
    *(("density", "float"), ("cells", "uint"), ("cell", "int"), ("is_culled", "int")),
)
_WIDEST = 0.5  # GGX width of a lobe that may be narrow somewhere
_CELLS = (16, 8)  # into which shapes that are no triangles of meshes are divided
_MOST_DIVIDED = 512  # with more of them, none is
_PIECES = 16  # of all meshes together
_EVEN = 0.2  # of the photons are spread by area
_MOST = 2**21  # triangles that are targets: they take 400 MB, and some seconds to list


@dataclass(frozen=True, eq=False)
class Targets:
    """Shapes (n,), or parts of them, by the ``record`` of the shape, and that of its ``instance`` or -1, with their
    ``area`` in m^2. Where ``is_divided`` each is one ``cell`` of :data:`_CELLS`; ``is_culled`` says that only its front
    is met. The parts of a shape, and triangles of meshes that are near to each other, have a ``group`` in common. Of
    planes, which are infinite, it is what lies within ``reach`` metres of the point that is nearest to the origin."""

    reach: float
    record: Ints
    instance: Ints
    area: Floats
    is_culled: NDArray[np.bool_]
    is_divided: NDArray[np.bool_]
    cell: Ints
    group: Ints

    def __len__(self) -> int:
        return len(self.record)

    def taken(self, places: Ints) -> "Targets":
        """Those at some places."""
        return Targets(self.reach, *(column[places] for column in self.columns()))

    def columns(self) -> list[NDArray[Any]]:
        """What there is of each."""
        return [column for name, column in vars(self).items() if name != "reach"]

    def weights(self, squares: Floats | None = None) -> Floats:
        """In what proportion photons go to each target, (n,): by area, or so that what they bring has the least
        variance, where photons spread by area have brought ``squares`` (n,), the sum for each target."""
        area: Floats = self.area / self.area.sum()
        best = np.zeros(len(self)) if squares is None else np.sqrt(area * squares)
        if not best.any():
            return area
        weights: Floats = (1 - _EVEN) * best / best.sum() + _EVEN * area
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
            "cells": np.where(self.is_divided, _CELLS[1] << 16 | _CELLS[0], 1 << 16 | 1),
            "cell": self.cell,
            "is_culled": self.is_culled,
        }
        return words_of(TARGET, columns, len(self)).reshape(-1, 4)


def may_be_narrow(material: Material) -> bool:
    """Whether some part of a surface may scatter light narrowly (FOCUS in shaders/photons.frag)."""
    is_rough = material.alpha > _WIDEST and material.roughness_texture is None
    specular = max(*material.specular_f0, *material.specular_f90)
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
    targets = Targets(reach, *map(np.concatenate, zip(*(t.columns() for t in found), strict=True)))
    return _divided(_grouped(targets.taken(np.flatnonzero(targets.area > 0))))


def _grouped(targets: Targets) -> Targets:
    """A group for each shape, and for each piece of the meshes: in the order of their records, which is that of the
    BVH, neighbours follow each other."""
    is_shape = targets.is_divided
    group = np.cumsum(is_shape) - 1
    triangles = np.flatnonzero(~is_shape)
    in_order = triangles[np.lexsort((targets.record[triangles], targets.instance[triangles]))]
    group[in_order] = is_shape.sum() + np.arange(len(in_order)) * _PIECES // max(1, len(in_order))
    return replace(targets, group=group)


def _divided(targets: Targets) -> Targets:
    """Large shapes in parts, so that photons can go to those that throw light."""
    divided = np.flatnonzero(targets.is_divided)
    if len(divided) > _MOST_DIVIDED:
        return replace(targets, is_divided=np.zeros(len(targets), bool))
    cells = _CELLS[0] * _CELLS[1]
    times = np.where(targets.is_divided, cells, 1)
    parts = targets.taken(np.repeat(np.arange(len(targets)), times))
    cell = np.arange(len(parts)) - np.repeat(np.cumsum(times) - times, times)
    return replace(parts, area=parts.area / np.repeat(times, times), cell=cell)


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
    record, instance = [own], [np.full(len(own), -1)]
    area = [np.where(is_plane[own], np.pi * reach**2, _areas(words[own], of_kind[own]))]
    carrier = [own]
    for i in instances[np.isin(words[instances, 2, 3], materials)]:
        triangles = below[root[i]]
        matrix: Floats = np.linalg.inv(words[i, :3, :3].view(np.float32)).astype(np.float64)
        record.append(triangles)
        instance.append(np.full(len(triangles), i + first))
        area.append(_areas(words[triangles], of_kind[triangles], matrix))
        carrier.append(np.full(len(triangles), i))
    records, instances_of = np.concatenate(record), np.concatenate(instance)
    return Targets(
        reach,
        records + first,
        instances_of,
        np.concatenate(area),
        (kind[np.concatenate(carrier)] & CULLED) > 0,
        of_kind[records] != Kind.TRIANGLE,
        np.zeros(len(records), np.int64),
        np.zeros(len(records), np.int64),
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
