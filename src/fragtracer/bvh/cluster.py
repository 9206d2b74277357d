# SPDX-License-Identifier: MIT
"""Pairs primitives into a binary tree by their bounds, bottom up (Meister and Bittner 2018, Parallel Locally-Ordered
Clustering for Bounding Volume Hierarchy Construction), and the last few thousand top down (sweep.py), which makes a
better tree and takes longer.

Primitives are sorted along a Z-curve; each looks for the one nearby with which its bounds have the least
surface area; two that choose each other become one; and so on. Every step is done for all primitives at once, in pieces
that fit the cache.
"""

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh.sweep import sweep

Bounds = NDArray[np.float32]  # (6, n): the lower corner, and the upper one negated, so that a union is a minimum
Indices = NDArray[np.int32]

SWEPT = 4096  # so many are left to sweep()
RADIUS = 16  # how far along the curve a primitive looks, to both sides
_PIECE = 4096
_CODE_BITS = 5  # of a pair's distance along the curve and its phase, in place of the last bits of its area
_CURVE_BITS = 21  # for each axis


def cluster(bounds: Bounds) -> tuple[Indices, list[tuple[Indices, Indices]]]:
    """Order primitives with these ``bounds`` along the curve and pair them.

    Returns
    -------
    order
        (n,) the primitives along the curve.
    rounds
        For each round the left and right members of the pairs it made. Primitives are numbered along the
        curve, pairs from n on in the order of their making; the last pair holds all.
    """
    order = _curve_order(bounds)
    bounds = bounds[:, order]
    ids = np.arange(bounds.shape[1], dtype=np.int32)
    made = bounds.shape[1]
    rounds = []
    while len(ids) > SWEPT:
        partner = _nearest(bounds)
        place = np.arange(len(ids))
        left = np.flatnonzero((partner[partner] == place) & (place < partner))
        right = partner[left]
        rounds.append((ids[left], ids[right]))
        ids[left] = np.arange(made, made + len(left))
        made += len(left)
        bounds[:, left] = np.minimum(bounds[:, left], bounds[:, right])
        kept = np.ones(len(ids), bool)
        kept[right] = False
        kept = np.flatnonzero(kept)
        bounds, ids = bounds.take(kept, axis=1), ids[kept]
    numbers = np.concatenate([ids, np.arange(made, made + len(ids) - 1, dtype=np.int32)])
    return order, rounds + [(numbers[left], numbers[right]) for left, right in sweep(bounds)]


def _curve_order(bounds: Bounds) -> Indices:
    """The primitives sorted by the Morton codes of their centres."""
    centers = bounds[:3].astype(np.float64) - bounds[3:]
    low = centers.min(axis=1, keepdims=True)
    extent = float((centers.max(axis=1, keepdims=True) - low).max())
    cells = ((centers - low) * ((2**_CURVE_BITS - 1) / extent if extent > 0 else 0.0)).astype(np.uint64)
    x, y, z = (_spread(axis) for axis in cells)
    return np.argsort(x | y << np.uint64(1) | z << np.uint64(2), kind="stable").astype(np.int32)


def _spread(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The bits of 21-bit numbers with two zeros between any two."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        x = (x | x << np.uint64(shift)) & np.uint64(mask)
    return x


def _nearest(bounds: Bounds) -> NDArray[np.int64]:
    """For each primitive the place of the one it goes with best.

    Pairs are compared by area, then by their distance k along the curve, then by a phase: whether the
    place of the first member, over k, is odd. A pair has the same key from both sides and no two pairs of one
    primitive have the same, so that choices never run in a circle; and the phase parts long rows of equal
    bounds into pairs at once.
    """
    count = bounds.shape[1]
    best = np.full(count, np.iinfo(np.int32).max, np.int32)
    union, area = np.empty((6, _PIECE), np.float32), np.empty(_PIECE, np.float32)
    for start in range(0, count, _PIECE):
        for k in range(1, RADIUS + 1):
            size = min(start + _PIECE, count - k) - start
            if size <= 0:
                break
            both = np.minimum(
                bounds[:, start : start + size], bounds[:, start + k : start + k + size], out=union[:, :size]
            )
            sides = np.add(both[:3], both[3:], both[:3])  # negative, all three
            half = np.add(sides[1], sides[2], area[:size])
            half *= sides[0]
            half += np.multiply(sides[1], sides[2], both[3])
            key = half.view(np.int32)  # floats that are not negative are in the order of their bits
            key &= -(1 << _CODE_BITS)
            key |= _CODES[k - 1][start % (2 * k) :][:size]
            for side in (best[start : start + size], best[start + k : start + k + size]):
                np.minimum(side, key, out=side)
    code = best & ((1 << _CODE_BITS) - 1)
    place, reach = np.arange(count), (code >> 1) + 1
    return np.where((place // reach) % 2 == (code & 1), place + reach, place - reach)


_CODES = [
    ((np.arange(_PIECE + 2 * k) // k) % 2 | (k - 1) << 1).astype(np.int32) for k in range(1, RADIUS + 1)
]  # by k, for the places after a multiple of 2k
