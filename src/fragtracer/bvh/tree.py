# SPDX-License-Identifier: MIT
"""BVHs with up to four children a node: primitives are paired by clustering, then pairs of pairs are merged."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh.cluster import Bounds, Indices, cluster

WIDTH = 4  # children of a node at most
NONE = np.iinfo(np.int32).min  # in place of a child
# A deeper BVH is built again, balanced: the stack of shape/bvh.glsl holds two of this depth.
MAX_DEPTH = 31


@dataclass(frozen=True)
class Bvh:
    """The topology of a BVH over n primitives.

    ``children`` (nodes, WIDTH) are the inner nodes, the root first and each before its descendants: a node, ~i for
    the primitive i, or NONE. A single primitive has no node. ``depth`` is the number of nodes from the root to the
    deepest, both counted.
    """

    children: Indices
    depth: int

    @property
    def is_node(self) -> NDArray[np.bool_]:
        """(nodes, WIDTH): which children are nodes."""
        return self.children >= 0

    @property
    def is_leaf(self) -> NDArray[np.bool_]:
        """(nodes, WIDTH): which children are primitives."""
        return (self.children < 0) & self.is_there

    @property
    def is_there(self) -> NDArray[np.bool_]:
        """(nodes, WIDTH): which children there are; the first of each row."""
        there: NDArray[np.bool_] = self.children != NONE
        return there

    def child_bounds(self, bounds: Bounds) -> tuple[NDArray[np.float32], Bounds]:
        """Fit the BVH to the ``bounds`` (6, n) of its primitives.

        Returns the bounds of the children of each node, (nodes, WIDTH, 6), infinity where there is none,
        and that of the root, (6,).
        """
        if not len(self.children):
            return np.empty((0, WIDTH, 6), np.float32), bounds[:, 0]
        result = np.full((len(self.children), WIDTH, 6), np.inf, np.float32)
        result[self.is_leaf] = bounds.T[~self.children[self.is_leaf]]
        for node, slot in reversed(list(self._levels())):
            result[node, slot] = result[self.children[node, slot]].min(axis=1)
        return result, result[0].min(axis=0)

    @cached_property
    def layout(self) -> "Layout":
        """Places for nodes and primitives in a row of records: the root first, siblings side by side, and what is below
        a node in one piece."""
        count = self.is_there.sum(axis=1)
        below = np.zeros(self.children.shape, np.int64)  # records below each child
        levels = list(self._levels())
        for node, slot in reversed(levels):
            child = self.children[node, slot]
            below[node, slot] = count[child] + below[child].sum(axis=1)
        before = np.cumsum(below, axis=1) - below
        nodes, first = np.zeros(len(count), np.int64), np.ones(len(count), np.int64)
        for node, slot in levels:
            child = self.children[node, slot]
            nodes[child] = first[node] + slot
            first[child] = first[node] + count[node] + before[node, slot]
        node, slot = np.nonzero(self.is_leaf)
        leaves = np.zeros(len(node) or 1, np.int64)
        leaves[~self.children[node, slot]] = first[node] + slot
        return Layout(nodes, first, leaves)

    def _levels(self) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """The children that are nodes, by node and slot, of each level from the root down."""
        level = np.zeros(min(1, len(self.children)), np.int64)
        is_node = self.is_node
        while level.size:
            row, slot = np.nonzero(is_node[level])
            yield level[row], slot
            level = self.children[level[row], slot].astype(np.int64)


@dataclass(frozen=True)
class Layout:
    """The records of the ``nodes`` (nodes,) of a BVH, of the ``first`` child of each, and of the primitives,
    ``leaves`` (n,)."""

    nodes: NDArray[np.int64]
    first: NDArray[np.int64]
    leaves: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of records."""
        return len(self.nodes) + len(self.leaves)


def build(bounds: Bounds) -> Bvh:
    """Build a BVH over primitives with the ``bounds`` (6, n) float32: lower corners, and upper ones negated; n > 0."""
    bounds = np.ascontiguousarray(bounds, np.float32)
    order, rounds = cluster(bounds)
    in_order = bounds[:, order]
    bvh = _widened(order, rounds, in_order)
    return bvh if bvh.depth <= MAX_DEPTH else _widened(order, _balanced(len(order)), in_order)


