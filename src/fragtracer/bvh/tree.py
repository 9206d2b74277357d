# SPDX-License-Identifier: MIT
"""Trees of boxes: built by clustering pairs, their leaves chosen by the surface area heuristic, then widened."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh.cluster import Boxes, Indices, cluster

WIDTH = 4  # children of a node at most
NONE = np.iinfo(np.int32).min  # in place of a child
# A tree deeper than this is built again, balanced: the shader's stack has entries for each level.
MAX_DEPTH = 24
# What passing a pair costs a ray, in tests of what is in a box: a wide node takes the place of two or three.
_PAIR_COST = 0.5


@dataclass(frozen=True)
class Bvh:
    """A tree over n boxes: which belong together, not where they are.

    ``order`` (n,) lists the boxes so that each leaf is a run of it; ``last`` (n,) marks the ends of the runs.
    ``children`` (nodes, WIDTH) are the inner nodes, each before its descendants: a node, ~first for
    the leaf that begins there in ``order``, or NONE. Without inner nodes all is one leaf. ``depth`` is the
    number of inner nodes from the root to the deepest, both counted.
    """

    children: Indices
    order: Indices
    last: NDArray[np.bool_]
    depth: int

    @property
    def is_node(self) -> NDArray[np.bool_]:
        """(nodes, WIDTH): which children are inner nodes."""
        return self.children >= 0

    @property
    def is_leaf(self) -> NDArray[np.bool_]:
        """(nodes, WIDTH): which children are leaves."""
        return (self.children < 0) & (self.children != NONE)

    def levels(self) -> Iterator[NDArray[np.int64]]:
        """The inner nodes of each level, from the root down."""
        level = np.zeros(min(1, len(self.children)), np.int64)
        while level.size:
            yield level
            below = self.children[level].ravel()
            level = below[below >= 0].astype(np.int64)

    def child_boxes(self, boxes: Boxes) -> tuple[NDArray[np.float32], Boxes]:
        """Fit the tree to ``boxes`` (6, n), sorted by :attr:`order`.

        Returns the boxes of the children of each inner node, (nodes, WIDTH, 6), infinity where there is none,
        and that of the root, (6,).
        """
        leaf_boxes = np.minimum.reduceat(boxes, self._firsts(), axis=1).T
        result = np.full((len(self.children), WIDTH, 6), np.inf, np.float32)
        result[self.is_leaf] = leaf_boxes[self._leaf_of()[~self.children[self.is_leaf]]]
        is_node = self.is_node
        for level in reversed(list(self.levels())):
            node, slot = np.nonzero(is_node[level])
            node = level[node]
            result[node, slot] = result[self.children[node, slot]].min(axis=1)
        return result, result[0].min(axis=0) if len(result) else leaf_boxes[0]

    def layout(self, sizes: NDArray[np.int64]) -> "Layout":
        """Places for the tree in a row of records: one for a node, ``sizes`` (n,) for the boxes, by :attr:`order`."""
        within = np.cumsum(sizes) - sizes
        firsts, leaf_of = self._firsts(), self._leaf_of()
        leaf_sizes = np.add.reduceat(sizes, firsts)
        width = np.where(self.is_node, 1, 0)
        width[self.is_leaf] = leaf_sizes[leaf_of[~self.children[self.is_leaf]]]
        offsets = np.cumsum(width, axis=1) - width
        blocks = width.sum(axis=1)
        root = 1 if len(self.children) else int(sizes.sum())

        levels = list(self.levels())
        is_node, below = self.is_node, np.zeros(self.children.shape, np.int64)  # records below each child
        for level in reversed(levels):
            node, slot = np.nonzero(is_node[level])
            node = level[node]
            child = self.children[node, slot]
            below[node, slot] = blocks[child] + below[child].sum(axis=1)
        before = np.cumsum(below, axis=1) - below
        nodes, blocks_at = np.zeros(len(self.children), np.int64), np.full(len(self.children), root)
        leaves = np.zeros(len(firsts), np.int64)
        for level in levels:
            node, slot = np.nonzero(is_node[level])
            node = level[node]
            child = self.children[node, slot]
            nodes[child] = blocks_at[node] + offsets[node, slot]
            blocks_at[child] = blocks_at[node] + blocks[node] + before[node, slot]
        node, slot = np.nonzero(self.is_leaf)
        leaves[leaf_of[~self.children[node, slot]]] = blocks_at[node] + offsets[node, slot]
        items = leaves[leaf_of] + within - within[firsts][leaf_of]
        return Layout(root, root + int(blocks.sum()), nodes, blocks_at, offsets, items)

    def _firsts(self) -> NDArray[np.int64]:
        """Where each leaf begins."""
        return np.flatnonzero(np.concatenate([[True], self.last[:-1]]))

    def _leaf_of(self) -> NDArray[np.int64]:
        """(n,): the leaf of each box."""
        leaf: NDArray[np.int64] = np.cumsum(self.last) - self.last
        return leaf


@dataclass(frozen=True)
class Layout:
    """Where a tree lies in a row of records, those of siblings side by side.

    The first ``root`` records are the root, a node or a leaf; ``count`` are all. ``nodes`` (nodes,) and ``items``
    (n,) are the records of inner nodes and the first ones of boxes; ``first`` (nodes,) is where the children of a node
    begin, and ``offsets`` (nodes, WIDTH) how far from there each lies.
    """

    root: int
    count: int
    nodes: NDArray[np.int64]
    first: NDArray[np.int64]
    offsets: NDArray[np.int64]
    items: NDArray[np.int64]


def build(boxes: Boxes, max_leaf: int = 1) -> Bvh:
    """Build a tree over ``boxes`` (6, n) float32: lower corners, and upper ones negated; n > 0.

    A leaf holds at most ``max_leaf`` boxes, and more than one only where that makes rays cheaper.
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
    is_inner, sizes, areas = _inner_nodes(rounds, boxes, max_leaf)
    inner = is_inner.astype(np.int64)  # nodes of each subtree
    for a, b, made in _made(rounds, count):
        inner[made] += inner[a] + inner[b]
    left, right = (np.concatenate([np.empty(0, np.int32), *(pair[side] for pair in rounds)]) for side in (0, 1))

    # From the root down: where each subtree begins among the nodes and among the boxes.
    node_at, box_at = np.zeros(2 * count - 1, np.int64), np.zeros(2 * count - 1, np.int64)
    children = np.empty((inner[-1], 2), np.int32)
    node_areas = np.empty(inner[-1], np.float32)
    last = np.zeros(count, bool)
    last[-1] = True
    level = np.array([2 * count - 2])
    while (level := level[level >= count]).size:
        a, b = left[level - count], right[level - count]
        node_at[a] = node_at[level] + is_inner[level]
        node_at[b] = node_at[a] + inner[a]
        box_at[a] = box_at[level]
        box_at[b] = box_at[a] + sizes[a]
        parents = np.flatnonzero(is_inner[level])
        node_areas[node_at[level[parents]]] = areas[level[parents]]
        for side, child in enumerate((a[parents], b[parents])):
            children[node_at[level[parents]], side] = np.where(is_inner[child], node_at[child], ~box_at[child])
            leaves = child[~is_inner[child]]
            last[box_at[leaves] + sizes[leaves] - 1] = True
        level = np.concatenate([a, b])
    places = np.empty(count, np.int32)
    places[box_at[:count]] = order
    wide, depth = _widened(children, node_areas)
    return Bvh(wide, places, last, depth)


