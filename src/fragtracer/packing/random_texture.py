# SPDX-License-Identifier: MIT
"""The random-vector 3D texture: every random number of the path tracer, made once on the CPU.

GROUP layers hold a point set of 4 GROUP dimensions, for the camera and the first vertices of a path together, or for
the next. It consists of pairs of coordinates. Each pair is the first two dimensions of the Sobol sequence, a (0,
2)-sequence in base 2, with its points in an order of its own, a linear map of the digits of their index that keeps
aligned power-of-two blocks: so the pairs, side by side, may be spread evenly over all of their dimensions too. Each
coordinate is Owen-scrambled (Owen 1998, Scrambling Sobol' and Niederreiter-Xing Points), and the points of a group are
put in a nested-uniform random order, so that groups are not correlated although each keeps its stratification (Burley
2020, Practical Hash-based Owen Scrambling, section 5). Counterpart in the shader: sampler/texture.glsl.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

WIDTH = 64
LAYERS = 16
GROUP = 4
BITS = 23

_POINT_BITS = (WIDTH * WIDTH).bit_length() - 1
# Direction numbers of a pair, one for each bit of the point index: of van der Corput's sequence, and of the second
# dimension of Sobol 1967, where each adds, without carry, the one before, shifted by a digit.
_SECOND = [1]
for _ in range(_POINT_BITS - 1):
    _SECOND.append(_SECOND[-1] << 1 ^ _SECOND[-1])
PAIR = [[m << BITS - 1 - i for i, m in enumerate(row)] for row in ([1] * _POINT_BITS, _SECOND)]
# The order of each pair: by the digits of the index, the lowest first, what each adds to it, without carry. Found by
# scripts/point_set.py.
_ORDERS = (
    (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048),
    (1, 2, 4, 10, 19, 32, 94, 171, 302, 575, 1954, 2403),
    (1, 2, 6, 15, 28, 33, 94, 238, 463, 899, 1577, 3091),
    (1, 3, 5, 11, 26, 49, 96, 206, 452, 712, 1664, 3515),
    (1, 3, 7, 12, 27, 38, 92, 194, 416, 643, 1662, 2616),
    (1, 2, 5, 9, 25, 59, 69, 136, 337, 688, 1733, 3122),
    (1, 2, 7, 15, 24, 53, 127, 131, 505, 541, 1810, 2214),
    (1, 2, 7, 12, 17, 34, 114, 174, 507, 857, 1722, 3542),
)


@cache
def random_texture(seed: int = 0) -> NDArray[np.float32]:
    """Points for the sampler texture, read-only.

    Parameters
    ----------
    seed
        Of the scrambling; the renderer keeps 0 and varies images by a hash instead.

    Returns
    -------
    float32 array (LAYERS, WIDTH, WIDTH, 4)
        Coordinates plus one, in [1, 2): the mantissa of each float holds its 23 binary digits.
    """
    rng = np.random.default_rng(seed)
    points = _points()
    texture = np.empty((LAYERS, WIDTH * WIDTH, 4), np.float32)
    for first in range(0, LAYERS, GROUP):
        order = _scramble(np.arange(WIDTH * WIDTH, dtype=np.uint32)[:, None], _POINT_BITS, rng)[:, 0]
        for layer in range(GROUP):
            coordinates = points[order, 4 * layer : 4 * layer + 4]
            texture[first + layer] = 1 + _scramble(coordinates, BITS, rng) / np.float32(1 << BITS)
    texture.flags.writeable = False
    return texture.reshape(LAYERS, WIDTH, WIDTH, 4)


def recipe() -> dict[str, Any]:
    """What it takes to make the texture of seed 0 elsewhere: the state of PCG64 (O'Neill 2014), as decimal digits, and
    the direction numbers."""
    state = np.random.PCG64(0).state["state"]
    return {
        "state": str(state["state"]),
        "increment": str(state["inc"]),
        "directions": _directions(),
        "bits": BITS,
        "width": WIDTH,
        "layers": LAYERS,
        "group": GROUP,
    }


def _points() -> NDArray[np.uint32]:
    """The points of a group before scrambling, (WIDTH², 4 GROUP), in BITS bits."""
    index = np.arange(WIDTH * WIDTH, dtype=np.uint32)
    points = np.zeros((WIDTH * WIDTH, 4 * GROUP), np.uint32)
    for dimension, directions in enumerate(_directions()):
        for bit, direction in enumerate(directions):
            points[:, dimension] ^= (index >> bit & 1) * np.uint32(direction)
    return points


def _directions() -> list[list[int]]:
    """Direction numbers of each dimension, one for each bit of the point index."""
    return [[_sum(directions, digits) for digits in order] for order in _ORDERS for directions in PAIR]


def _sum(directions: list[int], digits: int) -> int:
    """Those of the ``digits`` that are 1, without carry."""
    found = 0
    for bit, direction in enumerate(directions):
        found ^= direction * (digits >> bit & 1)
    return found


def _scramble(values: NDArray[np.uint32], bits: int, rng: np.random.Generator) -> NDArray[np.uint32]:
    """Nested uniform scrambling of each column of ``values`` (n, d), whole numbers below 2^bits of
    which every column holds each combination of the upper log2(n) bits once: there, a bit is
    flipped or not by a coin of its own for each combination of the bits above it; the bits below
    are alone under theirs and so simply random (Owen 1995, Randomly Permuted (t,m,s)-Nets)."""
    lower = np.uint32(bits - _POINT_BITS)
    result = rng.integers(0, 1 << int(lower), values.shape, dtype=np.uint32)
    coins = rng.integers(0, 2, (values.shape[1], (1 << _POINT_BITS) - 1), dtype=np.uint32)  # level by level
    flips = np.zeros((values.shape[1], 1), np.uint32)  # by the bits of the levels so far
    for level in range(_POINT_BITS):
        above = (1 << level) - 1
        flips = np.repeat(flips << 1 | coins[:, above : above + (1 << level)], 2, axis=1)
    upper = values >> lower
    flipped = upper ^ np.take_along_axis(flips.T, upper.astype(np.int64), axis=0)
    return result | flipped << lower
