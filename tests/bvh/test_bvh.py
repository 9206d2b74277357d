# SPDX-License-Identifier: MIT
"""The tree: every triangle in one leaf, boxes that hold what is below, and a cost as the surface area heuristic
wants it."""

import time

import numpy as np
import pytest
from mesh_shapes import Arrays, ball, field, soup

from fragtracer.bvh import Bvh, build
from fragtracer.bvh.tree import MAX_DEPTH


def boxes_of(arrays: Arrays) -> np.ndarray:
    corners = arrays[0][arrays[1]].astype(np.float32)
    return np.concatenate([corners.min(axis=1).T, -corners.max(axis=1).T])


def spiral(count: int) -> Arrays:
    """Triangles whose sizes and distances shrink by half from each to the next."""
    points, triangles = soup(count, size=1.0)
    scale = np.repeat(0.5 ** np.arange(count) * np.ones(count), 3)[:, None]
    return points * scale + scale, triangles


SHAPES = {
    "one": soup(1),
    "two": soup(2),
    "five": soup(5),
    "ball": ball(60, 30),
    "field": field(64),
    "soup": soup(5000),
    "all in one place": (np.tile(soup(1)[0], (500, 1)), np.arange(1500).reshape(-1, 3)),
    "points": (np.zeros((300, 3)), np.arange(300).reshape(-1, 3)),
    "spiral": spiral(120),
    "flat": (field(32)[0] * [1, 0, 1], field(32)[1]),
    "line": (np.linspace(0, 1, 3000)[:, None] * [1.0, 0, 0], np.arange(3000).reshape(-1, 3)),
    "huge": (soup(400)[0] * 1e17, soup(400)[1]),
    "tiny": (soup(400)[0] * 1e-17, soup(400)[1]),
}


def leaves(bvh: Bvh) -> dict[int, np.ndarray]:
    """What is in the leaf that begins at each place of the order."""
    ends = np.flatnonzero(bvh.last) + 1
    starts = np.concatenate([[0], ends[:-1]])
    return {int(a): bvh.order[a:b] for a, b in zip(starts, ends, strict=True)}


def cost(bvh: Bvh, boxes: np.ndarray) -> float:
    """Steps that a ray which meets the root takes on average, by the areas of boxes."""
    child_boxes, root = bvh.child_boxes(boxes[:, bvh.order])
    runs = leaves(bvh)
    total = 1.0
    for box, child in zip(child_boxes.reshape(-1, 6), bvh.children.ravel(), strict=True):
        total += area(box) / area(root) * (1 if child >= 0 else len(runs[~child]))
    return total


def area(box: np.ndarray) -> float:
    x, y, z = -(box[:3].astype(np.float64) + box[3:])
    return float(x * y + y * z + z * x)


def median_split(boxes: np.ndarray) -> float:
    """The cost of splitting the longest side at the median, down to four in a leaf."""

    def below(which: np.ndarray) -> float:
        box = boxes[:, which].min(axis=1)
        if len(which) <= 4:
            return area(box) * len(which)
        centers = boxes[:3, which] - boxes[3:, which]
        axis = np.argmax(np.ptp(centers, axis=1))
        half = np.argsort(centers[axis], kind="stable")
        middle = len(which) // 2
        return area(box) + below(which[half[:middle]]) + below(which[half[middle:]])

    return below(np.arange(boxes.shape[1])) / area(boxes.min(axis=1))


@pytest.mark.parametrize("name", SHAPES)
def test_every_box_is_in_one_leaf_and_within_all_boxes_above(name: str) -> None:
    boxes = boxes_of(SHAPES[name])
    bvh = build(boxes)
    assert sorted(bvh.order) == list(range(boxes.shape[1]))
    runs = leaves(bvh)
    assert max(map(len, runs.values())) <= 4
    child_boxes, root = bvh.child_boxes(boxes[:, bvh.order])
    np.testing.assert_array_equal(root, boxes.min(axis=1))

    reached, deepest = set(), 0
    todo = [(0 if len(bvh.children) else ~0, root, 0)]
    visited = 0
    while todo:
        node, box, depth = todo.pop()
        if node < 0:
            assert ~node not in reached
            reached.add(~node)
            np.testing.assert_array_equal(boxes[:, runs[~node]].min(axis=1), box)
            continue
        visited += 1
        deepest = max(deepest, depth + 1)
        np.testing.assert_array_equal(child_boxes[node].min(axis=0), box)
        assert (bvh.children[node] < 0).all() or (bvh.children[node][bvh.children[node] >= 0] > node).all()
        todo += [(int(c), b, depth + 1) for c, b in zip(bvh.children[node], child_boxes[node], strict=True)]
    assert reached == set(runs)
    assert visited == len(bvh.children)
    assert deepest == bvh.depth <= MAX_DEPTH


@pytest.mark.parametrize("name", ["ball", "field", "soup", "spiral"])
def test_rays_have_less_to_do_than_with_median_splits(name: str) -> None:
    boxes = boxes_of(SHAPES[name])
    assert cost(build(boxes), boxes) < median_split(boxes)


def test_a_tree_that_would_be_too_deep_is_balanced(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = boxes_of(SHAPES["soup"])
    depth = build(boxes).depth
    monkeypatch.setattr("fragtracer.bvh.tree.MAX_DEPTH", depth - 1)
    bvh = build(boxes)
    assert bvh.depth <= min(depth - 1, 13)  # 2^13 > 5000
    assert sorted(bvh.order) == list(range(5000))


def test_a_leaf_of_one_each() -> None:
    boxes = boxes_of(ball())
    bvh = build(boxes, max_leaf=1)
    assert bvh.last.all()
    assert len(bvh.children) == boxes.shape[1] - 1


def test_equal_boxes_are_paired_many_at_a_time() -> None:
    """A row of equal boxes would otherwise be paired one after the other, in as many rounds as boxes."""
    side = 300
    start = time.perf_counter()
    bvh = build(boxes_of((field(side)[0] * [1, 0, 1], field(side)[1])))
    assert bvh.depth < 40
    assert time.perf_counter() - start < 20


def test_the_same_boxes_give_the_same_tree() -> None:
    boxes = boxes_of(SHAPES["soup"])
    first, second = build(boxes), build(boxes.copy())
    for name in ("children", "order", "last"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
