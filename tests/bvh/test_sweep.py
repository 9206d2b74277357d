# SPDX-License-Identifier: MIT
"""The tree that is made top down: every split is the cheapest, and boxes that are alike are split in halves."""

import numpy as np
import pytest
from mesh_shapes import soup

from bvh.test_bvh import area, boxes_of
from fragtracer.bvh.sweep import sweep


def members_of(count: int, rounds: list[tuple[np.ndarray, np.ndarray]]) -> list[list[int]]:
    """The primitives of each primitive and pair, by its number."""
    members = [[i] for i in range(count)]
    for left, right in rounds:
        members += [members[a] + members[b] for a, b in zip(left, right, strict=True)]
    return members


def split_cost(boxes: np.ndarray, left: np.ndarray | list[int], right: np.ndarray | list[int]) -> float:
    return sum(area(boxes[:, part].min(axis=1)) * len(part) for part in (left, right))


@pytest.mark.parametrize("seed", range(3))
def test_every_split_costs_least(seed: int) -> None:
    """Of all places along all axes."""
    boxes = boxes_of(soup(60, seed=seed))
    rounds = sweep(boxes)
    members = members_of(60, rounds)
    assert sorted(members[-1]) == list(range(60))
    assert len(members) == 119
    for left, right in zip(*map(np.concatenate, zip(*rounds, strict=True)), strict=True):
        whole = np.array(members[left] + members[right])
        centers = boxes[:3, whole] - boxes[3:, whole]
        orders = [whole[np.argsort(axis, kind="stable")] for axis in centers]
        costs = [split_cost(boxes, order[:i], order[i:]) for order in orders for i in range(1, len(whole))]
        assert split_cost(boxes, members[left], members[right]) == pytest.approx(min(costs), rel=1e-6)


def test_boxes_that_are_alike_are_split_in_halves() -> None:
    boxes = np.tile(boxes_of(soup(1)), 1000)
    sizes = [len(members) for members in members_of(1000, sweep(boxes))]
    assert len(sweep(boxes)) == 10
    assert sorted(set(sizes)) == [1, 2, 3, 4, 7, 8, 15, 16, 31, 32, 62, 63, 125, 250, 500, 1000]


def test_a_tree_does_not_grow_deep(monkeypatch: pytest.MonkeyPatch) -> None:
    """Boxes that grow: a few of the largest are split off, and so on."""
    size = np.float32(2.0) ** np.arange(120)
    boxes = np.stack([np.zeros(120)] * 3 + [-size] * 3).astype(np.float32)
    assert len(sweep(boxes)) > 30
    monkeypatch.setattr("fragtracer.bvh.sweep.MOST_LEVELS", 10)
    rounds = sweep(boxes)
    assert len(rounds) <= 10 + 7  # 2^7 > 120
    assert sorted(members_of(120, rounds)[-1]) == list(range(120))


def test_one_is_not_split() -> None:
    assert sweep(boxes_of(soup(1))) == []
