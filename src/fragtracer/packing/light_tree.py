# SPDX-License-Identifier: MIT
"""A binary tree over lights, to choose one by what it brings to a point (shaders/light/tree.glsl)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh import pairs

Floats = NDArray[np.float64]

MOST_DEPTH = 32  # nodes on a way through the tree


@dataclass(frozen=True, eq=False)
class LightTree:
    """A binary tree over n lights in the ``order`` (n,) of its leaves. Of its nodes, the root first: their ``children``
    (n - 1, 2), nodes or -1; ``firsts`` (n - 1,), how many leaves are before the second child; ``places`` (n - 1, 2, 3)
    and ``spreads`` (n - 1, 2) of the children."""

    order: NDArray[np.int64]
    children: NDArray[np.int64]
    firsts: NDArray[np.int64]
    places: Floats
    spreads: Floats

    def nodes(self, cumulative: Floats) -> list[dict[str, Any]]:
        """Its records, of lights whose ``cumulative`` probabilities are in its order."""
        splits = cumulative[self.firsts]
        return [
            {
                "first_place": places[0],
                "first_spread": spreads[0],
                "second_place": places[1],
                "second_spread": spreads[1],
                "split": split,
                "first": children[0],
                "second": children[1],
            }
            for places, spreads, split, children in zip(self.places, self.spreads, splits, self.children, strict=True)
        ]


def light_tree(places: Floats, spreads: Floats, powers: Floats) -> LightTree:
    """The tree over at least two lights at ``places`` (n, 3), of mean squared radii ``spreads`` (n,) and ``powers``
    (n,) above 0."""
    count = len(places)
    corners = places.astype(np.float32).T
    curve, rounds = pairs(np.concatenate([corners, -corners]), MOST_DEPTH)
    members = np.concatenate([np.stack(pair, axis=1) for pair in rounds])  # of pairs, numbered from count on
    size, power = np.ones(2 * count - 1, np.int64), np.concatenate([powers[curve], np.zeros(count - 1)])
    place = np.concatenate([places[curve], np.zeros((count - 1, 3))])
    spread = np.concatenate([spreads[curve], np.zeros(count - 1)])
    levels, made = [], count
    for pair in rounds:
        levels.append(np.arange(made, made + len(pair[0])))
        made += len(pair[0])
    for level in levels:
        both = members[level - count]
        size[level], power[level] = size[both].sum(axis=1), power[both].sum(axis=1)
        share = power[both] / power[level, None]
        place[level] = (share[..., None] * place[both]).sum(axis=1)
        apart = ((place[both] - place[level, None]) ** 2).sum(axis=2)
        spread[level] = (share * (spread[both] + apart)).sum(axis=1)
    before = np.zeros(2 * count - 1, np.int64)  # leaves before a node
    for level in reversed(levels):
        first, second = members[level - count].T
        before[first] = before[level]
        before[second] = before[level] + size[first]
    order = np.empty(count, np.int64)
    order[before[:count]] = curve
    members = members[::-1]  # the root first
    children = np.where(members < count, -1, 2 * count - 2 - members)
    return LightTree(order, children, before[members[:, 1]], place[members], spread[members])
