# SPDX-License-Identifier: MIT
"""The content of a model file, and helpers that all readers share."""

import codecs
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.scene import Camera, DirectionalLight, Geometry, Light, Material, Mesh, SpotLight
from fragtracer.scene.fields import Triple
from fragtracer.scene.mesh import Matrix

MITSUBA = ".xml"  # the suffix of its scenes
LIGHT_KINDS = ("lights", "spot_lights", "directional_lights")  # that a model has
_FARTHEST = 1e15  # metres
_FEW = 2**14  # triangles, at a time
_MOST_PRODUCTS = 2**22  # of vertices with directions, at a time


class AnimationError(SceneError):
    """A model has no such animation."""


@dataclass(frozen=True)
class Model:
    """The content of one file.

    ``materials`` are those of the parts of ``mesh``, by name. ``aspect`` is the aspect ratio (width over height) of the
    first of ``cameras``, if the file has one. ``ignored`` lists the features of the file that are ignored; ``files``
    are all files that were read for it.
    """

    mesh: Mesh
    materials: dict[str, Material]
    cameras: tuple[Camera, ...] = ()
    aspect: float | None = None
    lights: tuple[Light, ...] = ()
    spot_lights: tuple[SpotLight, ...] = ()
    directional_lights: tuple[DirectionalLight, ...] = ()
    ignored: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()

    @property
    def has_lights(self) -> bool:
        return any(getattr(self, kind) for kind in LIGHT_KINDS)


def stem(path: str | Path) -> str:
    """The name of a file without its extension, as a name of what is in it: what is no UTF-8 is escaped."""
    return Path(path).stem.encode("utf-8", "backslashreplace").decode()


def read_file(path: Path) -> bytes:
    """The bytes of a file. Raises SceneError if it cannot be read."""
    try:
        if path.exists() and not path.is_file():
            raise SceneError(f"{path}: not a regular file; give the path of one")
        return path.read_bytes()
    except FileNotFoundError as error:
        raise SceneError(f"{path}: no such file") from error
    except (OSError, ValueError) as error:
        raise SceneError(f"{path}: cannot read: {getattr(error, 'strerror', None) or error}") from error


def decoded(path: Path, data: bytes) -> str:
    """The text of a file, by :func:`text_of`. Raises SceneError for UTF-16."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise SceneError(f"{path}: this is UTF-16 text; save it as UTF-8")
    return text_of(data)


def text_of(data: bytes) -> str:
    """UTF-8, or Latin-1 if it is not valid UTF-8, as in files of old exporters."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def geometry(where: str, **arrays: Any) -> Geometry:
    """Make a :class:`Geometry`. Raises SceneError, opening with ``where``, if the arrays are not valid."""
    try:
        return Geometry(**arrays)
    except ValueError as error:
        raise SceneError(f"{where}: {error}") from error


def matrix_rows(matrix: NDArray[Any]) -> Matrix:
    """A (4, 4) array as the ``matrix`` of a :class:`Part`."""
    a, b, c, d = (tuple(row) for row in matrix.astype(np.float64).tolist())
    return (a, b, c, d)


def triple(values: NDArray[np.float64]) -> Triple:
    """An array of three numbers as a tuple of floats."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def farthest(mesh: Mesh, directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The largest product of each of the ``directions`` (k, 3) with a vertex of the triangles of ``mesh``, in object
    space, (k,); -inf if it has none."""
    matrices: dict[Geometry, list[Matrix]] = {}
    for part in mesh.parts:
        matrices.setdefault(part.geometry, []).append(part.matrix)
    found = np.full(len(directions), -np.inf)
    for one, places in matrices.items():
        used = np.zeros(len(one.positions), bool)
        used[one.triangles] = True
        points = one.positions[used].T
        few = max(1, _MOST_PRODUCTS // max(points.size, 1))  # of the places, at a time
        for begin in range(0, len(places) if points.size else 0, few):
            some = np.array(places[begin : begin + few])
            products = ((directions @ some[:, :3, :3]).reshape(-1, 3) @ points).max(axis=1).reshape(len(some), -1)
            found = np.maximum(found, (products + some[:, :3, 3] @ directions.T).max(axis=0))
    return found


def bounds(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Minimum and maximum corner of the axis-aligned bounding box of all parts, in the object space of the mesh."""
    found = farthest(mesh, np.concatenate([-np.eye(3), np.eye(3)]))
    found = np.where(found == -np.inf, 0.0, found)
    return 0.0 - found[:3], found[3:]  # not -0


def check_size(path: Path, mesh: Mesh) -> None:
    """Raise SceneError if squared distances would overflow a 32-bit float."""
    largest = float(np.abs(bounds(mesh)).max())
    if not largest <= _FARTHEST:
        raise SceneError(f"{path}: this model has bounds of {largest:.3g} m; scale it to less than {_FARTHEST:g} m")


def check_area(path: Path, mesh: Mesh) -> None:
    """Raise SceneError if no triangle has an area."""
    geometries = dict.fromkeys(part.geometry for part in mesh.parts)
    if not any(_has_area(one.positions[some]) for one in geometries for some in _pieces(one.triangles)):
        raise SceneError(f"{path}: no face in this file has an area")


def _pieces(triangles: NDArray[Any]) -> Iterator[NDArray[Any]]:
    return (triangles[begin : begin + _FEW] for begin in range(0, len(triangles), _FEW))


def _has_area(corners: NDArray[Any]) -> bool:
    a, b, c = corners.astype(np.float64).swapaxes(0, 1)
    return bool(np.cross(b - a, c - a).any())


def listed(names: Iterable[str]) -> tuple[str, ...]:
    """Each name once, in order of first appearance."""
    return tuple(dict.fromkeys(names))
