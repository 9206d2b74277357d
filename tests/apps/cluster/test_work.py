# SPDX-License-Identifier: MIT
"""How a picture is cut, and put together by a tree that is always the same."""

import numpy as np

from fragtracer.apps.cluster import work
from fragtracer.apps.cluster.work import Cut, Tree, assembled
from fragtracer.sampling.merging import Moments
from fragtracer.sampling.pixels import Pixels


def test_every_sample_is_cut_once(monkeypatch) -> None:
    monkeypatch.setattr(work, "TILE", 16)
    cut = Cut(40, 20, samples=8, spp=21)
    seen = np.zeros((20, 40, 21), int)
    numbers = []
    for block in cut.blocks():
        w = cut.tiles[block.tile]
        first = block.number * cut.samples
        seen[w.top : w.top + w.height, w.left : w.left + w.width, first : first + block.spp] += 1
        numbers.append(block.number)
    assert (seen == 1).all()
    assert numbers == sorted(numbers)  # the first blocks of all tiles come first
    assert cut.rounds == 3
    endless = Cut(40, 20, samples=8).blocks()
    assert [next(endless).number for _ in range(13)] == [0] * 6 + [1] * 6 + [2]


def _pixels(rng: np.random.Generator, count: int) -> Pixels:
    images = [rng.exponential(size=(2, 3, n)).astype(np.float32) for n in (4, 4, 3)]
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
