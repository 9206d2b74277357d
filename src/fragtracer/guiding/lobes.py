# SPDX-License-Identifier: MIT
"""Lobes fitted to photons in the cells of two nested grids, as shaders/guiding/lobes.glsl reads them."""

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
_OUTLIERS = 0.05  # of the flux at either end of each axis, which the grid leaves out
_GAIN = 3.0  # by which a lobe counts more than the same irradiance from all around: it has more of the variance


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
    low, edge, size = _grid(photons)
    place = np.clip((photons.receiver - low) / edge, 0, size - 1e-6)
    index = np.floor(place).astype(np.int64)
    coarse = (index[:, 2] * size[1] + index[:, 1]) * size[0] + index[:, 0]
    total = int(size.prod())
    count = np.bincount(coarse, minlength=total)
    edges = np.select([count >= _PHOTONS * e * e for e in _EDGES[::-1]], _EDGES[::-1], 1)
    first = np.cumsum(edges**3) - edges**3
    own = edges[coarse]
    fine = np.floor((place - index) * own[:, None]).astype(np.int64)
    cell = first[coarse] + (fine[:, 2] * own + fine[:, 1]) * own + fine[:, 0]
    parent = np.repeat(np.arange(total), edges**3)

    with ThreadPoolExecutor(2) as threads:
        made = [threads.submit(_lobes_of, photons, *cells) for cells in ((coarse, total), (cell, len(parent)))]
        above, (points, widths, flux) = (m.result() for m in made)
    there = np.flatnonzero(above[2].any(axis=1))
    if not len(there):
        return None
    middle = np.stack(np.unravel_index(np.arange(total), size[::-1])[::-1], axis=1)
    nearest = there[[int(np.square(middle[there] - m).sum(axis=1).argmin()) for m in middle]]
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
    area = ((edge / edges) ** 2)[parent][:, None]
    indirect = np.minimum(photons.indirect, np.quantile(photons.indirect, 0.95))
    mean = np.bincount(coarse, indirect, total) / np.maximum(count, 1)
    other = (mean + 0.05 * indirect.mean())[nearest[parent]][:, None]
    ratios = _GAIN * flux / area / np.maximum(other, 1e-30)
    return Lobes(low, edge, size, first, edges, points, widths, ratios)


def _lobes_of(photons: Photons, cell: Ints, cells: int) -> tuple[Floats, Floats, Floats]:
    """Points (cells, LOBES, 3), widths and flux (cells, LOBES) of the lobes of ``photons`` whose cells are given."""
    direction = photons.source - photons.receiver
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    found, lobe, count = np.unique(_lobe_of(cell, photons.group, photons.flux), return_inverse=True, return_counts=True)
    points, widths, flux = np.zeros((cells * LOBES, 3)), np.zeros(cells * LOBES), np.zeros(cells * LOBES)
    points[found] = _points(lobe, photons.receiver, photons.source, direction, photons.flux, len(found))
    widths[found] = _widths(lobe, photons.receiver, direction, photons.flux, points[found])
    flux[found] = np.where(count < _LEAST, 0, np.bincount(lobe, photons.flux))
    return points.reshape(cells, LOBES, 3), widths.reshape(cells, LOBES), flux.reshape(cells, LOBES)


def _grid(photons: Photons) -> tuple[Floats, float, Ints]:
    """Lower corner, edge of a coarse cell and number of cells."""
    low, high = np.empty(3), np.empty(3)
    for axis in range(3):
        order = np.argsort(photons.receiver[:, axis])
        share = np.cumsum(photons.flux[order])
        ends = np.searchsorted(share, share[-1] * np.array([_OUTLIERS, 1 - _OUTLIERS]))
        low[axis], high[axis] = photons.receiver[order[ends], axis]
    edge = max(float((high - low).max()), 1e-30) / (_COARSE - 1)
    size = np.floor((high - low) / edge).astype(np.int64) + 1
    return (low + high - size * edge) / 2, edge, size


def _lobe_of(cell: Ints, group: Ints, flux: Floats) -> Ints:
    """The lobe (n,) of each photon: one for each of the groups of its cell that bring most flux, the last for all
    others."""
    groups = int(group.max()) + 1
    found, inverse = np.unique(cell * groups + group, return_inverse=True)
    order = np.lexsort((-np.bincount(inverse, flux), found // groups))
    cells = (found // groups)[order]
    rank = np.empty(len(found), np.int64)
    rank[order] = np.arange(len(found)) - np.searchsorted(cells, cells)
    lobe: Ints = cell * LOBES + np.minimum(rank, LOBES - 1)[inverse]
    return lobe


def _points(lobe: Ints, receiver: Floats, source: Floats, direction: Floats, flux: Floats, count: int) -> Floats:
    """The point (count, 3) that the photons of each lobe seem to come from: least squares of the angles, which the last
    estimate of the distance weighs; drawn a little to the mean of the sources, and no nearer to the receivers than a
    fifth of the way."""

    def sums(values: Floats) -> Floats:
        return np.bincount(lobe, values, count).astype(np.float64)

    total = np.maximum(sums(flux), 1e-30)
    mean: Floats = np.stack([sums(flux * source[:, i]) for i in range(3)], axis=1) / total[:, None]
    middle = np.stack([sums(flux * receiver[:, i]) for i in range(3)], axis=1) / total[:, None]
    points = mean
    for _ in range(2):
        weight = flux / np.maximum(np.square(points[lobe] - receiver).sum(axis=1), 1e-12)
        along = np.einsum("ij,ij->i", direction, receiver)
        normal, right = np.empty((count, 3, 3)), np.empty((count, 3))
        for i in range(3):
            right[:, i] = sums(weight * (receiver[:, i] - along * direction[:, i]))
            for j in range(i, 3):
                value = sums(weight * (float(i == j) - direction[:, i] * direction[:, j]))
                normal[:, i, j] = normal[:, j, i] = value
        hold = 3e-2 * sums(weight) + 1e-30
        held = (right + hold[:, None] * mean)[..., None]
        points = np.asarray(np.linalg.solve(normal + hold[:, None, None] * np.eye(3), held)[..., 0], np.float64)
        off = points - mean
        most = 0.8 * np.linalg.norm(mean - middle, axis=1)
        points = mean + off * np.minimum(1, most / np.maximum(np.linalg.norm(off, axis=1), 1e-30))[:, None]
    return points


def _widths(lobe: Ints, receiver: Floats, direction: Floats, flux: Floats, points: Floats) -> Floats:
    """Half of the flux of each lobe passes its point within this distance, which is how GGX's alpha is defined."""
    to_point = points[lobe] - receiver
    distance = np.linalg.norm(to_point, axis=1)
    cosine = np.einsum("ij,ij->i", to_point, direction) / np.maximum(distance, 1e-30)
    off = np.sqrt(np.maximum(0, 1 - cosine**2)) / np.maximum(cosine, 0.05) * distance
    # By lobe, then by distance: floats that are not negative are in the order of their bits.
    order = np.argsort(lobe << 32 | off.astype(np.float32).view(np.uint32))
    share = np.cumsum(flux[order])
    total = np.bincount(lobe, flux, len(points))
    before = np.cumsum(total) - total
    middle = np.minimum(np.searchsorted(share, before + total / 2), len(off) - 1)
    widths: Floats = off[order][middle]
    return widths
