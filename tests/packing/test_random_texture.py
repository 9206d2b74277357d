# SPDX-License-Identifier: MIT
"""random_texture.py: scrambled nets with all of their stratification, alone and beside each other."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import qmc

from fragtracer.packing.random_texture import BITS, GROUP, LAYERS, WIDTH, _points, random_texture

POINTS = WIDTH * WIDTH
LEVELS = POINTS.bit_length() - 1


@pytest.fixture(scope="module")
def layers() -> NDArray[np.int64]:
    """The points as whole numbers below 2^BITS, (LAYERS, POINTS, 4)."""
    u = random_texture().reshape(LAYERS, POINTS, 4).astype(np.float64) - 1
    return (u * (1 << BITS)).astype(np.int64)


def box_counts(points: NDArray[np.integer], bits: tuple[int, ...]) -> NDArray[np.int64]:
    """How many points lie in each box of side 2^-bits, sorted."""
    box = np.zeros(len(points), np.int64)
    for coordinate, b in zip(points.T, bits, strict=True):
        box = (box << b) | (coordinate >> (BITS - b))
    return np.sort(np.bincount(box, minlength=1 << sum(bits)))


def test_pairs_are_sobol_points() -> None:
    """As scipy has them, which lists them in the order of the Gray code; in other orders of each aligned block."""
    index = np.arange(POINTS)
    sobol = np.empty((POINTS, 2))
    sobol[index ^ (index >> 1)] = qmc.Sobol(2, scramble=False, bits=BITS).random(POINTS)
    pairs = _points().reshape(POINTS, -1, 2).transpose(1, 0, 2) / 2**BITS
    np.testing.assert_array_equal(pairs[0], sobol)
    for pair in pairs:
        number = np.lexsort(pair.T)[np.argsort(np.lexsort(sobol.T))]  # where each point of Sobol's stands
        np.testing.assert_array_equal(pair[number], sobol)
        for level in range(LEVELS + 1):
            assert (number[: 1 << level] < 1 << level).all()


def test_format() -> None:
    texture = random_texture()
    assert texture.shape == (LAYERS, WIDTH, WIDTH, 4)
    assert texture.dtype == np.float32
    assert texture.min() >= 1
    assert texture.max() < 2


def test_same_seed_same_texture() -> None:
    np.testing.assert_array_equal(random_texture(3), random_texture(3))
    assert (random_texture(3) != random_texture(4)).mean() > 0.99


def test_layers_differ(layers: NDArray[np.int64]) -> None:
    assert len({layer.tobytes() for layer in layers}) == LAYERS


@pytest.mark.parametrize("level", range(LEVELS + 1))
def test_every_aligned_block_is_stratified(layers: NDArray[np.int64], level: int) -> None:
    """Each coordinate of each aligned block of 2^level points has one in every interval of 2^-level."""
    blocks = layers.reshape(LAYERS, -1, 1 << level, 4) >> (BITS - level)
    np.testing.assert_array_equal(
        np.sort(blocks, axis=2), np.broadcast_to(np.arange(1 << level)[:, None], blocks.shape)
    )


@pytest.mark.parametrize("level", [4, 6, 12])
def test_scrambling_keeps_the_net(layers: NDArray[np.int64], level: int) -> None:
    """Boxes of every shape hold as many points as those of the plain Sobol sequence: scrambling permutes boxes."""
    shapes = [bits for bits in product(range(level + 1), repeat=4) if sum(bits) == level]
    plain = _points()[: 1 << level].astype(np.int64)
    for number in range(0, LAYERS, 5 if level > 6 else 1):
        within = slice(4 * (number % GROUP), 4 * (number % GROUP) + 4)
        for bits in shapes:
            found = box_counts(layers[number, : 1 << level], bits)
            np.testing.assert_array_equal(found, box_counts(plain[:, within], bits))


@pytest.mark.parametrize("level", [4, 6, 12])
def test_scrambling_keeps_the_net_of_a_group(layers: NDArray[np.int64], level: int) -> None:
    """Boxes over a pair of coordinates of one layer and one of the next."""
    shapes = [bits for bits in product(range(0, level + 1, 2), repeat=4) if sum(bits) == level]
    plain = _points()[: 1 << level].astype(np.int64)
    for first in range(0, LAYERS, GROUP):
        group = np.concatenate(layers[first : first + GROUP], axis=1)[: 1 << level]
        for pairs in ([0, 1, 4, 5], [4, 5, 8, 9], [2, 3, 14, 15]):
            for bits in shapes:
                np.testing.assert_array_equal(box_counts(group[:, pairs], bits), box_counts(plain[:, pairs], bits))


@pytest.mark.parametrize("pair", [0, 2])
def test_pairs_are_nets(layers: NDArray[np.int64], pair: int) -> None:
    """(0, m, 2)-nets: one point in every box of area 1 / n."""
    for level in (4, 6, 12):
        for b in range(level + 1):
            for layer in layers:
                assert (box_counts(layer[: 1 << level, pair : pair + 2], (b, level - b)) == 1).all()


def test_mean(layers: NDArray[np.int64]) -> None:
    """The error of stratified numbers: 1 / sqrt(12) of an interval, over sqrt(n) of them."""
    error = (layers + 0.5).mean(axis=1) / (1 << BITS) - 0.5
    assert np.abs(error).max() < 4.5 / np.sqrt(12 * POINTS) / POINTS


def test_layers_are_independent(layers: NDArray[np.int64]) -> None:
    """Coordinates of two layers, paired by index, correlate no more than random ones."""
    u = layers.transpose(0, 2, 1).reshape(LAYERS * 4, POINTS) / (1 << BITS)
    correlation = np.corrcoef(u)[np.triu_indices(LAYERS * 4, 1)]
    assert np.abs(correlation).max() * np.sqrt(POINTS) < 5
