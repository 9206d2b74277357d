# SPDX-License-Identifier: MIT
"""Intersections agree with float64."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.doctor import Finding
from fragtracer.probe import probe

_SHAPES = [f"shape/{name}.glsl" for name in ("sphere", "plane", "flat")]
_FLATS = ("RECTANGLE", "DISK", "SINGLE_TRIANGLE")
_ROWS = 2**18
_TOLERANCE = 1e-4  # relative; grazing rays are left out


def findings(context: Any) -> Iterator[Finding]:
    rng = np.random.default_rng(3)
    origin = rng.normal(size=(_ROWS, 3)).astype(np.float32) * 3
    direction = rng.normal(size=(_ROWS, 3))
    direction = (direction / np.linalg.norm(direction, axis=1, keepdims=True)).astype(np.float32)
    center = rng.normal(size=(_ROWS, 3)).astype(np.float32)
    radius = np.exp(rng.uniform(-5, 3, _ROWS)).astype(np.float32)
    inputs = {"o": origin, "d": direction, "c": center, "r": radius}
    body = """
        bool is_front;
        s = sphere_intersect(c, r, o, d, is_front);
        p = plane_intersect(normalize(c), r, Ray(o, d));"""
    found = probe(context, _SHAPES, body, inputs, {"s": 1, "p": 1})
    o, d, c = (a.astype(np.float64) for a in (origin, direction, center))
    yield _compare("spheres", found["s"], *sphere_distance(o, d, c, radius.astype(np.float64)))
    normal = c / np.linalg.norm(c, axis=1, keepdims=True)
    slope = (normal * d).sum(1)
    distance = (radius - (normal * o).sum(1)) / slope
    yield _compare("planes", found["p"], np.where(distance > 0, distance, np.inf), np.abs(slope) < 1e-3)
    yield from _flat_findings(context, rng, origin, direction)


def _flat_findings(
    context: Any, rng: np.random.Generator, origin: NDArray[np.float32], direction: NDArray[np.float32]
) -> Iterator[Finding]:
    """Rectangles, disks and triangles, as large as the distance to them."""
    a = rng.normal(size=(_ROWS, 3)).astype(np.float32)
    u, v, _ = np.linalg.qr(rng.normal(size=(_ROWS, 3, 3))).Q.transpose(1, 0, 2) * rng.uniform(0.5, 3, (3, _ROWS, 1))
    b, c = (a + u).astype(np.float32), (a + v).astype(np.float32)
    body = "vec3 n = normalize(cross(b - a, c - a));" + "".join(
        f"{name.lower()} = flat_intersect(Flat(a, KIND_{name} << 24, b, 0u, c, 0u, n), Ray(o, d));" for name in _FLATS
    )
    inputs = {"o": origin, "d": direction, "a": a, "b": b, "c": c}
    found = probe(context, _SHAPES, body, inputs, {name.lower(): 1 for name in _FLATS})
    o, d, corner, at_u, at_v = (x.astype(np.float64) for x in (origin, direction, a, b, c))
    u, v = at_u - corner, at_v - corner
    normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v), axis=1, keepdims=True)
    slope = (normal * d).sum(1)
    distance = (normal * (corner - o)).sum(1) / slope
    p = o + distance[:, None] * d - corner
    x, y = ((p * w).sum(1) / (w * w).sum(1) for w in (u, v))
    beyond = {
        "RECTANGLE": np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) - 0.5,
        "DISK": np.hypot(x, y) - 1,
        "SINGLE_TRIANGLE": -np.minimum(np.minimum(x, y), 1 - x - y),
    }
    for name, outside in beyond.items():
        unclear = (np.abs(slope) < 1e-2) | (np.abs(outside) < 1e-3) | (np.abs(distance) < 1e-3)
        expected = np.where((distance > 0) & (outside < 0), distance, np.inf)
        subject = {"SINGLE_TRIANGLE": "triangles"}.get(name, f"{name.lower()}s")
        yield _compare(subject, found[name.lower()], expected, unclear)


def sphere_distance(
    o: NDArray[np.float64], d: NDArray[np.float64], c: NDArray[np.float64], r: NDArray[np.float64] | float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Distances (n,) from ``o`` along ``d`` (n, 3) to a sphere, infinite for a miss, and whether rounding of the inputs
    could change them much; ``o`` and ``c`` are (n, 3) or (3,)."""
    d = d / np.linalg.norm(d, axis=1, keepdims=True)
    b = ((c - o) * d).sum(1)
    off = np.linalg.norm(c - o - b[:, None] * d, axis=1)
    half = np.sqrt(np.maximum(0, r**2 - off**2))
    near = np.where(b - half > 0, b - half, b + half)
    size = np.linalg.norm(c - o, axis=-1) + r
    grazing = (np.abs(off - r) < 1e-3 * size) | (np.minimum(np.abs(b - half), np.abs(b + half)) < 1e-3 * size)
    return np.where((off < r) & (near > 0), near, np.inf), grazing


def _compare(
    name: str, found: NDArray[np.float32], expected: NDArray[np.float64], unclear: NDArray[np.bool_]
) -> Finding:
    hit = np.isfinite(expected)
    wrong = (found < 1e29) != hit
    both = hit & ~wrong
    wrong[both] = np.abs(found[both] - expected[both]) > _TOLERANCE * np.maximum(1, expected[both])
    count = int((wrong & ~unclear).sum())
    return Finding("intersections", name, count == 0, f"{count} of {int((~unclear).sum())} rays wrong")
