# SPDX-License-Identifier: MIT
"""Intersections in float64. Arguments broadcast, points are (..., 3); no hit is infinity.

Rays need not be of unit length: distances are in units of their direction. ``grow`` makes a shape
larger by that many metres, to ask what a rounding error may see.
"""

from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from . import Floats


def sphere(center: ArrayLike, radius: ArrayLike, origin: Floats, direction: Floats) -> Floats:
    """The smallest positive root of |o + t d - c|² = r²."""
    offset = np.asarray(origin, np.float64) - np.asarray(center, np.float64)
    direction = np.asarray(direction, np.float64)
    a, b = _dot(direction, direction), _dot(offset, direction)
    # r² - |o - c|² + b² / a, through the foot of the perpendicular, as the difference of large numbers is not exact.
    foot = offset - direction * (b / a)[..., None]
    radius = np.asarray(radius, np.float64)
    discriminant = (radius**2 - _dot(foot, foot)) / a
    half = np.sqrt(np.where(discriminant >= 0, discriminant, np.nan))
    return _first_positive(-b / a - half, -b / a + half)


def plane(point: ArrayLike, normal: ArrayLike, origin: Floats, direction: Floats) -> Floats:
    normal = np.asarray(normal, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        return _first_positive(_dot(np.asarray(point, np.float64) - origin, normal) / _dot(normal, direction))


def rectangle(
    corner: ArrayLike, edge_u: ArrayLike, edge_v: ArrayLike, origin: Floats, direction: Floats, grow: float = 0.0
) -> Floats:
    corner, u, v = (np.asarray(x, np.float64) for x in (corner, edge_u, edge_v))
    distance = plane(corner, np.cross(u, v), origin, direction)
    place = _at(origin, direction, distance) - corner
    inside = np.ones(distance.shape, bool)
    for edge in (u, v):
        length = np.sqrt(_dot(edge, edge))
        along = _dot(place, edge) / length
        inside &= (along >= -grow) & (along <= length + grow)
    return np.where(inside, distance, np.inf)


def disk(
    center: ArrayLike, normal: ArrayLike, radius: ArrayLike, origin: Floats, direction: Floats, grow: float = 0.0
) -> Floats:
    center = np.asarray(center, np.float64)
    distance = plane(center, normal, origin, direction)
    out = _at(origin, direction, distance) - center
    return np.where(np.sqrt(_dot(out, out)) <= np.asarray(radius, np.float64) + grow, distance, np.inf)


def triangle(vertices: ArrayLike, origin: Floats, direction: Floats, grow: float | Floats = 0.0) -> Floats:
    distance, margin = triangle_margin(vertices, origin, direction)
    return np.where(margin >= -np.asarray(grow), distance, np.inf)


def triangle_margin(vertices: ArrayLike, origin: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Distance to the plane, and how far to the left of all three sides the point there lies."""
    a, b, c = np.moveaxis(np.asarray(vertices, np.float64), -2, 0)
    normal = np.cross(b - a, c - a)
    distance = plane(a, normal, origin, direction)
    place = _at(origin, direction, distance)
    margin = np.full(distance.shape, np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        inward = np.cross(normal, end - start)
        inward /= np.sqrt(_dot(inward, inward))[..., None]
        np.minimum(margin, _dot(place - start, inward), out=margin)
    return distance, margin


def _at(origin: Floats, direction: Floats, distance: Floats) -> Floats:
    return origin + np.where(np.isfinite(distance), distance, 0)[..., None] * direction


def _first_positive(*roots: Floats) -> Floats:
    """The least of the roots above 0; those that are NaN do not count."""
    return reduce(np.minimum, (np.where(np.isfinite(r) & (r > 0), r, np.inf) for r in roots))


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("...x,...x->...", a, b)
    return product
