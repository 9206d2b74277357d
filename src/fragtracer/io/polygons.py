# SPDX-License-Identifier: MIT
"""Triangulation of polygons."""

from collections.abc import Iterator

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
MOST_CORNERS = 4096  # of a concave polygon: the time of ear clipping is quadratic


@np.errstate(over="ignore", invalid="ignore")
def triangulate(counts: Ints, points: Floats) -> tuple[Ints, Ints]:
    """Triangulate polygons, also concave ones; the triangles have the orientation of their polygon.

    Parameters
    ----------
    counts
        (n,) number of vertices of each polygon; those with fewer than three give no triangle.
    points
        (sum of counts, 3) vertices, polygon by polygon.

    Returns
    -------
    triangles : numpy.ndarray
        (m, 3) indices of ``points``, polygon by polygon.
    sources : numpy.ndarray
        (m,) index of the polygon of each triangle.

    Raises
    ------
    ValueError
        If a concave polygon has more than :data:`MOST_CORNERS` vertices.
    """
    starts = np.concatenate(([0], np.cumsum(counts)[:-1])).astype(np.int64) if len(counts) else np.zeros(0, np.int64)
    [plain], [quads] = np.nonzero(counts == 3), np.nonzero(counts == 4)
    triangles, sources = [starts[plain, None] + np.arange(3)], [plain]
    if len(quads):
        triangles.append(_split_quads(starts[quads], points))
        sources.append(np.repeat(quads, 2))
    for count in np.unique(counts[counts > 4]).tolist():
        [same] = np.nonzero(counts == count)
        for pieces, source in _triangulate_equal(starts[same], count, points):
            triangles.append(pieces)
            sources.append(same[source])
    found, polygons = np.concatenate(triangles), np.concatenate(sources)
    order = np.argsort(polygons, kind="stable")
    return found[order], polygons[order]


def _split_quads(starts: Ints, points: Floats) -> Ints:
    """Split along the diagonal 0-2, or 1-3 if vertex 1 or 3 is reflex."""
    corners = points[starts[:, None] + np.arange(4)]
    before, after = np.roll(corners, 1, axis=1) - corners, np.roll(corners, -1, axis=1) - corners
    turns = np.cross(after, before)
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    reflex = np.einsum("qci,qi->qc", turns, normal) < 0
    other = (reflex[:, 1] | reflex[:, 3])[:, None]
    cut = np.where(other, [[1, 2, 3, 1, 3, 0]], [[0, 1, 2, 0, 2, 3]])
    return (starts[:, None] + cut).reshape(-1, 3)


def _triangulate_equal(starts: Ints, count: int, points: Floats) -> Iterator[tuple[Ints, Ints]]:
    """Triangles of polygons of ``count`` vertices each, and their polygons, as indices of ``starts``."""
    corners = points[starts[:, None] + np.arange(count)]
    flat = _flattened(corners - corners[:, :1])
    convex = _are_convex(flat)
    fan = np.arange(1, count - 1)
    fan = np.column_stack([np.zeros_like(fan), fan, fan + 1])
    [which] = np.nonzero(convex)
    yield (starts[which, None, None] + fan).reshape(-1, 3), np.repeat(which, len(fan))
    for index in np.nonzero(~convex & (np.abs(flat).max(axis=(1, 2)) > 0))[0]:
        pieces = _clip_ears(flat[index])
        yield starts[index] + pieces, np.full(len(pieces), index)


def _flattened(local: Floats) -> Floats:
    """(n, vertices, 2) projections along the axis closest to each normal, counter-clockwise."""
    normals = np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1)
    axis = np.argmax(np.abs(normals), axis=1)[:, None]
    across = np.take_along_axis(local, np.broadcast_to(((axis + 1) % 3)[..., None], (*local.shape[:2], 1)), axis=2)
    along = np.take_along_axis(local, np.broadcast_to(((axis + 2) % 3)[..., None], (*local.shape[:2], 1)), axis=2)
    side = np.copysign(1.0, np.take_along_axis(normals, axis, axis=1))[..., None]
    flat: Floats = np.concatenate([across, side * along], axis=2)
    return flat


def _are_convex(flat: Floats) -> NDArray[np.bool_]:
    """Whether each outline turns left at every vertex, by 2π in all; False if two successive vertices coincide."""
    edges = np.roll(flat, -1, axis=1) - flat
    distinct = (edges != 0).any(axis=2).all(axis=1)
    after = np.roll(edges, -1, axis=1)
    turns = np.arctan2(_cross(edges, after), (edges * after).sum(axis=2))
    convex: NDArray[np.bool_] = distinct & (turns >= 0).all(axis=1) & (turns.sum(axis=1) < 3 * np.pi)
    return convex


def _clip_ears(flat: Floats) -> Ints:
    if len(flat) > MOST_CORNERS:
        raise ValueError(f"a concave face has {len(flat)} vertices; split it into faces of at most {MOST_CORNERS}")
    scaled = np.ascontiguousarray(flat / np.abs(flat).max())
    found = mapbox_earcut.triangulate_float64(scaled, np.array([len(flat)], np.uint32)).astype(np.int64).reshape(-1, 3)
    a, b, c = (scaled[found[:, i]] for i in range(3))
    clockwise = _cross(b - a, c - a) < 0
    found[clockwise] = found[clockwise][:, ::-1]
    return found


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
