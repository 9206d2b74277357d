# SPDX-License-Identifier: MIT
"""How a picture is cut, and put together by a tree that is always the same."""

import json
from itertools import islice

import numpy as np

from fragtracer.apps.cluster import work
from fragtracer.apps.cluster.audit import CHECKED, draws
from fragtracer.apps.cluster.merge import Tree, assembled
from fragtracer.apps.cluster.sampling import EvenSampling
from fragtracer.apps.cluster.work import Cut, Task
from fragtracer.sampling.allocation import Window
from fragtracer.sampling.merging import Moments
from fragtracer.sampling.pixels import Pixels


def test_every_sample_is_cut_once(monkeypatch) -> None:
    monkeypatch.setattr(work, "TILE", 16)
    cut = Cut(40, 20, samples=64, spp=245)
    seen = np.zeros((20, 40, 245), int)
    tasks = [task for number in range(cut.rounds or 0) for task in cut.tasks(number)]
    for task in tasks:
        window, first = task.window, cut.first(task.step)
        seen[(*work.at(window), slice(first, first + cut.spp_of(task.step)))] += 1
    assert (seen == 1).all()
    assert [cut.spp_of(number) for number in range(5)] == [32, 64, 64, 64, 21]
    assert [Cut(40, 20, 256).spp_of(number) for number in range(4)] == [32, 96, 256, 256]
    assert [Cut(40, 20, 32, 40).spp_of(number) for number in range(2)] == [32, 8]
    assert Cut(40, 20, spp=10).rounds == 1
    cut = Cut(40, 20, 256, 700, ends=(384, 200, 64))
    spans = [(0, 32), (32, 64), (64, 128), (128, 200), (200, 384), (384, 640), (640, 700)]
    assert [cut.span(number) for number in range(cut.rounds)] == spans


def test_halves_are_all_of_a_task() -> None:
    """Down to parts that are shaded together, and no further."""
    seen = np.zeros((70, 90), int)
    parts = [Task(3, 5, Window(10, 20, 77, 45))]
    for part in parts:
        halves = part.halves()
        if halves == (part,):
            seen[work.at(part.window)] += 1
            assert max(part.window.width, part.window.height) < 24
        parts += halves if len(halves) == 2 else []
    assert (seen[20:65, 10:87] == 1).all()
    assert seen.sum() == 77 * 45


def test_a_block_in_parts_is_that_block() -> None:
    """Also where a worker that has had a part in it is not trusted any more."""
    rng = np.random.default_rng(2)
    cut = Cut(24, 16, 32, 64)
    first, second = _pixels(rng, 32, (16, 24)), _pixels(rng, 32, (16, 24))
    whole, cutted = EvenSampling(cut, None), EvenSampling(cut, None)
    for number, pixels in enumerate((first, second)):
        whole.take(Task(number, 0, Window(0, 0, 24, 16)), pixels, "a")
    left, right = Task(0, 0, Window(0, 0, 24, 16)).halves()
    assert cutted.next() is not None
    cutted.take(left, work.crop(second, left.window), "wrong")  # nonsense
    cutted.take(right, work.crop(first, right.window), "a")
    cutted.take(Task(1, 0, Window(0, 0, 24, 16)), second, "a")
    assert cutted.samples == 64 * 24 * 16
    assert cutted.forget("wrong")
    assert cutted.samples == 0
    again = list(iter(cutted.next, None))
    assert {task.step for task in again} == {0, 1}
    for task in again[:4]:
        cutted.take(task, work.crop((first, second)[task.step], task.window), "a")
    for name, image in vars(whole.picture()).items():
        np.testing.assert_array_equal(image, getattr(cutted.picture(), name))
    assert cutted.advance(True)


