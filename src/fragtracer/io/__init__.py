# SPDX-License-Identifier: MIT
"""Model files: OBJ, PLY, STL, glTF, and .npz of arrays.

Features of a file that are ignored are listed in one warning a file.
"""

import os
import time
import warnings
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path

from fragtracer.errors import SceneError
from fragtracer.io.arrays import read_arrays
from fragtracer.io.model import Model, bounds, check_area, check_size, stem
from fragtracer.io.obj import read_obj
from fragtracer.io.ply import read_ply
from fragtracer.io.stl import read_stl
from fragtracer.scene import Material, Mesh, Part

__all__ = ["SUFFIXES", "Model", "bounds", "files_of", "load_mesh", "qualified", "read_model"]


def _read_gltf(path: Path) -> Model:
    """Imported on first use: building its validators takes time."""
    from fragtracer.io.gltf import read_gltf

    return read_gltf(path)


_READERS = {".obj": read_obj, ".ply": read_ply, ".stl": read_stl, ".gltf": _read_gltf, ".glb": _read_gltf}
_READERS |= {".npz": read_arrays}
SUFFIXES = tuple(_READERS)
_Stamps = tuple[tuple[int, int] | None, ...]
_CHANGING = (-1, -1)  # that of no file
_MOST_KEPT = 8  # models
_MOST_NOTES = 12  # in one line
_kept: OrderedDict[Path, tuple[_Stamps, Model]] = OrderedDict()
_files: dict[Path, tuple[Path, ...]] = {}


def read_model(file: str | Path) -> Model:
    """Read a model, from memory if the file has not changed since it was last read.

    Parameters
    ----------
    file
        A .obj, .ply, .stl, .gltf, .glb or .npz file.

    Raises
    ------
    SceneError
        If the file, or one that it needs, is missing or damaged.

    Warns
    -----
    UserWarning
        One line with the features of the file that are ignored.
    """
    path = Path(os.path.abspath(file))
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise SceneError(f"{path}: cannot read this kind of model; choose from {', '.join(SUFFIXES)}")
    stamps, model = _kept.pop(path, (None, None))
    if model is None or stamps != _stamps(model):
        began = time.time_ns()
        model = reader(path)
        check_size(path, model.mesh)
        if reader is not read_arrays:  # what was made in Python stays as it is
            check_area(path, model.mesh)
        model = replace(model, mesh=replace(model.mesh, file=str(path), name=stem(path)))
        # What is written meanwhile may have been read before.
        stamps = tuple(_CHANGING if stamp is not None and stamp[0] >= began else stamp for stamp in _stamps(model))
    assert stamps is not None
    _kept[path], _files[path] = (stamps, model), model.files
    while len(_kept) > _MOST_KEPT:
        _kept.popitem(last=False)
    if model.ignored:
        shown, rest = model.ignored[:_MOST_NOTES], len(model.ignored) - _MOST_NOTES
        more = f", and {rest} more" if rest > 0 else ""
        warnings.warn(f"{path}: ignored: {', '.join(shown)}{more}", stacklevel=2)
    return model


def load_mesh(path: str | Path) -> tuple[Mesh, dict[str, Material]]:
    """Read a model for a scene made in Python.

    Returns
    -------
    mesh : Mesh
        With one instance at the origin; ``dataclasses.replace`` gives it other ``instances``.
    materials : dict
        The materials of its parts, for the ``materials`` of the scene, named FILE/NAME, as "chair/wood".

    Raises
    ------
    SceneError
        If the file, or one that it needs, is missing or damaged.
    """
    model = qualified(read_model(path), stem(path))
    return model.mesh, model.materials


def qualified(model: Model, prefix: str) -> Model:
    """``model`` with its materials renamed to PREFIX/NAME; names that are not materials of its own stay."""
    names = {name: f"{prefix}/{name}" for name in model.materials}
    parts = tuple(
        Part(part.geometry, names.get(part.material, part.material), part.matrix) for part in model.mesh.parts
    )
    materials = {
        names[name]: replace(material, blend=names.get(material.blend or "", material.blend))
        for name, material in model.materials.items()
    }
    return replace(model, mesh=replace(model.mesh, parts=parts), materials=materials)


def files_of(file: str | Path) -> tuple[Path, ...]:
    """The files that a model was read from; ``file`` alone if it was not read yet."""
    path = Path(os.path.abspath(file))
    return _files.get(path, (path,))


def _stamps(model: Model) -> _Stamps:
    return tuple(_stamp(path) for path in model.files)


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size
