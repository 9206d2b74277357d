# SPDX-License-Identifier: MIT
"""The tree: every box in it once, boxes that hold what is below, and a cost as the surface area heuristic wants it."""

import time
from functools import cache

import numpy as np
import pytest
from mesh_shapes import Arrays, ball, field, soup

from fragtracer.bvh import Bvh, build
from fragtracer.bvh.cluster import cluster
from fragtracer.bvh.tree import MAX_DEPTH, NONE, WIDTH


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


def cost(bvh: Bvh, boxes: np.ndarray) -> float:
    """Steps that a ray which meets the root takes on average, by the areas of boxes."""
    child_boxes, root = bvh.child_bounds(boxes)
    return 1 + sum(area(box) for box in child_boxes[bvh.is_there]) / area(root)


def area(box: np.ndarray) -> float:
    x, y, z = -(box[:3].astype(np.float64) + box[3:])
    return float(x * y + y * z + z * x)


def binary_median_split(boxes: np.ndarray) -> float:
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


def median_split(boxes: np.ndarray) -> float:
    """The cost of splitting the longest side at the median, and both halves likewise, for four children a node."""

    def halves(which: np.ndarray) -> list[np.ndarray]:
        if len(which) < 2:
            return [which]
        centers = boxes[:3, which] - boxes[3:, which]
        half = np.argsort(centers[np.argmax(np.ptp(centers, axis=1))], kind="stable")
        return [which[half[: len(which) // 2]], which[half[len(which) // 2 :]]]

    def below(which: np.ndarray) -> float:
        children = [part for half in halves(which) for part in halves(half)] if len(which) > 1 else []
        return area(boxes[:, which].min(axis=1)) + sum(below(part) for part in children)

    return below(np.arange(boxes.shape[1])) / area(boxes.min(axis=1))


@pytest.mark.parametrize("name", SHAPES)
def test_every_box_is_there_once_and_within_all_boxes_above(name: str) -> None:
    boxes = boxes_of(SHAPES[name])
    bvh = build(boxes)
    child_boxes, root = bvh.child_bounds(boxes)
    np.testing.assert_array_equal(root, boxes.min(axis=1))
    layout = bvh.layout
    assert sorted([*layout.nodes, *layout.leaves]) == list(range(layout.count))

    reached, visited, deepest = [], 0, 0
    todo = [(0 if len(bvh.children) else ~0, root, 0, 0)]
    while todo:
        node, box, record, depth = todo.pop()
        if node < 0:
            reached.append(~node)
            np.testing.assert_array_equal(boxes[:, ~node], box)
            assert layout.leaves[~node] == record
            continue
        visited += 1
        deepest = max(deepest, depth + 1)
        assert layout.nodes[node] == record
        np.testing.assert_array_equal(child_boxes[node].min(axis=0), box)
        children = bvh.children[node]
        there = children[children != NONE]
        assert 2 <= len(there) == bvh.is_there[node, : len(there)].sum()
        assert (there[there >= 0] > node).all()
        assert layout.first[node] > record
        todo += [(int(c), child_boxes[node, i], layout.first[node] + i, depth + 1) for i, c in enumerate(there)]
    assert sorted(reached) == list(range(boxes.shape[1]))
    assert visited == len(bvh.children)
    assert deepest == bvh.depth <= MAX_DEPTH


@pytest.mark.parametrize("name", ["five", "soup", "ball"])
def test_pairs_are_left_out_where_that_saves_most(name: str) -> None:
    """Against trying, for each pair, all ways to make up to four children of it."""
    boxes = boxes_of(SHAPES[name])[:, :400]
    order, rounds = cluster(boxes.copy())
    bounds = list(boxes[:, order].T)
    members: list[tuple[int, int] | None] = [None] * len(order)
    for a, b in rounds:
        members += zip(a.tolist(), b.tolist(), strict=True)
        bounds += list(np.minimum([bounds[i] for i in a], [bounds[i] for i in b]))

    @cache
    def least(which: int, room: int) -> float:
        pair = members[which]
        if pair is None:
            return area(bounds[which])
        whole = area(bounds[which]) + apart(which, WIDTH)
        return min([whole, *(apart(which, part) for part in range(2, room + 1))])

    def apart(which: int, room: int) -> float:
        a, b = members[which] or (0, 0)
        return min(least(a, k) + least(b, room - k) for k in range(1, room))

    np.testing.assert_allclose(cost(build(boxes), boxes), least(len(bounds) - 1, 1) / area(bounds[-1]), rtol=1e-4)


@pytest.mark.parametrize("name", ["ball", "field", "soup", "spiral"])
def test_rays_have_less_to_do_than_with_median_splits(name: str) -> None:
    boxes = boxes_of(SHAPES[name])
    assert cost(build(boxes), boxes) < binary_median_split(boxes)


# A regular grid is what splitting at medians suits best.
@pytest.mark.parametrize(("name", "most"), [("ball", 1.0), ("soup", 1.0), ("spiral", 1.0), ("field", 1.05)])
def test_rays_have_less_to_do_than_with_median_splits_of_the_same_width(name: str, most: float) -> None:
    boxes = boxes_of(SHAPES[name])
    assert cost(build(boxes), boxes) < most * median_split(boxes)


def test_a_tree_that_would_be_too_deep_is_balanced(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = boxes_of(SHAPES["spiral"])
    monkeypatch.setattr("fragtracer.bvh.cluster.SWEPT", 1)
    depth = build(boxes).depth
    assert depth > 20
    monkeypatch.setattr("fragtracer.bvh.tree.MAX_DEPTH", depth - 1)
    bvh = build(boxes)
    assert bvh.depth <= 7  # 2^7 > 120
    assert sorted(~bvh.children[bvh.is_leaf]) == list(range(120))


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
    np.testing.assert_array_equal(first.children, second.children)
