# SPDX-License-Identifier: MIT
"""Search the orders of the pairs of coordinates of the random texture, `_ORDERS` of packing/random_texture.py.

    python scripts/point_set.py

A pair is the first two dimensions of the Sobol sequence, its points in the order U n, where n are the digits of the
index, and U an upper triangular matrix over GF(2) whose diagonal is 1. The matrices are drawn at random, one pair after
another, the best of some, and then changed digit by digit, as long as that lowers the sum of the errors of two and of
three pairs together. Such an error is the mean square one of digitally shifted nets over functions of a Sobolev space,
which has the kernel 1/6 - 2^(floor(log2 x) - 1) for each dimension (Dick and Pillichshammer 2005, Multivariate
Integration in Weighted Hilbert Spaces Based on Walsh Functions and Weighted Sobolev Spaces), without the functions of
fewer pairs; relative to that of independent points, and the mean of nets of 16 to 2048 points.
"""

from itertools import combinations
from math import prod

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing import random_texture

DIGITS = 12
# What the pairs are for, in their order in the texture, and how much they matter.
USES = {
    "camera": 1.0,
    "lens": 0.5,
    "BSDF 1": 1.0,
    "light 1": 1.0,
    "BSDF 2": 0.7,
    "light 2": 0.7,
    "BSDF 3": 0.4,
    "light 3": 0.4,
}
SIZES = 2 ** np.arange(4, 12)
DRAWN, CHANGED = 1000, 6000

Floats = NDArray[np.float64]
Matrix = NDArray[np.int64]


def main() -> None:
    rng = np.random.default_rng(0)
    orders: dict[str, Matrix] = {"camera": np.eye(DIGITS, dtype=np.int64)}
    kernels = {"camera": kernel(orders["camera"])}
    for use in ("BSDF 1", "light 1", "BSDF 2", "light 2", "lens", "BSDF 3", "light 3"):
        drawn = [drawn_order(rng) for _ in range(DRAWN)]
        orders[use] = min(drawn, key=lambda order: error({**kernels, use: kernel(order)}, use))
        kernels[use] = kernel(orders[use])
    for _ in range(CHANGED):
        use = list(USES)[rng.integers(1, len(USES))]
        order = orders[use].copy()
        for _ in range(rng.integers(1, 4)):
            column = rng.integers(1, DIGITS)
            order[rng.integers(0, column), column] ^= 1
        changed = kernels | {use: kernel(order)}
        if error(changed, use) < error(kernels, use):
            orders[use], kernels = order, changed
    print(f"# {sum(error(kernels, use) for use in USES):.4f}")
    for use in USES:
        print(f"    {tuple(int(column @ 2 ** np.arange(DIGITS)) for column in orders[use].T)},  # {use}")


def drawn_order(rng: np.random.Generator) -> Matrix:
    return np.triu(rng.integers(0, 2, (DIGITS, DIGITS)), 1) + np.eye(DIGITS, dtype=np.int64)


def kernel(order: Matrix) -> Floats:
    """Of the two coordinates of each point of a pair, without the constant function."""
    index = np.arange(SIZES[-1])
    digits = order @ (index >> np.arange(DIGITS)[:, None] & 1) % 2
    found = np.ones(len(index))
    for directions in random_texture.PAIR:
        x = np.bitwise_xor.reduce(digits * np.asarray(directions)[:, None], axis=0)
        level = np.floor(np.log2(np.maximum(x, 1))) - random_texture.BITS
        found *= 1 + np.where(x > 0, 1 - 6 * 2.0 ** (level - 1), 1)
    return found - 1


def error(kernels: dict[str, Floats], use: str) -> float:
    """Over all twos and threes of pairs, of which one is that for ``use``."""
    others = [other for other in USES if other in kernels and other != use]
    found = 0.0
    for count in (1, 2):
        for chosen in combinations(others, count):
            together = kernels[use] * prod(kernels[other] for other in chosen)
            weight = prod(USES[other] for other in (use, *chosen))
            found += weight * float(np.mean(np.cumsum(together)[SIZES - 1])) / 3.0 ** (count + 1)
    return found


if __name__ == "__main__":
    main()
