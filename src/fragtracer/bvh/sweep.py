# SPDX-License-Identifier: MIT
"""Splits primitives into a binary tree, top down, where that costs least by the surface area heuristic (MacDonald and
Booth 1990, Heuristics for Ray Tracing Using Space Subdivision): of all places between their centres along all three
axes (Wald, Boulos and Shirley 2007, Ray Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies).

All nodes of a level are split at once.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]

MOST_LEVELS = 48  # below, in halves


def sweep(bounds: NDArray[np.float32]) -> list[tuple[Numbers, Numbers]]:
    """Split primitives with the ``bounds`` (6, n) float32: lower corners, and upper ones negated; n > 0.

    Returns the left and right members, int64, of the pairs of each level, the lowest first. Primitives have their own
    numbers, pairs those from n on in the order of the result; the last one holds all.
    """
    count = bounds.shape[1]
    boxes = bounds.astype(np.float64)
    orders = np.argsort(boxes[:3] - boxes[3:], axis=1, kind="stable")  # by axis, of what is to be split yet
    sizes = np.full(min(1, count - 1), count)  # of the nodes of a level, one after the other in each order
    levels: list[tuple[NDArray[np.bool_], Numbers]] = []
    while sizes.size:
        begins = np.cumsum(sizes) - sizes
        node = np.repeat(np.arange(len(sizes)), sizes)
        before = np.arange(len(node)) - begins[node] + 1  # primitives of the node up to each place, that included
        behind = sizes[node] - before
        costs = np.zeros((3, len(node)))
        if len(levels) < MOST_LEVELS:
            for axis, order in enumerate(orders):
                ordered = boxes[:, order]
                costs[axis] = _areas_up_to(ordered, node) * before
                costs[axis, :-1] += _areas_up_to(ordered[:, ::-1], node[-1] - node[::-1])[-2::-1] * behind[:-1]
        costs[:, behind == 0] = np.inf
        # Of places that cost the same, that nearest to the middle: equal boxes are split in halves. The key holds how
        # far off a place is, its axis, and its number.
        least = np.minimum.reduceat(costs.min(axis=0), begins)
        off = np.where(costs <= least[node] * (1 + 1e-9), np.abs(before - behind), 2 * count)
        key = (3 * off + np.arange(3)[:, None]) * len(node) + np.arange(len(node))
        best = np.minimum.reduceat(key.min(axis=0), begins)
        left = best % len(node) - begins + 1
        axis_of = best // len(node) % 3

        is_left = np.empty(count, np.bool_)
        is_left[orders[axis_of[node], np.arange(len(node))]] = before <= left[node]
        children = np.stack([left, sizes - left], axis=1).ravel()
        orders = np.stack([order[np.argsort(2 * node + ~is_left[order], kind="stable")] for order in orders])
        is_node = children > 1
        levels.append((is_node, orders[0, np.cumsum(children) - children]))
        orders = orders[:, np.repeat(is_node, children)]
        sizes = children[is_node]

    pairs, numbers = [], np.empty(0, np.int64)
    for is_node, members in reversed(levels):
        members[is_node] = numbers
        pairs.append((members[::2], members[1::2]))
        numbers = np.arange(count, count + len(members) // 2)
        count += len(numbers)
    return pairs


def _areas_up_to(boxes: Floats, node: Numbers) -> Floats:
    """Half the area of the box around what is up to each place (6, n), within the places of the same ``node`` (n,),
    whose numbers rise from 0 on."""
    # What is of a node with a higher number is so much less that a minimum begins anew.
    apart = node * (4 * np.abs(boxes).max())
    around = np.minimum.accumulate(boxes - apart, axis=1) + apart
    x, y, z = -(around[:3] + around[3:])
    area: Floats = x * y + y * z + z * x
    return area
