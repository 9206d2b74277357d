# SPDX-License-Identifier: MIT
"""Lobes fitted to photons in the cells of two nested grids, as shaders/guiding/lobes.glsl reads them."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fragtracer.guiding.photons import Photons

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LOBES = 4  # of a cell, GUIDING_LOBES of the shader
_COARSE = 24  # cells along the longest edge of the grid
_EDGES = (1, 2, 4, 8, 16)  # cells along an edge of a coarse one
_PHOTONS = 25  # that a fine cell should have, where a surface passes through it
_LEAST = 3  # of a lobe
_INHERITED = 0.3  # of the flux of the coarse cell goes to a fine one that has no photons for a lobe
_AT_ONCE = 1 << 20  # distances between cells, which bounds the memory
_OUTLIERS = 0.05  # of the flux at either end of each axis, which the grid leaves out
_GAIN = 3.0  # by which a lobe counts more than the same irradiance from all around: it has more of the variance
_LEAST_OTHER = 1e-9  # of the irradiance of the brightest lobe is from all around, so that its ratio is a float32


@dataclass(frozen=True)
class Lobes:
    """``points`` (cells, LOBES, 3) that lobes aim at, their ``widths`` there in metres and their ``ratios``
    (cells, LOBES), in the cells of a grid of ``size`` (3,) coarse cells of ``edge`` metres from ``low`` (3,) on.
    ``first`` and ``edges`` (coarse cells,) are the first fine cell of each, and their number along an edge, or 0."""

    low: Floats
    edge: float
    size: Ints
    first: Ints
    edges: Ints
    points: Floats
    widths: Floats
    ratios: Floats


def fit(photons: Photons) -> Lobes | None:
    """Lobes of ``photons``, or None where they are too few for any."""
    receiver, source = np.ascontiguousarray(photons.receiver.T), np.ascontiguousarray(photons.source.T)
    low, edge, size = _grid(receiver, photons.flux)
    place = np.clip((receiver - low[:, None]) / edge, 0, size[:, None] - 1e-6)
    index = np.floor(place).astype(np.int64)
    coarse = (index[2] * size[1] + index[1]) * size[0] + index[0]
    total = int(size.prod())
    count = np.bincount(coarse, minlength=total)
    edges = np.select([count >= _PHOTONS * e * e for e in _EDGES[::-1]], _EDGES[::-1], 1)
    first = np.cumsum(edges**3) - edges**3
    own = edges[coarse]
    fine = np.floor((place - index) * own).astype(np.int64)
    cell = first[coarse] + (fine[2] * own + fine[1]) * own + fine[0]
    parent = np.repeat(np.arange(total), edges**3)

    direction = source - receiver
    direction /= np.sqrt(np.square(direction).sum(axis=0))
    vectors = receiver, source, direction
    with ThreadPoolExecutor(2) as threads:
        levels = (coarse, total), (cell, len(parent))
        made = [threads.submit(_lobes_of, vectors, photons.group, photons.flux, *cells) for cells in levels]
        above, (points, widths, flux) = (m.result() for m in made)
    there = np.flatnonzero(above[2].any(axis=1))
    if not len(there):
        return None
    middle = np.stack(np.unravel_index(np.arange(total), size[::-1])[::-1], axis=1)
    nearest = there[_nearest(middle, middle[there])]
    parent_flux = (above[2] / edges[:, None] ** 2)[nearest[parent]]
    # What a cell has no photons for, it takes from the coarse cell.
    lacks = flux <= 0
    order = np.argsort(lacks, axis=1, kind="stable")
    points, widths, flux = (
        np.take_along_axis(v, order.reshape(*order.shape, *(1,) * (v.ndim - 2)), 1) for v in (points, widths, flux)
    )
    have = (flux > 0).sum(axis=1)
    for k in range(LOBES):
        source = k - have
        takes = source >= 0
        rows, cols = nearest[parent][takes], source[takes]
        points[takes, k], widths[takes, k] = above[0][rows, cols], above[1][rows, cols]
        flux[takes, k] = _INHERITED * parent_flux[takes, cols]
    irradiance = flux / ((edge / edges) ** 2)[parent][:, None]
    indirect = np.minimum(photons.indirect, np.quantile(photons.indirect, 0.95))
    mean = np.bincount(coarse, indirect, total) / np.maximum(count, 1)
    other = (mean + 0.05 * indirect.mean())[nearest[parent]][:, None]
    least = np.maximum(_LEAST_OTHER * irradiance.max(axis=1, keepdims=True), np.finfo(np.float64).tiny)
    ratios = _GAIN * irradiance / np.maximum(other, least)
    return Lobes(low, edge, size, first, edges, points, widths, ratios)


def _lobes_of(
    vectors: Sequence[Floats], group: Ints, flux: Floats, cell: Ints, cells: int
) -> tuple[Floats, Floats, Floats]:
    """Points (cells, LOBES, 3), widths and flux (cells, LOBES) of the lobes of photons, whose receivers, sources and
    directions (3, n), groups, flux and cells (n,) are given."""
    order, found, first = _by_lobe(cell, group, flux)
    receiver, source, direction = (np.take(v, order, axis=1) for v in vectors)
    flux = np.take(flux, order)
    points, widths, brought = np.zeros((cells * LOBES, 3)), np.zeros(cells * LOBES), np.zeros(cells * LOBES)
    aims = _points(receiver, source, direction, flux, first)
    points[found] = aims.T
    widths[found] = _widths(receiver, direction, flux, aims, first)
    brought[found] = np.where(_counts(first, len(order)) < _LEAST, 0, np.add.reduceat(flux, first))
    return points.reshape(cells, LOBES, 3), widths.reshape(cells, LOBES), brought.reshape(cells, LOBES)


def _grid(receiver: Floats, flux: Floats) -> tuple[Floats, float, Ints]:
    """Lower corner, edge of a coarse cell and number of cells, of receivers (3, n)."""
    low, high = np.empty(3), np.empty(3)
    for axis, values in enumerate(receiver):
        order, _ = _sorted(_bits(values - values.min()))
        share = np.cumsum(np.take(flux, order))
        ends = np.searchsorted(share, share[-1] * np.array([_OUTLIERS, 1 - _OUTLIERS]))
        low[axis], high[axis] = values[order[ends]]
    edge = max(float((high - low).max()), 1e-30) / (_COARSE - 1)
    size = np.floor((high - low) / edge).astype(np.int64) + 1
    return (low + high - size * edge) / 2, edge, size


def _by_lobe(cell: Ints, group: Ints, flux: Floats) -> tuple[Ints, Ints, Ints]:
    """Photons (n,) in the order of lobes, which lobes have any, and the place (lobes,) of the first photon of each: one
    lobe for each of the groups of a cell that bring most flux, the last for all others."""
    groups = int(group.max()) + 1
    order, pair = _sorted(cell * groups + group)
    first = _firsts(pair)
    count, cells = _counts(first, len(order)), pair[first] // groups
    by_flux = np.lexsort((-np.add.reduceat(flux[order], first), cells))
    rank = np.empty(len(first), np.int64)
    rank[by_flux] = np.arange(len(first)) - np.searchsorted(cells, cells)
    lobe = cells * LOBES + np.minimum(rank, LOBES - 1)
    # The runs of photons of a cell and group, in the order of the lobes.
    runs = np.argsort(lobe, kind="stable")
    lobe, count = lobe[runs], count[runs]
    start = np.cumsum(count) - count
    order = order[np.repeat(first[runs] - start, count) + np.arange(len(order))]
    of_lobe = _firsts(lobe)
    return order, lobe[of_lobe], start[of_lobe]


def _sorted(keys: Ints) -> tuple[Ints, Ints]:
    """The order of ``keys`` (n,), of at most 42 bits where there are 2^20, and the keys in it; equal ones stay in their
    order. To sort keys with their places in the lowest bits is several times as fast as ``argsort``."""
    bits = len(keys).bit_length()
    both = np.sort(keys << bits | np.arange(len(keys)))
    return both & ((1 << bits) - 1), both >> bits


def _nearest(points: Ints, others: Ints) -> Ints:
    """Which of ``others`` (m, 3) is nearest to each of ``points`` (n, 3)."""
    squares = np.square(others).sum(axis=1)
    parts = np.array_split(points, -(-len(points) * len(others) // _AT_ONCE))
    return np.concatenate([(squares - 2 * part @ others.T).argmin(axis=1) for part in parts])


def _bits(values: Floats) -> Ints:
    """Of ``values`` that are not negative, as float32: they have the same order."""
    return values.astype(np.float32).view(np.uint32).astype(np.int64)


def _firsts(values: Ints) -> Ints:
    """The places where a run of equal ``values`` begins."""
    return np.flatnonzero(np.diff(values, prepend=values[0] - 1))


def _counts(first: Ints, total: int) -> Ints:
    """How many there are in each of the runs that begin at these places."""
    return np.diff(first, append=total)


def _points(receiver: Floats, source: Floats, direction: Floats, flux: Floats, first: Ints) -> Floats:
    """The point (3, lobes) that the photons of each lobe seem to come from: least squares of the angles, which the last
    estimate of the distance weighs; drawn a little to the mean of the sources, and no nearer to the receivers than a
    fifth of the way. Vectors are (3, n), in the order of the lobes."""

    def sums(values: Floats) -> Floats:
        return np.add.reduceat(values, first, axis=-1)

    count = _counts(first, len(flux))
    total = np.maximum(sums(flux), 1e-30)
    mean, middle = sums(flux * source) / total, sums(flux * receiver) / total
    across = receiver - (direction * receiver).sum(axis=0) * direction
    points = mean
    for _ in range(2):
        weight = flux / np.maximum(np.square(np.repeat(points, count, axis=1) - receiver).sum(axis=0), 1e-12)
        weights, right = sums(weight), sums(weight * across)
        normal = np.empty((len(first), 3, 3))
        for i in range(3):
            weighted = weight * direction[i]
            for j in range(i, 3):
                normal[:, i, j] = normal[:, j, i] = float(i == j) * weights - sums(weighted * direction[j])
        hold = 3e-2 * weights + 1e-30
        held = (right + hold * mean).T[..., None]
        points = np.asarray(np.linalg.solve(normal + hold[:, None, None] * np.eye(3), held)[..., 0], np.float64).T
        off = points - mean
        most = 0.8 * np.linalg.norm(mean - middle, axis=0)
        points = mean + off * np.minimum(1, most / np.maximum(np.linalg.norm(off, axis=0), 1e-30))
    return points


def _widths(receiver: Floats, direction: Floats, flux: Floats, points: Floats, first: Ints) -> Floats:
    """Half of the flux of each lobe passes its point within this distance, which is how GGX's alpha is defined."""
    count = _counts(first, len(flux))
    to_point = np.repeat(points, count, axis=1) - receiver
    distance = np.sqrt(np.square(to_point).sum(axis=0))
    cosine = (to_point * direction).sum(axis=0) / np.maximum(distance, 1e-30)
    off = np.sqrt(np.maximum(0, 1 - cosine**2)) / np.maximum(cosine, 0.05) * distance
    order, _ = _sorted(np.repeat(np.arange(len(first)), count) << 23 | _bits(off) >> 8)  # by lobe, then by distance
    share = np.cumsum(flux[order])
    total = np.add.reduceat(flux, first)
    before = np.cumsum(total) - total
    middle = np.minimum(np.searchsorted(share, before + total / 2), len(off) - 1)
    widths: Floats = off[order[middle]]
    return widths
