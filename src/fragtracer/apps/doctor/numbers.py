# SPDX-License-Identifier: MIT
"""Hashes and bit operations give exactly the numbers that numpy gives."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.doctor import Finding
from fragtracer.probe import probe

_CORE = ["core/math.glsl", "core/hash.glsl"]
_ROWS = 65536


def findings(context: Any) -> Iterator[Finding]:
    words = np.random.default_rng(1).integers(0, 2**32, (_ROWS, 4), dtype=np.uint32)
    halves = {"low": words & 0xFFFF, "high": words >> 16}  # each exact in float32
    join = "uvec4 v = uvec4(low) | (uvec4(high) << 16u);"
    found = probe(context, _CORE, f"{join} u = hash_to_unit(hash_pcg4d(v)); w = hash_to_unit(hash_uint(v.x));", halves,
                  {"u": 4, "w": 1})  # fmt: skip
    yield _exact("PCG hash in four dimensions", found["u"], _unit(_pcg4d(words)))
    yield _exact("32-bit hash", found["w"], _unit(_lowbias32(words[:, 0])))
    turns = np.linspace(0, 1, _ROWS, dtype=np.float32)
    found = probe(context, _CORE, "v = cos_sin_turns(t);", {"t": turns}, {"v": 2})
    angle = 2 * np.pi * turns.astype(np.float64)
    error = float(np.abs(found["v"] - np.stack([np.cos(angle), np.sin(angle)], 1)).max())
    yield Finding("numbers", "cosine and sine", error < 4e-7, f"largest error {error:.1e}")
    bits = "x = float(is_finite(f / g)) + 2.0 * float(is_finite(vec3(g / g, f, f)));"
    odd = {"f": np.array([1.0, 1.0, 3e38]), "g": np.array([1.0, 0.0, 1e-30])}
    flags = probe(context, _CORE, bits, odd, {"x": 1})["x"]
    yield Finding("numbers", "infinity and NaN are seen", list(flags) == [3.0, 0.0, 2.0], f"flags {flags.tolist()}")


def _exact(subject: str, found: NDArray[np.float32], expected: NDArray[np.float32]) -> Finding:
    wrong = int((found != expected).sum())
    return Finding("numbers", subject, wrong == 0, f"{wrong} of {expected.size} differ")


def _unit(bits: NDArray[np.uint32]) -> NDArray[np.float32]:
    return ((bits >> 9) * np.float32(2**-23)).astype(np.float32)


def _lowbias32(x: NDArray[np.uint32]) -> NDArray[np.uint32]:
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B), (16, 1)):
        x = np.asarray((x ^ (x >> shift)) * np.uint32(factor), np.uint32)
    return x


def _pcg4d(words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    v = words * np.uint32(1664525) + np.uint32(1013904223)
    for last in (False, True):
        for target, a, b in ((0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)):
            v[:, target] += v[:, a] * v[:, b]
        if not last:
            v ^= v >> 16
    return np.asarray(v, np.uint32)