def _widened(pairs: Indices, areas: NDArray[np.float32]) -> tuple[Indices, int]:
    """Nodes (m, WIDTH) of binary ones (n, 2), and the depth: each takes in, as long as there is room, the child of the
    largest area (Wald, Benthin and Boulos 2008, Getting Rid of Packets)."""
    levels: list[Indices] = []
    count = 1
    level = np.zeros(min(1, len(pairs)), np.int64)
    while level.size:
        slots = np.full((len(level), WIDTH), NONE, np.int32)
        slots[:, :2] = pairs[level]
        for width in range(2, WIDTH):
            area = np.where(slots >= 0, areas[np.maximum(slots, 0)], -1.0)
            slot = area.argmax(axis=1)
            row = np.flatnonzero(slots[np.arange(len(slots)), slot] >= 0)
            opened = slots[row, slot[row]]
            slots[row, slot[row]] = pairs[opened, 0]
            slots[row, width] = pairs[opened, 1]
        is_node = slots >= 0
        level = slots[is_node]
        slots[is_node] = np.arange(count, count + len(level), dtype=np.int32)
        count += len(level)
        levels.append(slots)
    return np.concatenate([np.empty((0, WIDTH), np.int32), *levels]), len(levels)


def _inner_nodes(
    rounds: Sequence[tuple[Indices, Indices]], boxes: Boxes, max_leaf: int
) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[np.float32]]:
    """Which boxes and pairs are inner nodes, how many boxes each holds, and half its area, (2 n - 1,)."""
    count = boxes.shape[1]
    sizes = np.ones(2 * count - 1, np.int64)
    bounds = np.empty((6, 2 * count - 1), np.float32)
    bounds[:, :count] = boxes
    cost = np.empty(2 * count - 1, np.float32)  # of all steps below, times the area of the scene
    cost[:count] = _half_area(boxes)
    is_inner = np.zeros(2 * count - 1, bool)
    areas = np.empty(2 * count - 1, np.float32)
    areas[:count] = cost[:count]
    for a, b, made in _made(rounds, count):
        sizes[made] = sizes[a] + sizes[b]
        bounds[:, made] = np.minimum(bounds[:, a], bounds[:, b])
        area = areas[made] = _half_area(bounds[:, made])
        split, whole = _PAIR_COST * area + cost[a] + cost[b], area * sizes[made]
        is_inner[made] = (sizes[made] > max_leaf) | (split < whole)
        cost[made] = np.where(is_inner[made], split, whole)
    for a, b, made in reversed(list(_made(rounds, count))):  # below a leaf there is no node
        is_inner[a] &= is_inner[made]
        is_inner[b] &= is_inner[made]
    return is_inner, sizes, areas


def _made(rounds: Sequence[tuple[Indices, Indices]], count: int) -> Iterator[tuple[Indices, Indices, slice]]:
    """Both members of the pairs of each round, and the numbers of the pairs."""
    for a, b in rounds:
        yield a, b, slice(count, count + len(a))
        count += len(a)


def _half_area(boxes: Boxes) -> NDArray[np.float32]:
    x, y, z = boxes[:3] + boxes[3:]
    area: NDArray[np.float32] = x * y + y * z + z * x
    return area
