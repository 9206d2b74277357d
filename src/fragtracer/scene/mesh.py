# SPDX-License-Identifier: MIT
"""Triangle meshes and their instances."""

from collections.abc import Iterator
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator
from pydantic.dataclasses import dataclass

from fragtracer.scene.content import Content, content_digest, read_only
from fragtracer.scene.fields import CONFIG, LARGEST, Number, Scale, Vector, as_tuple, as_vector


class Geometry(Content):
    """An indexed triangle mesh; two are equal if their content is.

    Parameters
    ----------
    positions
        (vertices, 3) metres.
    triangles
        (triangles, 3) indices of vertices, counter-clockwise seen from the front.
    normals
        (vertices, 3) shading normals of any length; left out, each triangle is flat.
    uvs, uvs_1
        (vertices, 2) first and second set of texture coordinates; (0, 0) is the upper left corner
        of an image.
    tangents
        (vertices, 4) tangent and the sign of the bitangent, as in glTF; left out, they are computed from ``uvs``.
    colors
        (vertices, 3 or 4) linear Rec. 709 that multiplies the albedo, and alpha.

    Raises
    ------
    ValueError
        If an array has another shape or kind, a number is not finite, or an index has no vertex.
    """

    def __init__(
        self,
        positions: ArrayLike,
        triangles: ArrayLike,
        normals: ArrayLike | None = None,
        uvs: ArrayLike | None = None,
        uvs_1: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
        colors: ArrayLike | None = None,
    ) -> None:
        self.positions = _frozen(positions, np.float64, (3,), "positions")
        count = len(self.positions)
        indices = _table(triangles, (3,), "triangles")
        if indices.size and not (indices.dtype.kind in "iu" and indices.min() >= 0 and indices.max() < count):
            raise ValueError(f"triangles must hold whole numbers from 0 to {count - 1}, the last of the vertices")
        self.triangles = read_only(indices, np.int32)
        self.normals = _attribute(normals, (3,), "normals", count)
        self.uvs = _attribute(uvs, (2,), "uvs", count)
        self.uvs_1 = _attribute(uvs_1, (2,), "uvs_1", count)
        self.tangents = _attribute(tangents, (4,), "tangents", count)
        self.colors = _attribute(colors, (3, 4), "colors", count)
        if isinstance(colors, np.ndarray) and colors.dtype == np.uint8:
            raise ValueError("colors must be linear, from 0 to 1, not bytes; divide by 255 and decode sRGB")
        attributes = (self.normals, self.uvs, self.uvs_1, self.tangents, self.colors)
        self.digest = content_digest(self.positions, self.triangles, *attributes)

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) minimum and maximum corner of the axis-aligned bounding box of the triangles; there must be one."""
        used = self.positions[self.triangles.ravel()] if len(self.positions) else self.positions
        return np.stack([used.min(axis=0), used.max(axis=0)])


def _attribute(values: ArrayLike | None, widths: tuple[int, ...], name: str, count: int) -> NDArray[Any] | None:
    if values is None:
        return None
    array = _frozen(values, np.float32, widths, name)
    if len(array) != count:
        raise ValueError(f"{name} must have a row for each of the {count} vertices, got {len(array)}")
    return array


def _table(values: ArrayLike, widths: tuple[int, ...], name: str) -> NDArray[Any]:
    """``values`` as they are, if they are rows of numbers."""
    shape = f"{name} must be an array of (n, {' or '.join(map(str, widths))})"
    try:
        given = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"{shape}, its rows all of a length") from error
    if given.ndim != 2 or given.shape[1] not in widths:
        raise ValueError(f"{shape}, got {given.shape}")
    if given.dtype.kind not in "iuf":
        raise ValueError(f"{name} must hold numbers, got {given.dtype}")
    return given


def _frozen(values: ArrayLike, dtype: Any, widths: tuple[int, ...], name: str) -> NDArray[Any]:
    array = read_only(_table(values, widths, name), dtype)
    if not (np.isfinite(array).all() and np.abs(array).max(initial=0) <= LARGEST):
        raise ValueError(f"{name} must be finite, and none beyond {LARGEST}")
    return array


def _as_rows(value: Any) -> Any:
    rows = as_vector(value)
    return tuple(map(as_vector, rows)) if isinstance(rows, tuple) else rows


AnimationName = Annotated[str, BeforeValidator(lambda value: str(value) if type(value) is int else value)]
Row = tuple[Number, Number, Number, Number]
Matrix = Annotated[tuple[Row, Row, Row, Row], BeforeValidator(_as_rows)]
IDENTITY: Matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@dataclass(frozen=True, config=CONFIG)
class Placement:
    """The transform of an instance: scale, then rotation about the x, y and z axes of the world in this order,
    then translation."""

    translation: Vector = (0.0, 0.0, 0.0)
    rotation_degrees: Vector = (0.0, 0.0, 0.0)
    scale: Scale = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        if 0.0 in self.scale:
            raise ValueError("scale must not be 0 along any axis")

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(4, 4) float64, object space to world space."""
        x, y, z = np.radians(self.rotation_degrees)
        cx, cy, cz, sx, sy, sz = np.cos(x), np.cos(y), np.cos(z), np.sin(x), np.sin(y), np.sin(z)
        about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
        about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
        about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
        result = np.eye(4)
        result[:3, :3] = about_z @ about_y @ about_x @ np.diag(self.scale)
        result[:3, 3] = self.translation
        return result


