# SPDX-License-Identifier: MIT
"""A uniform grid over many spheres of about one size, as shaders/shape/sphere_grid.glsl reads it."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh import build
from fragtracer.packing.records import Words
from fragtracer.packing.shapes import CULLED, GROWTH, SHAPE_RECORDS, STORED, Kind, Shapes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_LEAST = 32  # spheres
_MOST_BESIDE = 8  # shapes, which every ray is tested against
_LARGEST = 4.0  # radii of the median sphere
_MOST_STEPS = 3.0  # of those through a BVH, which take about so many times as long (docs/performance.md)
_MOST_ENTRIES = 2**20  # of all cells: 16 MB
_CELLS = 2.0 ** np.arange(2, 9)  # along the longest edge, as many as are tried, up to
_MOST_CELLS = 3.0  # times the root of the number of spheres, which is that of a square field,
_NEAR = 2.0 ** (np.array([-3, -2, -1, 1, 2, 3]) / 6)  # and then these times the best of them
_GROWTH = 8 * GROWTH  # of spheres, relative to the scene: rays know to that whether they are in a cell
_NOWHERE = 1e15  # where the sphere of an empty cell is


@dataclass(frozen=True, eq=False)
class SphereGrid:
    """The ``members`` (n,) of some shapes in a grid of ``size`` (3,) cells of ``cell`` (3,) metres from ``low`` (3,).

    ``texels`` (m, 4) are ``capacity`` entries for each cell, x fastest: the centre and radius of a sphere, the last of
    a cell with its radius negated; then, four in a texel, the place among the members of each entry.
    """

    members: Ints
    low: Floats
    cell: Floats
    size: Ints
    capacity: int
    texels: Words

    @property
    def usual_rounds(self) -> int:
        """How many steps few rays take more than."""
        return 2 * int(self.size.sum())

    def uniforms(self, first_record: int, first_texel: int) -> dict[str, Any]:
        """Where the records of the members begin with ``first_record``, and the texels with ``first_texel``."""
        return {
            "u_sphere_grid_low": tuple(self.low.tolist()),
            "u_sphere_grid_cell": tuple(self.cell.tolist()),
            "u_sphere_grid_size": tuple(self.size.tolist()),
            "u_sphere_grid_capacity": self.capacity,
            "u_first_grid_sphere": first_record,
            "u_first_sphere_grid": first_texel,
        }


NO_UNIFORMS = SphereGrid(
    np.zeros(0, np.int64), np.zeros(3), np.ones(3), np.ones(3, np.int64), 1, np.zeros((0, 4), np.uint32)
).uniforms(0, 0)


@lru_cache(maxsize=2)
def pack_sphere_grid(shapes: Shapes, extent: float) -> SphereGrid | None:
    """A grid over the spheres of ``shapes`` that are no lights and are met from both sides, but for a few much larger
    ones; None where they are few, too many shapes would be left, or a BVH is faster.

    ``extent`` is the half size of the scene, whose middle is the origin. The cells are those of which a ray through the
    grid meets the fewest entries, by their areas.
    """
    words = shapes.words
    values = words.view(np.float32).astype(np.float64)
    kinds, lights = words[:, 0, 3], words[:, 1, _word("light")]
    # The sign of a radius must not get lost.
    is_large = values[:, 1, 0] >= np.finfo(np.float32).tiny
    may_be = (kinds >> 24 == Kind.SPHERE) & (kinds & CULLED == 0) & (lights == STORED) & is_large
    if may_be.sum() < _LEAST:
        return None
    may_be &= values[:, 1, 0] <= _LARGEST * np.median(values[may_be, 1, 0])
    members = np.flatnonzero(may_be)
    if len(members) < _LEAST or len(shapes) - len(members) > _MOST_BESIDE:
        return None
    centers, radii = values[members, 0, :3], values[members, 1, 0]
    tried = [_cells(centers, radii, extent, n) for n in _CELLS if n <= _MOST_CELLS * np.sqrt(len(members))]
    best = min(filter(None, tried), key=lambda cells: cells.steps, default=None)
    if best is None:
        return None
    near = [_cells(centers, radii, extent, times * best.size.max()) for times in _NEAR]
    best = min([best, *filter(None, near)], key=lambda cells: cells.steps)
    if best.steps > _MOST_STEPS * _bvh_steps(shapes.bounds[:, members]):
        return None
    count, cell, member = best.count, best.cell, best.member
    capacity = int(count.max())
    slot = np.arange(len(cell)) - (np.cumsum(count) - count)[cell]
    entries = np.zeros((len(count), capacity, 4), np.float32)
    entries[..., :3] = _NOWHERE
    entries[cell, slot, :3] = centers[member]
    entries[cell, slot, 3] = np.where(slot == count[cell] - 1, -radii[member], radii[member])
    places = np.zeros(-(-len(count) * capacity // 4) * 4, np.uint32)
    places[cell * capacity + slot] = member
    texels = np.concatenate([entries.reshape(-1, 4).view(np.uint32), places.reshape(-1, 4)])
    return SphereGrid(members, best.low, best.edges, best.size, capacity, texels)


def _word(field: str) -> int:
    """The word of the second texel of a sphere's record."""
    return [name for name, _ in SHAPE_RECORDS["Sphere"]].index(field) - 2


