# SPDX-License-Identifier: MIT
"""Tangents of meshes without them."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene.mesh import Geometry

_KEPT = 64


@lru_cache(_KEPT)
def with_tangents(geometry: Geometry, coordinates: int = 0) -> Geometry:
    """The geometry with tangents computed from its set ``coordinates`` of texture coordinates.

    As in MikkTSpace, which glTF 2.0 (section 3.7.2.1) asks for: the tangent of a vertex is the mean of
    the ∂p/∂u of its triangles, each projected onto the plane of the vertex normal and weighted by the
    angle of the triangle at the vertex; vertices shared by triangles of mirrored and unmirrored
    coordinates are split. The bitangent points to the upper edge of the image. A geometry with
    tangents, or without those coordinates, is returned as it is.
    """
    uvs = (geometry.uvs, geometry.uvs_1)[coordinates]
    if uvs is None or geometry.tangents is not None or not len(geometry.triangles):
        return geometry
    triangles = geometry.triangles
    corners = geometry.positions[triangles]
    along, signs = _face_tangents(corners, uvs[triangles].astype(np.float64))
    normals = _corner_normals(geometry, corners)
    flat = along[:, None] - normals * (normals * along[:, None]).sum(axis=2, keepdims=True)
    keys, inverse = np.unique(2 * triangles + (signs < 0)[:, None], return_inverse=True)
    sums = np.zeros((len(keys), 3))
    np.add.at(sums, inverse.ravel(), (_unit(flat) * _angles(corners)[..., None]).reshape(-1, 3))
    tangents = np.column_stack([_unit(sums), np.where(keys % 2, -1.0, 1.0)])
    vertices = keys // 2

    def split(attribute: NDArray[Any] | None) -> NDArray[Any] | None:
        return None if attribute is None else attribute[vertices]

    return Geometry(
        geometry.positions[vertices],
        inverse.reshape(-1, 3),
        split(geometry.normals),
        split(geometry.uvs),
        split(geometry.uvs_1),
        tangents,
        split(geometry.colors),
    )


def _face_tangents(corners: NDArray[np.float64], uvs: NDArray[np.float64]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The direction in which u grows on each triangle (n, 3), of any length, and the sign of the bitangent:
    where the front shows the image unmirrored, the corners run clockwise in (u, v), as v runs downwards."""
    edges, steps = corners[:, 1:] - corners[:, :1], uvs[:, 1:] - uvs[:, :1]
    area = steps[:, 0, 0] * steps[:, 1, 1] - steps[:, 1, 0] * steps[:, 0, 1]
    along = steps[:, 1, 1, None] * edges[:, 0] - steps[:, 0, 1, None] * edges[:, 1]
    return along * np.sign(area)[:, None], np.where(area > 0, -1.0, 1.0)


def _corner_normals(geometry: Geometry, corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3, 3) unit normals at the corners."""
    if geometry.normals is not None:
        return _unit(geometry.normals[geometry.triangles])
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.repeat(_unit(faces)[:, None], 3, axis=1)


def _angles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3) angles of the triangles at their corners, in radians."""
    after, before = _unit(np.roll(corners, -1, axis=1) - corners), _unit(np.roll(corners, 1, axis=1) - corners)
    angles: NDArray[np.float64] = np.arccos(np.clip((after * before).sum(axis=2), -1, 1))
    return angles


def _unit(vectors: NDArray[Any]) -> NDArray[np.float64]:
    """Vectors of length 1; those of length 0 stay."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: NDArray[np.float64] = vectors / np.where(size > 0, size, 1)
    return result