@dataclass(frozen=True, config=CONFIG)
class Part:
    """Triangles of one material. ``matrix`` takes them to the object space of the mesh, as a glTF node does."""

    geometry: Geometry
    material: str
    matrix: Matrix = IDENTITY

    def __post_init__(self) -> None:
        if self.matrix[3] != IDENTITY[3]:
            raise ValueError(f"the last row of matrix must be 0 0 0 1, got {self.matrix[3]}")


@dataclass(frozen=True, config=CONFIG)
class Pose:
    """A model as an ``animation`` of its file, by name or by number from 0 on, has it at ``time``, in seconds; where
    that is left out, the animation plays in the frames of a film, and a picture shows its beginning."""

    animation: AnimationName
    time: Number | None = None


@dataclass(frozen=True, config=CONFIG)
class Mesh:
    """A mesh of one or more parts, drawn once for each of its ``instances``.

    ``material`` overrides those of the parts. ``file`` is the file it was read from, if any, and ``pose`` the one that
    its parts have there.
    """

    parts: Annotated[tuple[Part, ...], BeforeValidator(as_tuple)]
    instances: Annotated[tuple[Placement, ...], BeforeValidator(as_tuple)] = (Placement(),)
    material: str | None = None
    file: str | None = None
    name: str = "mesh"
    pose: Pose | None = None

    def placed(self) -> Iterator[tuple[NDArray[np.float64], Part]]:
        """Each part of each instance that has triangles, with its (4, 4) matrix to world space."""
        parts = [part for part in self.parts if len(part.geometry.triangles)]
        matrices = np.array([part.matrix for part in parts]).reshape(-1, 4, 4)
        for placement in self.instances:
            yield from zip(placement.matrix @ matrices, parts, strict=True)

    def box_corners(self) -> NDArray[np.float64]:
        """(n, 3) corners of the bounding boxes of all instances of all parts, in world space; n may be 0."""
        placed = list(self.placed())
        matrices = np.array([matrix for matrix, _ in placed]).reshape(-1, 4, 4)
        bounds = np.array([part.geometry.bounds for _, part in placed]).reshape(-1, 2, 3)
        corners = bounds[:, np.indices((2, 2, 2)).reshape(3, 8).T, np.arange(3)]
        found: NDArray[np.float64] = corners @ matrices[:, :3, :3].swapaxes(1, 2) + matrices[:, None, :3, 3]
        return found.reshape(-1, 3)

    def material_of(self, part: Part) -> str:
        """The name of the material of ``part`` in the scene."""
        return self.material or part.material
