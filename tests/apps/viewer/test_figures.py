# SPDX-License-Identifier: MIT
"""What the viewer says of its pictures."""

import numpy as np
import pytest

from fragtracer.apps.compare.verdict import Means, scale_means
from fragtracer.apps.viewer.finding import judged
from fragtracer.apps.viewer.statistics import FilmStatistics
from fragtracer.sampling.pixels import Pixels


class FakeFilm:
    """Every pixel has the same mean and variance; those of the upper half are not all finite."""

    size = (4, 64)

    def __init__(self, spp: int, mean: float, variance: float) -> None:
        self._pixels = np.array([mean] * 3 + [spp]), np.array([variance] * 3 + [0])

    def read_rows(self, bottom: int, rows: int) -> Pixels:
        mean, variance = (np.tile(p.astype(np.float32), (rows, 4, 1)) for p in self._pixels)
        variance[np.arange(bottom, bottom + rows) >= 32, :, 3] = 2
        # As large a half-difference as independent samples have.
        error = np.sqrt(variance[..., :3] / np.maximum(mean[..., 3:] - 1, 1))
        return Pixels(mean, variance, error + mean[..., :3] * (mean[..., 3:] % 2) / np.maximum(mean[..., 3:], 1))


@pytest.mark.parametrize(("spp", "mean", "error"), [(0, 0.0, None), (1, 1.0, None), (101, 2.0, 0.05), (9, 0.0, None)])
def test_film_statistics_are_those_of_the_film(spp: int, mean: float, error: float | None) -> None:
    found = FilmStatistics()
    for _ in range(15):
        found.look(FakeFilm(spp, mean, 1.0))
    assert found.relative_error is None, "not before all of it was read"
    found.look(FakeFilm(spp, mean, 1.0))
    assert found.relative_error == (None if error is None else pytest.approx(error))
    assert found.non_finite == 2 * 4 * 32


def batches(rng: np.random.Generator, level: float = 1.0) -> list[Means]:
    """Means of noisy pictures of one brightness, but ``level`` times that in one block."""
    pictures = rng.gamma(2.0, 0.5, (16, 48, 48, 3))
    pictures[:, 8:12, 4:8] *= level
    return [scale_means(picture[None]) for picture in pictures]


def test_finding_says_where_pictures_differ() -> None:
    rng = np.random.default_rng(3)
    found = judged(batches(rng, 1.8), batches(rng))
    rows, columns, _ = np.nonzero(found.differs)
    assert {(int(r), int(c)) for r, c in zip(rows, columns, strict=True)} == {(2, 1)}
    assert found.outcome == "disagreement"
    assert found.z[2, 1].min() > 0, "ours is brighter"
    assert np.all(np.abs(found.z[found.differs]) >= found.critical)
    assert np.all(np.abs(found.z[~found.differs]) < found.critical)


def test_finding_is_none_too_often_in_equal_pictures() -> None:
    """At the level of 1 % for all looks together, forty comparisons find next to nothing."""
    rng = np.random.default_rng(4)
    assert sum(judged(batches(rng), batches(rng)).differing > 0 for _ in range(40)) <= 1
