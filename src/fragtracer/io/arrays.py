# SPDX-License-Identifier: MIT
"""Meshes made in Python, in a .npz file.

The file holds, for part 0, "0.positions", "0.triangles", "0.material", "0.matrix" and optionally "0.normals",
"0.uvs", "0.uvs_1", "0.tangents" and "0.colors"; then "1.positions" and so on. "0.material" is the name of a
material of the scene.
"""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.io.images import npy
from fragtracer.io.model import Model, geometry, matrix_rows, read_file
from fragtracer.scene import Mesh, Part

_ARRAYS = ("positions", "triangles", "normals", "uvs", "uvs_1", "tangents", "colors")
_NEEDED = ("positions", "triangles", "material", "matrix")


def write_arrays(path: Path, mesh: Mesh) -> None:
    """Write the parts of ``mesh``, without its instances."""
    arrays: dict[str, Any] = {}
    for index, part in enumerate(mesh.parts):
        values = {name: getattr(part.geometry, name) for name in _ARRAYS}
        values |= {"material": np.array(part.material), "matrix": np.array(part.matrix)}
        arrays |= {f"{index}.{name}": value for name, value in values.items() if value is not None}
    with path.open("wb") as file:
        np.savez(file, **arrays)


def read_arrays(path: Path) -> Model:
    """Read what :func:`write_arrays` wrote. Raises SceneError if the file is missing or damaged."""
    data = read_file(path)
    try:
        arrays = _unpack(data)
    except (zipfile.BadZipFile, ValueError, OSError, EOFError, RuntimeError, NotImplementedError) as error:
        reason = ascii(str(error)[:80])[1:-1]
        raise SceneError(f"{path}: this .npz file is damaged or not one: {reason}") from error
    parts: list[Part] = []
    while f"{len(parts)}.positions" in arrays:
        parts.append(_part(path, f"{len(parts)}.", arrays))
    if not parts:
        raise SceneError(f"{path}: there is no array 0.positions in this file")
    if not any(len(part.geometry.triangles) for part in parts):
        raise SceneError(f"{path}: there are no triangles in this file")
    return Model(Mesh(parts=tuple(parts)), {}, files=(path,))


def _part(path: Path, prefix: str, arrays: dict[str, NDArray[Any]]) -> Part:
    missing = [name for name in _NEEDED if prefix + name not in arrays]
    if missing:
        raise SceneError(f"{path}: there is no array {prefix}{missing[0]} in this file")
    material, matrix = arrays[f"{prefix}material"], arrays[f"{prefix}matrix"]
    if material.dtype.kind != "U" or material.ndim or matrix.shape != (4, 4) or matrix.dtype.kind != "f":
        raise SceneError(f"{path}: {prefix}material must be a text, and {prefix}matrix (4, 4) numbers")
    values = {name: arrays[prefix + name] for name in _ARRAYS if prefix + name in arrays}
    try:
        return Part(geometry(f"{path}: part {prefix[:-1]}", **values), str(material), matrix_rows(matrix))
    except ValueError as error:
        raise SceneError(f"{path}: {prefix}matrix must be finite, and its last row 0 0 0 1") from error


def _unpack(data: bytes) -> dict[str, NDArray[Any]]:
    """The arrays of an uncompressed archive, each a view of its bytes."""
    arrays = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for entry in archive.infolist():
            if entry.compress_type != zipfile.ZIP_STORED:
                raise ValueError("its arrays are compressed; write it with numpy.savez")
            arrays[entry.filename.removesuffix(".npy")] = npy.decode(archive.read(entry))
    return arrays
