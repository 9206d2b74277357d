# SPDX-License-Identifier: MIT
"""The random-vector 3D texture: every random number of the path tracer, made once on the CPU.

Each layer is an independent Owen-scrambled Sobol set of four dimensions (Owen 1998, Scrambling
Sobol' and Niederreiter-Xing Points), its points put in an independent nested-uniform random order,
so that the layers, used side by side for the dimensions of one path, are not correlated although
each keeps the stratification of its aligned power-of-two blocks (Burley 2020, Practical Hash-based
Owen Scrambling, section 5). Counterpart in the shader: sampler/texture.glsl.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

WIDTH = 64
LAYERS = 16
BITS = 23

_POINT_BITS = (WIDTH * WIDTH).bit_length() - 1
# Joe and Kuo 2008, Constructing Sobol Sequences with Better Two-Dimensional Projections: degree,
# polynomial and initial numbers of dimensions 2 to 4; dimension 1 is van der Corput's.
_POLYNOMIALS = ((1, 0, (1,)), (2, 1, (1, 3)), (3, 1, (1, 3, 1)))


def random_texture(seed: int = 0) -> NDArray[np.float32]:
    """Points for the sampler texture.

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
    sobol = _sobol_points()
    texture = np.empty((LAYERS, WIDTH * WIDTH, 4), np.float32)
    for layer in texture:
        order = _scramble(np.arange(WIDTH * WIDTH, dtype=np.uint32)[:, None], _POINT_BITS, rng)[:, 0]
        layer[:] = 1 + _scramble(sobol[order], BITS, rng) / np.float32(1 << BITS)
    return texture.reshape(LAYERS, WIDTH, WIDTH, 4)


def recipe() -> dict[str, Any]:
    """What it takes to make the texture of seed 0 elsewhere: the state of PCG64 (O'Neill 2014), as decimal digits, and
    the direction numbers."""
    state = np.random.PCG64(0).state["state"]
    return {
        "state": str(state["state"]),
        "increment": str(state["inc"]),
        "directions": [_directions(dimension) for dimension in range(4)],
        "bits": BITS,
        "width": WIDTH,
        "layers": LAYERS,
    }


def _sobol_points() -> NDArray[np.uint32]:
    """The first WIDTH² points of the four-dimensional Sobol sequence, (WIDTH², 4), in BITS bits."""
    index = np.arange(WIDTH * WIDTH, dtype=np.uint32)
    points = np.zeros((WIDTH * WIDTH, 4), np.uint32)
    for dimension in range(4):
        for bit, direction in enumerate(_directions(dimension)):
            points[:, dimension] ^= (index >> bit & 1) * np.uint32(direction)
    return points


def _directions(dimension: int) -> list[int]:
    """Direction numbers of one dimension, one for each bit of the point index."""
    if dimension == 0:
        return [1 << (BITS - 1 - i) for i in range(_POINT_BITS)]
    degree, polynomial, initial = _POLYNOMIALS[dimension - 1]
    m = list(initial)
    for i in range(degree, _POINT_BITS):
        value = m[i - degree] ^ (m[i - degree] << degree)
        for k in range(1, degree):
            if polynomial >> (degree - 1 - k) & 1:
                value ^= m[i - k] << k
        m.append(value)
    return [m[i] << (BITS - 1 - i) for i in range(_POINT_BITS)]


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
