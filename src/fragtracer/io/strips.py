# SPDX-License-Identifier: MIT
"""Strips and fans of triangles to triangles."""

from collections.abc import Iterable

import numpy as np

from fragtracer.io.polygons import Ints


def strip_triangles(strips: Iterable[Ints]) -> Ints:
    """(n, 3) triangles of strips of indices, all of the orientation of the first; repeats of an index give none."""
    found = [np.zeros((0, 3), np.int64)]
    for strip in strips:
        if len(strip) >= 3:
            i = np.arange(len(strip) - 2)
            rows = np.column_stack([i, i + 1 + i % 2, i + 2 - i % 2])
            found.append(strip[rows].astype(np.int64))
    triangles: Ints = np.concatenate(found)
    a, b, c = triangles.T
    distinct: Ints = triangles[(a != b) & (b != c) & (c != a)]
    return distinct


def fan_triangles(fan: Ints) -> Ints:
    """(n, 3) triangles of a fan of indices about its first (glTF 2.0, section 3.7.2.1)."""
    i = np.arange(max(len(fan) - 2, 0))
    triangles: Ints = fan[np.column_stack([i + 1, i + 2, np.zeros_like(i)])].astype(np.int64)
    return triangles
