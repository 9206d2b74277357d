# SPDX-License-Identifier: MIT
"""Meshes of patches: grids over the unit square, bent in space by a function of u and v, with normals from its
derivatives."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]
Surface = Callable[[Array, Array], Array]  # u, v -> points with x, y, z last
Mesh = tuple[Array, Array, Array, NDArray[np.int64]]  # positions, normals, texture coordinates, triangles

_STEP = 1e-5  # of the derivatives


def patch(surface: Surface, columns: int, rows: int) -> Mesh:
    """The front is where u × v points to."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    inner_u, inner_v = np.clip(u, 2 * _STEP, 1 - 2 * _STEP), np.clip(v, 2 * _STEP, 1 - 2 * _STEP)  # off the poles
    along_u = surface(inner_u + _STEP, inner_v) - surface(inner_u - _STEP, inner_v)
    along_v = surface(inner_u, inner_v + _STEP) - surface(inner_u, inner_v - _STEP)
    normals = np.cross(along_u, along_v).reshape(-1, 3)
    positions = surface(u, v).reshape(-1, 3)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    a, b, c, d = first, first + 1, first + columns + 2, first + columns + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    corners = positions[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    uvs = np.stack([u, 1 - v], -1).reshape(-1, 2)
    return positions, normals / np.linalg.norm(normals, axis=1, keepdims=True), uvs, triangles[areas > 1e-14]


def joined(*meshes: Mesh) -> Mesh:
    ends = np.cumsum([0, *(len(m[0]) for m in meshes)])
    triangles = [m[3] + start for m, start in zip(meshes, ends, strict=False)]
    positions, normals, uvs = (np.concatenate([m[i] for m in meshes]) for i in range(3))
    return positions, normals, uvs, np.concatenate(triangles)


def curve(points: ArrayLike, closed: bool = False) -> Callable[[Array], Array]:
    """A smooth curve through ``points`` (n, k), its parameter from 0 to 1 nearly proportional to its length."""
    knots = np.asarray(points, np.float64)
    if closed:
        knots = np.concatenate([knots, knots[:1]])
    lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1) ** 0.75)])
    spline = CubicSpline(lengths / lengths[-1], knots, bc_type="periodic" if closed else "natural")
    return lambda t: np.asarray(spline(t))


def lathe(profile: ArrayLike, columns: int, rows: int, shape: Surface | None = None) -> Mesh:
    """Turns a profile of (radius, height), from the bottom up along the outside, about the y axis.

    ``shape`` gives factors of the radius and the height, and a shift along x, for turned things that grew.
    """
    line = curve(profile)

    def surface(u: Array, v: Array) -> Array:
        radius, height = np.moveaxis(line(v), -1, 0)
        radius = np.maximum(radius, 0)
        shift = 0.0
        if shape:
            wide, tall, shift = np.moveaxis(shape(u, v), -1, 0)
            radius, height = radius * wide, height * tall
        angle = 2 * np.pi * u
        return np.stack([radius * np.sin(angle) + shift, height, radius * np.cos(angle)], -1)

    return patch(surface, columns, rows)


def tube(path: ArrayLike, radii: ArrayLike, columns: int, rows: int, hollow: bool = False) -> Mesh:
    """A tube along a path in the xy plane; a hollow one turns inside at its end."""
    line, radius = curve(path), curve(np.reshape(radii, (-1, 1)))

    def surface(u: Array, v: Array) -> Array:
        t = np.where(v < 0.85, v / 0.85, 1 - (v - 0.85) * 2) if hollow else v
        inside = 0.75 + 0.25 * np.cos(np.pi * np.clip((v - 0.82) / 0.06, 0, 1)) if hollow else 1.0
        middle = np.clip(t, 1e-4, 1 - 1e-4)
        ahead = line(middle + 1e-4) - line(middle - 1e-4)
        ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
        side = np.stack([-ahead[..., 1], ahead[..., 0]], -1)
        wide = (radius(t)[..., 0] * inside)[..., None]
        angle = (2 * np.pi * u)[..., None]
        flat = line(t) + wide * np.cos(angle) * side
        return np.concatenate([flat, wide * np.sin(angle)], -1)

    return patch(surface, columns, rows)
