# SPDX-License-Identifier: MIT
"""Triangle strips and fans to indexed triangles."""

from collections.abc import Iterable

import numpy as np

from fragtracer.io.polygons import Ints


def strip_triangles(strips: Iterable[Ints]) -> Ints:
    """(n, 3) triangles of triangle strips, in the orientation of the first of each; degenerate ones are left out."""
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
    """(n, 3) triangles of a triangle fan about its first index (glTF 2.0, section 3.7.2.1)."""
    i = np.arange(max(len(fan) - 2, 0))
    triangles: Ints = fan[np.column_stack([i + 1, i + 2, np.zeros_like(i)])].astype(np.int64)
    return triangles