def test_a_checkpoint_has_all_that_came_back() -> None:
    """Blocks beyond the round that is due, and parts of blocks."""
    rng = np.random.default_rng(3)
    cut = Cut(40, 16, 32, 128)
    films = [_pixels(rng, cut.spp_of(step), (16, 40)) for step in range(cut.rounds or 0)]

    def take(sampling: EvenSampling, *tasks: Task) -> None:
        for task in tasks:
            sampling.take(task, work.crop(films[task.step], task.window), "a")

    whole, before, after = (EvenSampling(cut, 0.0) for _ in range(3))
    tasks = list(iter(whole.next, None))
    take(whole, *tasks)
    first, second, third, _ = tasks
    (left, right), (again, rest) = first.halves(), second.halves()
    take(before, left, *again.halves(), third)
    state, arrays = before.state()
    assert after.restore(json.loads(json.dumps(state)), {name: image.copy() for name, image in arrays.items()})
    assert after.samples == before.samples > cut.spp_of(2) * 16 * 40
    there = before.all_there_is().mean[..., 3]
    assert (there[work.at(left.window)] == 96).all()
    assert (there[work.at(right.window)] == 32).all()
    missing = list(iter(after.next, None))
    assert set(missing) == {right, rest, tasks[3]}
    take(after, *missing)
    while not (whole.is_done and after.is_done):
        assert whole.advance(True) == after.advance(True)
    for name, image in vars(whole.picture()).items():
        np.testing.assert_array_equal(image, getattr(after.picture(), name))


def test_a_checkpoint_knows_who_has_rendered_a_tile() -> None:
    """What is forgotten after it is due once, as is what was not there; other tiles stay."""
    rng = np.random.default_rng(4)
    cut = Cut(600, 16, 32, 128)
    before, after = EvenSampling(cut, None), EvenSampling(cut, None)
    tasks = list(iter(before.next, None))
    (left, right), *whole, last = tasks[0].halves(), *tasks[1:]
    for task in (left, *whole):
        author = "wrong" if task in (left, whole[-1]) else "right"
        before.take(task, _pixels(rng, cut.spp_of(task.step), (16, task.window.width)), author)
    state, arrays = before.state()
    assert after.restore(json.loads(json.dumps(state)), arrays)
    assert after.forget("wrong")
    spoilt = {left, right, *(task for task in tasks[1:] if task.tile in (0, whole[-1].tile))}
    due = list(iter(after.next, None))
    assert len(due) == len(set(due))
    assert set(due) == spoilt | {last}
    assert after.samples == sum(map(after.cost, set(tasks[1:]) - spoilt - {last})) > 0
    assert after.forget("wrong")
    assert after.next() is None


def test_one_of_so_many_tasks_is_checked() -> None:
    """At a place that nobody knows."""
    found = np.reshape(list(islice(draws(), 200 * CHECKED)), (200, CHECKED))
    assert (found.sum(axis=1) == 1).all()
    assert len(np.unique(found.argmax(axis=1))) > CHECKED / 2


def _pixels(rng: np.random.Generator, count: int, size: tuple[int, int] = (2, 3)) -> Pixels:
    images = [rng.exponential(size=(*size, n)).astype(np.float32) for n in (4, 4, 3)]
    images[0][..., 3], images[1][..., 3] = count, 0
    return Pixels(*images)


def test_the_order_of_arrival_makes_no_difference() -> None:
    """Not to a bit; and the mean is that of all."""
    rng = np.random.default_rng(0)
    for blocks in (1, 2, 5, 11, 16):
        films = [_pixels(rng, 8) for _ in range(blocks)]
        expected = None
        for _ in range(6):
            tree = Tree()
            for number in rng.permutation(blocks):
                tree.add(int(number), films[number])
            joined = tree.joined()
            assert joined is not None
            expected = expected or joined
            for name, values in vars(joined).items():
                np.testing.assert_array_equal(values, getattr(expected, name))
        mean = np.mean([film.mean[..., :3] for film in films], axis=0, dtype=np.float64)
        np.testing.assert_allclose(expected.mean[..., :3], mean, rtol=1e-6)


def test_a_part_of_the_blocks_is_a_picture() -> None:
    rng = np.random.default_rng(1)
    tree, films = Tree(), [_pixels(rng, 8) for _ in range(9)]
    assert tree.joined() is None
    for number in (7, 2, 3, 8):
        tree.add(number, films[number])
    joined = tree.joined()
    assert joined is not None
    assert (joined.mean[..., 3] == 32).all()
    expected = Moments.of(films[2]).merged(Moments.of(films[3])).merged(Moments.of(films[7]))
    expected = expected.merged(Moments.of(films[8]))
    np.testing.assert_allclose(joined.mean[..., :3], expected.mean, rtol=1e-6)
    np.testing.assert_allclose(joined.variance[..., :3], expected.variance, rtol=1e-5)
    cut = Cut(3, 2, 8, 72)
    np.testing.assert_array_equal(assembled(cut, {0: tree}).mean, joined.mean)
    assert not assembled(cut, {0: Tree()}).mean.any()