def pairs(bounds: Bounds, most_depth: int) -> tuple[Indices, list[tuple[Indices, Indices]]]:
    """A binary tree over primitives with the ``bounds`` (6, n), as :func:`cluster` returns it; a balanced one where
    that had more than ``most_depth`` pairs above each other."""
    order, rounds = cluster(np.ascontiguousarray(bounds, np.float32))
    depth = np.zeros(2 * len(order) - 1, np.int32)
    made = len(order)
    for left, right in rounds:
        depth[made : made + len(left)] = 1 + np.maximum(depth[left], depth[right])
        made += len(left)
    return order, rounds if depth[-1] <= most_depth else _balanced(len(order))


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


def _widened(order: Indices, rounds: Sequence[tuple[Indices, Indices]], bounds: Bounds) -> Bvh:
    """Of the BVHs that leave out some pairs of ``rounds``, that in which rays take the fewest steps; ``bounds`` are in
    the order of :func:`cluster`."""
    count = len(order)
    trees, first_share = _cheapest(rounds, bounds)
    pairs = np.concatenate([np.empty((0, 2), np.int32), *(np.stack(members, axis=1) for members in rounds)])
    levels: list[Indices] = []
    made = 1
    level = np.arange(len(pairs))[-1:]
    while level.size:
        rows = np.arange(len(level))
        slots = np.full((len(level), WIDTH), NONE, np.int32)
        shares = np.zeros((len(level), WIDTH), np.uint8)  # children that stand for each slot in the end
        slots[:, 0], shares[:, 0] = count + level, WIDTH
        for width in range(1, WIDTH):
            slot = shares.argmax(axis=1)
            opens = shares[rows, slot] > 1
            row, slot = rows[opens], slot[opens]
            pair, share = slots[row, slot] - count, shares[row, slot]
            for place, member, part in (
                (slot, pairs[pair, 0], first_share[pair, share]),
                (width, pairs[pair, 1], share - first_share[pair, share]),
            ):
                slots[row, place], shares[row, place] = member, trees[member, part]
        is_pair, is_leaf = slots >= count, (slots >= 0) & (slots < count)
        level = slots[is_pair].astype(np.int64) - count
        slots[is_leaf] = ~order[slots[is_leaf]]
        slots[is_pair] = np.arange(made, made + len(level), dtype=np.int32)
        made += len(level)
        levels.append(slots)
    return Bvh(np.concatenate([np.empty((0, WIDTH), np.int32), *levels]), len(levels))


def _cheapest(rounds: Sequence[tuple[Indices, Indices]], bounds: Bounds) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """How the binary tree of ``rounds`` is best widened (Ylitie, Karras and Laine 2017, section 4.1): a step at a node,
    or at a primitive, costs its area.

    Returns
    -------
    trees
        (2 n - 1, WIDTH) for each primitive and pair: how many BVHs hold it best if there may be at most so many.
    first_share
        (n - 1, WIDTH + 1) for each pair that is held by so many BVHs: how many of them hold its first member.
    """
    count = bounds.shape[1]
    merged = np.empty((6, 2 * count - 1), np.float32)
    merged[:, :count] = bounds
    cost = np.empty((2 * count - 1, WIDTH), np.float32)  # by the number of trees there is room for; [0] is not used
    cost[:count] = _half_area(bounds)[:, None]
    trees = np.ones((2 * count - 1, WIDTH), np.uint8)
    first_share = np.zeros((count - 1, WIDTH + 1), np.uint8)
    made = count
    for a, b in rounds:
        new = slice(made, made + len(a))
        merged[:, new] = np.minimum(merged[:, a], merged[:, b])
        split = [np.empty(0, np.float32)] * (WIDTH + 1)
        for room in range(2, WIDTH + 1):
            parts = np.stack([cost[a, k] + cost[b, room - k] for k in range(1, room)])
            split[room] = parts.min(axis=0)
            first_share[made - count : made - count + len(a), room] = parts.argmin(axis=0) + 1
        cost[new, 1] = _half_area(merged[:, new]) + split[WIDTH]
        for room in range(2, WIDTH):
            gains = split[room] < cost[new, room - 1]
            cost[new, room] = np.where(gains, split[room], cost[new, room - 1])
            trees[new, room] = np.where(gains, room, trees[new, room - 1])
        made += len(a)
    return trees, first_share


def _half_area(bounds: Bounds) -> NDArray[np.float32]:
    x, y, z = bounds[:3] + bounds[3:]
    area: NDArray[np.float32] = x * y + y * z + z * x
    return area
