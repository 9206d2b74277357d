# SPDX-License-Identifier: MIT
"""Whether many rays escape from a scene. The integrator asks for it, to keep the lanes of a device busy
(shaders/integrator/path.glsl); it decides over speed, and over no picture."""

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.records import Words
from fragtracer.packing.shapes import Kind

Floats = NDArray[np.float64]

_LEAST_SHARE = 0.2  # of rays that escape, from which on scenes are faster as open ones (docs/performance.md)
_MOST_WALLS = 64  # the walls of a room are few, the triangles of what stands in it may be many
_POINTS, _DIRECTIONS = 16, 64


def walls_of(words: Words) -> Words:
    """Of records (n, 4, 4) those of planes, and of the largest flat shapes and triangles."""
    kinds = words[:, 0, 3] >> 24
    flat = np.flatnonzero((kinds == Kind.TRIANGLE) | (kinds >= Kind.RECTANGLE))
    if len(flat) > _MOST_WALLS:
        a, b, c = (words[flat, texel, :3].view(np.float32) for texel in range(3))
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        flat = flat[np.argpartition(areas, -_MOST_WALLS)[-_MOST_WALLS:]]
    walls: Words = words[np.concatenate([np.flatnonzero(kinds == Kind.PLANE), flat])]
    return walls


def is_open(walls: Words, low: Floats, high: Floats) -> bool:
    """Whether a fifth of all rays from the box between the corners ``low`` and ``high`` (3,), in the coordinates of
    the records, meet none of the ``walls``."""
    if not np.isfinite([low, high]).all():
        low, high = np.full(3, -1.0), np.full(3, 1.0)
    origins = low + (high - low) * _points_in_cube(_POINTS)[:, None, None]
    directions = _points_on_sphere(_DIRECTIONS)[:, None]
    kinds = walls[:, 0, 3] >> 24
    with np.errstate(divide="ignore", invalid="ignore"):
        met = np.concatenate(
            [
                _meets_planes(walls[kinds == Kind.PLANE], origins, directions),
                _meets_flats(walls[kinds != Kind.PLANE], origins, directions),
            ],
            axis=2,
        )
    return bool(1 - met.any(axis=2).mean() >= _LEAST_SHARE)


def _points_in_cube(count: int) -> Floats:
    """(count, 3), evenly: an additive recurrence (Roberts 2018, The Unreasonable Effectiveness of Quasirandom
    Sequences)."""
    ratio = 1.2207440846057596  # its fourth power is its sum with 1
    return (0.5 + np.arange(1, count + 1)[:, None] / ratio ** np.arange(1, 4)) % 1


def _points_on_sphere(count: int) -> Floats:
    """(count, 3), evenly: a spiral by the golden angle (Vogel 1979, A Better Way to Construct the Sunflower Head)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    return np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


def _meets_planes(planes: Words, origins: Floats, directions: Floats) -> NDArray[np.bool_]:
    normals, offsets = _vectors(planes, 0), _vectors(planes, 1)[:, 0]
    met: NDArray[np.bool_] = (offsets - origins @ normals.T[None])[..., 0, :] / (directions @ normals.T)[:, 0] > 0
    return met


def _meets_flats(flats: Words, origins: Floats, directions: Floats) -> NDArray[np.bool_]:
    kinds = flats[:, 0, 3] >> 24
    corner, (u, v) = _vectors(flats, 0), _edges(flats)
    normal = np.cross(u, v)
    distance = ((corner - origins) * normal).sum(axis=-1) / (directions * normal).sum(axis=-1)
    point = origins + distance[..., None] * directions - corner
    # Coordinates along the edges: the point times the dual basis.
    area = (normal * normal).sum(axis=1, keepdims=True)
    a, b = ((point * np.cross(*axes) / area).sum(axis=-1) for axes in ((v, normal), (normal, u)))
    is_in_rectangle = (np.abs(a - 0.5) <= 0.5) & (np.abs(b - 0.5) <= 0.5)
    is_in_triangle = (a >= 0) & (b >= 0) & (a + b <= 1)
    is_disk, is_rectangle = kinds == Kind.DISK, kinds == Kind.RECTANGLE
    is_in = np.where(is_disk, a * a + b * b <= 1, np.where(is_rectangle, is_in_rectangle, is_in_triangle))
    met: NDArray[np.bool_] = is_in & (distance > 0)
    return met


def _edges(flats: Words) -> tuple[Floats, Floats]:
    return _vectors(flats, 1) - _vectors(flats, 0), _vectors(flats, 2) - _vectors(flats, 0)


def _vectors(words: Words, texel: int) -> Floats:
    return np.ascontiguousarray(words[:, texel, :3]).view(np.float32).astype(np.float64)
