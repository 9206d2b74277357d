# SPDX-License-Identifier: MIT
"""core/hash.glsl: the hashes are those of their papers, and fill [0, 1) without its end."""

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.probe import probe

from .chi_square import assert_uniform

Words = NDArray[np.uint32]
EXTREME = np.array([0, 1, 0x1FF, 0x200, 0x7FFFFFFF, 0x80000000, 0xFFFFFE00, 0xFFFFFFFE, 0xFFFFFFFF], np.uint32)

# A float column carries 16 bits exactly; results come back in halves, as words may look like NaN.
_WORDS = "uvec4 v = (uvec4(high) << 16u) | uvec4(low);"


def halves(words: Words) -> dict[str, NDArray[np.float32]]:
    return {"high": (words >> 16).astype(np.float32), "low": (words & 0xFFFF).astype(np.float32)}


def hash_pcg4d(v: Words) -> Words:
    """Jarzynski and Olano 2020, in numpy, (n, 4)."""
    v = v * np.uint32(1664525) + np.uint32(1013904223)
    for round_ in range(2):
        for a, b, c in ((0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)):
            v[:, a] += v[:, b] * v[:, c]
        if round_ == 0:
            v ^= v >> np.uint32(16)
    return v


def hash_uint(x: Words) -> Words:
    """Wellons' lowbias32, in numpy."""
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
        x = (x ^ (x >> np.uint32(shift))) * np.uint32(factor)
    return x ^ (x >> np.uint32(16))


def words(seed: int) -> Words:
    """Counting numbers, random ones and extremes, (n, 4)."""
    rng = np.random.default_rng(seed)
    random = rng.integers(0, 1 << 32, (1 << 14, 4), dtype=np.uint32)
    counting = np.column_stack([np.arange(1 << 12)] * 4).astype(np.uint32)
    return np.concatenate([random, counting, np.column_stack([EXTREME] * 4), rng.choice(EXTREME, (1 << 12, 4))])


def test_hashes_are_those_of_their_papers(ctx: moderngl.Context) -> None:
    v = words(1)
    body = f"""{_WORDS}
        uvec4 h = hash_pcg4d(v); high4 = vec4(h >> 16u); low4 = vec4(h & 0xffffu);
        uint g = hash_uint(v.x); high1 = float(g >> 16u); low1 = float(g & 0xffffu);"""
    result = probe(ctx, ["core/hash.glsl"], body, halves(v), {"high4": 4, "low4": 4, "high1": 1, "low1": 1})
    whole = {k: (result[f"high{k}"].astype(np.uint32) << 16) | result[f"low{k}"].astype(np.uint32) for k in "14"}
    np.testing.assert_array_equal(whole["4"], hash_pcg4d(v))
    np.testing.assert_array_equal(whole["1"], hash_uint(v[:, 0]))


def test_unit_numbers(ctx: moderngl.Context) -> None:
    """The upper 23 bits over 2^23, exactly, for every pattern."""
    v = words(2)
    outputs = {"four": 4, "one": 1}
    result = probe(
        ctx, ["core/hash.glsl"], f"{_WORDS} four = hash_to_unit(v); one = hash_to_unit(v.x);", halves(v), outputs
    )
    np.testing.assert_array_equal(result["four"], (v >> 9) / np.float32(1 << 23))
    np.testing.assert_array_equal(result["one"], (v[:, 0] >> 9) / np.float32(1 << 23))
    assert result["four"].max() == 1 - 2**-23


def test_counting_hashes_to_uniform_numbers(ctx: moderngl.Context) -> None:
    """Of each input alone, the others held: numbers, and pairs of them."""
    count = np.arange(1 << 20, dtype=np.uint32)
    for lane in range(4):
        v = np.full((len(count), 4), 12345, np.uint32)
        v[:, lane] = count
        u = probe(ctx, ["core/hash.glsl"], f"{_WORDS} u = hash_to_unit(hash_pcg4d(v));", halves(v), {"u": 4})["u"]
        numbers = {f"{i}": u[:, i] for i in range(4)}
        pairs = {f"{i}, {j}": u[:, [i, j]] for i in range(4) for j in range(i)}
        in_turn = {f"{i}, next": np.column_stack([u[:-1, i], u[1:, i]])[::2] for i in range(4)}
        assert_uniform(numbers | pairs | in_turn)
