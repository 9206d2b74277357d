# SPDX-License-Identifier: MIT
"""Polygons with any number of corners to triangles."""

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


def triangulate(counts: Ints, points: Floats) -> tuple[Ints, Ints]:
    """Cut polygons, concave ones too, into triangles of the same orientation.

    Parameters
    ----------
    counts
        (n,) how many corners each polygon has; those with fewer than three give no triangle.
    points
        (sum of counts, 3) the corners, polygon after polygon.

    Returns
    -------
    triangles : numpy.ndarray
        (m, 3) rows of ``points``, polygon after polygon.
    sources : numpy.ndarray
        (m,) which polygon each triangle is of.
    """
    starts = np.concatenate(([0], np.cumsum(counts)[:-1])).astype(np.int64) if len(counts) else np.zeros(0, np.int64)
    [plain], [quads] = np.nonzero(counts == 3), np.nonzero(counts == 4)
    triangles, sources = [starts[plain, None] + np.arange(3)], [plain]
    if len(quads):
        triangles.append(_cut_quads(starts[quads], points))
        sources.append(np.repeat(quads, 2))
    for index in np.nonzero(counts > 4)[0]:
        pieces = _cut_polygon(points[starts[index] : starts[index] + counts[index]]) + starts[index]
        triangles.append(pieces)
        sources.append(np.full(len(pieces), index))
    found, polygons = np.concatenate(triangles), np.concatenate(sources)
    order = np.argsort(polygons, kind="stable")
    return found[order], polygons[order]


def _cut_quads(starts: Ints, points: Floats) -> Ints:
    """Along the diagonal from corner 0 to 2, or 1 to 3 where corner 1 or 3 points inwards."""
    corners = points[starts[:, None] + np.arange(4)]
    before, after = np.roll(corners, 1, axis=1) - corners, np.roll(corners, -1, axis=1) - corners
    turns = np.cross(after, before)
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    inwards = np.einsum("qci,qi->qc", turns, normal) < 0
    other = (inwards[:, 1] | inwards[:, 3])[:, None]
    cut = np.where(other, [[1, 2, 3, 1, 3, 0]], [[0, 1, 2, 0, 2, 3]])
    return (starts[:, None] + cut).reshape(-1, 3)


def _cut_polygon(corners: Floats) -> Ints:
    """By ear clipping in the plane that shows most of the polygon."""
    local = corners - corners[0]
    normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    flat = np.ascontiguousarray(local[:, [(axis + 1) % 3, (axis + 2) % 3]])
    largest = np.abs(flat).max()
    if not largest > 0:
        return np.zeros((0, 3), np.int64)
    ends = np.array([len(flat)], np.uint32)
    found = mapbox_earcut.triangulate_float64(flat / largest, ends).astype(np.int64).reshape(-1, 3)
    a, b, c = (flat[found[:, i]] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    turned = area * normal[axis] < 0
    found[turned] = found[turned][:, ::-1]
    return found