def _area(edges: Floats) -> Floats:
    """Half of that of boxes with ``edges`` (..., 3)."""
    x, y, z = np.moveaxis(edges, -1, 0)
    return np.asarray(x * y + y * z + z * x)


@dataclass(frozen=True, eq=False)
class _Cells:
    """A grid of ``size`` (3,) cells with ``edges`` (3,) in metres from ``low`` (3,), and the spheres that touch them:
    pairs of a ``cell`` (m,) and a ``member`` (m,), by cells, of which each has ``count`` (cells,). A ray through the
    grid meets ``steps`` entries on average, if no sphere stops it."""

    low: Floats
    edges: Floats
    size: Ints
    cell: Ints
    member: Ints

    @cached_property
    def count(self) -> Ints:
        return np.bincount(self.cell, minlength=int(self.size.prod()))

    @cached_property
    def steps(self) -> float:
        return float(np.maximum(self.count, 1).sum() * _area(self.edges) / _area(self.edges * self.size))


def _cells(centers: Floats, radii: Floats, extent: float, longest: float) -> _Cells | None:
    """So many cells along the ``longest`` edge of the grid over spheres (n, 3), (n,); None where they hold too much."""
    reach = radii[:, None] + _GROWTH * extent
    low, high = (centers - reach).min(axis=0), (centers + reach).max(axis=0)
    size = np.maximum(1, np.rint((high - low) / (high - low).max() * longest)).astype(np.int64)
    edges = (high - low) / size
    first, last = (
        np.clip(np.floor((at - low) / edges).astype(np.int64), 0, size - 1) for at in (centers - reach, centers + reach)
    )
    spans = last - first + 1
    count = spans.prod(axis=1)
    if max(int(count.sum()), int(size.prod())) > _MOST_ENTRIES:
        return None
    member = np.repeat(np.arange(len(centers)), count)
    number = np.arange(len(member)) - np.repeat(np.cumsum(count) - count, count)
    x, rest = number % spans[member, 0], number // spans[member, 0]
    place = first[member] + np.stack([x, rest % spans[member, 1], rest // spans[member, 1]], axis=1)
    nearest = np.clip(centers[member], low + place * edges, low + (place + 1) * edges)
    touches = np.square(nearest - centers[member]).sum(axis=1) <= reach[member, 0] ** 2
    cell = ((place[:, 2] * size[1] + place[:, 1]) * size[0] + place[:, 0])[touches]
    order = np.argsort(cell, kind="stable")
    cells = _Cells(low, edges, size, cell[order], member[touches][order])
    return cells if int(cells.count.max()) * len(cells.count) <= _MOST_ENTRIES else None


def _bvh_steps(bounds: NDArray[np.float32]) -> float:
    """How many nodes and spheres a ray through a BVH over ``bounds`` (6, n) meets on average, by their areas."""
    bvh = build(bounds)
    children, root = bvh.child_bounds(bounds)
    found = children[bvh.is_there]
    edges = -(found[:, 3:] + found[:, :3]).astype(np.float64)
    return float(_area(edges).sum() / _area(-(root[3:] + root[:3]).astype(np.float64)))
