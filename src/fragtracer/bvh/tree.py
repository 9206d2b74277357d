# SPDX-License-Identifier: MIT
"""Binary trees of boxes: built by clustering, their leaves chosen by the surface area heuristic."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh.cluster import Boxes, Indices, cluster

# A tree deeper than this is built again, balanced: the shader's stack has an entry for each level.
MAX_DEPTH = 64


@dataclass(frozen=True)
class Bvh:
    """A tree over n boxes: which belong together, not where they are.

    ``order`` (n,) lists the boxes so that each leaf is a run of it; ``last`` (n,) marks the ends of the runs.
    ``children`` (nodes, 2) are the inner nodes, each before its descendants: a node, or ~first for
    the leaf that begins there in ``order``. Without inner nodes all is one leaf. ``depth`` is the
    number of inner nodes from the root to the deepest, both counted.
    """

    children: Indices
    order: Indices
    last: NDArray[np.bool_]
    depth: int

    def levels(self) -> Iterator[NDArray[np.int64]]:
        """The inner nodes of each level, from the root down."""
        level = np.zeros(min(1, len(self.children)), np.int64)
        while level.size:
            yield level
            below = self.children[level].ravel()
            level = below[below >= 0].astype(np.int64)

    def child_boxes(self, boxes: Boxes) -> tuple[NDArray[np.float32], Boxes]:
        """Fit the tree to ``boxes`` (6, n), sorted by :attr:`order`.

        Returns the boxes of both children of each inner node, (nodes, 2, 6), and that of the root, (6,).
        """
        first = np.flatnonzero(np.concatenate([[True], self.last[:-1]]))
        leaf_boxes = np.minimum.reduceat(boxes, first, axis=1).T
        leaf_of = np.zeros(len(self.order), np.int64)
        leaf_of[first] = np.arange(len(first))
        result = np.empty((len(self.children), 2, 6), np.float32)
        is_leaf = self.children < 0
        result[is_leaf] = leaf_boxes[leaf_of[~self.children[is_leaf]]]
        for level in reversed(list(self.levels())):
            node, side = np.nonzero(~is_leaf[level])
            node = level[node]
            result[node, side] = result[self.children[node, side]].min(axis=1)
        return result, result[0].min(axis=0) if len(result) else leaf_boxes[0]


def build(boxes: Boxes, max_leaf: int = 4) -> Bvh:
    """Build a tree over ``boxes`` (6, n) float32: lower corners, and upper ones negated; n > 0.

    A leaf holds at most ``max_leaf`` boxes, and more than one only where that makes rays cheaper: a step through
    a node and a test of what is in a box are taken to cost the same.
    """
    boxes = np.ascontiguousarray(boxes, np.float32)
    count = boxes.shape[1]
    order, rounds = cluster(boxes)
    sorted_boxes = boxes[:, order]
    bvh = _collapsed(order, rounds, sorted_boxes, max_leaf)
    return bvh if bvh.depth <= MAX_DEPTH else _collapsed(order, _balanced(count), sorted_boxes, max_leaf)


def _balanced(count: int) -> list[tuple[Indices, Indices]]:
    """Pairs of neighbours, pairs of those, and so on, as :func:`cluster` returns them."""
    ids = np.arange(count, dtype=np.int32)
    made, rounds = count, []
    while len(ids) > 1:
        whole = len(ids) // 2 * 2
        rounds.append((ids[0:whole:2], ids[1:whole:2]))
        ids = np.concatenate([np.arange(made, made + whole // 2, dtype=np.int32), ids[whole:]])
        made += whole // 2
    return rounds


def _collapsed(order: Indices, rounds: Sequence[tuple[Indices, Indices]], boxes: Boxes, max_leaf: int) -> Bvh:
    """The tree of ``rounds`` over sorted ``boxes``, with leaves where they cost least."""
    count = len(order)
    is_inner, sizes = _inner_nodes(rounds, boxes, max_leaf)
    inner = is_inner.astype(np.int64)  # nodes of each subtree
    for a, b, made in _made(rounds, count):
        inner[made] += inner[a] + inner[b]
    left, right = (np.concatenate([np.empty(0, np.int32), *(pair[side] for pair in rounds)]) for side in (0, 1))

    # From the root down: where each subtree begins among the nodes and among the boxes.
    node_at, box_at = np.zeros(2 * count - 1, np.int64), np.zeros(2 * count - 1, np.int64)
    children = np.empty((inner[-1], 2), np.int32)
    last = np.zeros(count, bool)
    last[-1] = True
    level = np.array([2 * count - 2])
    depth = 0
    while (level := level[level >= count]).size:
        depth += bool(is_inner[level].any())
        a, b = left[level - count], right[level - count]
        node_at[a] = node_at[level] + is_inner[level]
        node_at[b] = node_at[a] + inner[a]
        box_at[a] = box_at[level]
        box_at[b] = box_at[a] + sizes[a]
        parents = np.flatnonzero(is_inner[level])
        for side, child in enumerate((a[parents], b[parents])):
            children[node_at[level[parents]], side] = np.where(is_inner[child], node_at[child], ~box_at[child])
            leaves = child[~is_inner[child]]
            last[box_at[leaves] + sizes[leaves] - 1] = True
        level = np.concatenate([a, b])
    places = np.empty(count, np.int32)
    places[box_at[:count]] = order
    return Bvh(children, places, last, depth)


def _inner_nodes(
    rounds: Sequence[tuple[Indices, Indices]], boxes: Boxes, max_leaf: int
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Which boxes and pairs are inner nodes, and how many boxes each holds, (2 n - 1,)."""
    count = boxes.shape[1]
    sizes = np.ones(2 * count - 1, np.int64)
    bounds = np.empty((6, 2 * count - 1), np.float32)
    bounds[:, :count] = boxes
    cost = np.empty(2 * count - 1, np.float32)  # of all steps below, times the area of the scene
    cost[:count] = _half_area(boxes)
    is_inner = np.zeros(2 * count - 1, bool)
    for a, b, made in _made(rounds, count):
        sizes[made] = sizes[a] + sizes[b]
        bounds[:, made] = np.minimum(bounds[:, a], bounds[:, b])
        area = _half_area(bounds[:, made])
        split, whole = area + cost[a] + cost[b], area * sizes[made]
        is_inner[made] = (sizes[made] > max_leaf) | (split < whole)
        cost[made] = np.where(is_inner[made], split, whole)
    for a, b, made in reversed(list(_made(rounds, count))):  # below a leaf there is no node
        is_inner[a] &= is_inner[made]
        is_inner[b] &= is_inner[made]
    return is_inner, sizes


def _made(rounds: Sequence[tuple[Indices, Indices]], count: int) -> Iterator[tuple[Indices, Indices, slice]]:
    """Both members of the pairs of each round, and the numbers of the pairs."""
    for a, b in rounds:
        yield a, b, slice(count, count + len(a))
        count += len(a)


def _half_area(boxes: Boxes) -> NDArray[np.float32]:
    x, y, z = boxes[:3] + boxes[3:]
    area: NDArray[np.float32] = x * y + y * z + z * x
    return area
