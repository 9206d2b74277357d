# SPDX-License-Identifier: MIT
"""Meshes that tests are made of, as arrays of points (n, 3) and triangles (m, 3), counter-clockwise from outside."""

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene import Geometry, Material, Mesh, Part, Placement, Scene

Arrays = tuple[NDArray[np.float64], NDArray[np.int64]]


def grid(columns: int, rows: int) -> NDArray[np.int64]:
    """Two triangles for each cell of (columns + 1) x (rows + 1) points, those of a column one after the other."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij"))
    a, b, c, d = ((i + k) * (rows + 1) + j + m for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def ball(columns: int = 24, rows: int = 12) -> Arrays:
    """A sphere of radius 1: closed, its poles and its seam welded."""
    u, v = np.meshgrid(np.arange(columns) / columns, np.arange(rows + 1) / rows, indexing="ij")
    theta, phi = np.pi * v, -2 * np.pi * u
    points = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1)
    number = np.arange(columns * (rows + 1)).reshape(columns, rows + 1)
    number[:, 0], number[:, -1] = number[0, 0], number[0, -1]
    number = np.concatenate([number, number[:1]]).ravel()
    triangles = number[grid(columns, rows)][:, ::-1]
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return points.reshape(-1, 3), triangles[proper]


def field(side: int, seed: int = 1) -> Arrays:
    """Hills over the square from -1 to 1 of x and z, their front above."""
    x, z = np.meshgrid(*[np.linspace(-1, 1, side + 1)] * 2, indexing="ij")
    a, b, c = np.random.default_rng(seed).uniform(2, 9, 3)
    y = 0.1 * np.sin(a * x + b * z) + 0.05 * np.cos(c * x * z + a)
    return np.stack([x, y, z], -1).reshape(-1, 3), grid(side, side)[:, ::-1]


def soup(count: int, seed: int = 1, size: float = 0.1) -> Arrays:
    """Triangles anywhere in a cube, their sizes spread over a hundredfold."""
    rng = np.random.default_rng(seed)
    sizes = size * 10 ** rng.uniform(-2, 0, (count, 1, 1))
    points = rng.uniform(-1, 1, (count, 1, 3)) + sizes * rng.normal(size=(count, 3, 3))
    return points.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def geometry(arrays: Arrays, **attributes: object) -> Geometry:
    return Geometry(*arrays, **attributes)  # type: ignore[arg-type]


def smooth(arrays: Arrays) -> Geometry:
    """With normals that are the mean of those around each vertex, by area."""
    points, triangles = arrays
    a, b, c = points[triangles].swapaxes(0, 1)
    normals = np.zeros(points.shape)
    for corner in triangles.T:
        np.add.at(normals, corner, np.cross(b - a, c - a))
    return Geometry(points, triangles, normals)


def mesh_scene(*geometries: Geometry, material: Material | None = None, **fields: object) -> Scene:
    """Each geometry once, all of one material called "mesh"."""
    materials = {"mesh": material or Material()}
    meshes = tuple(Mesh((Part(g, "mesh"),), (Placement(),)) for g in geometries)
    return Scene(**({"materials": materials, "meshes": meshes} | fields))  # type: ignore[arg-type]
