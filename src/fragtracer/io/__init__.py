# SPDX-License-Identifier: MIT
"""Model files: OBJ, PLY, STL, glTF, and .npz of arrays.

Features of a file that are ignored are listed in one warning a file.
"""

import os
import time
import warnings
from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fragtracer.errors import SceneError
from fragtracer.io.arrays import read_arrays
from fragtracer.io.model import AnimationError, Model, bounds, check_area, check_size, stem
from fragtracer.io.obj import read_obj
from fragtracer.io.ply import read_ply
from fragtracer.io.stl import read_stl
from fragtracer.scene import Material, Mesh, Part, Pose

if TYPE_CHECKING:
    from fragtracer.io.gltf import GltfFile

__all__ = ["SUFFIXES", "AnimationError", "Model", "bounds", "files_of", "load_mesh"]
__all__ += ["note_files", "open_gltf", "qualified", "read_model"]


def _read_gltf(path: Path) -> Model:
    return _open(path).model()


def _open(path: Path) -> "GltfFile":
    """Imported on first use: building its validators takes time."""
    from fragtracer.io.gltf import GltfFile

    return GltfFile(path)


_READERS = {".obj": read_obj, ".ply": read_ply, ".stl": read_stl, ".gltf": _read_gltf, ".glb": _read_gltf}
_READERS |= {".npz": read_arrays}
SUFFIXES = tuple(_READERS)
_Stamps = tuple[tuple[int, int] | None, ...]
_CHANGING = (-1, -1)  # that of no file
_MOST_KEPT = 8  # models
_MOST_NOTES = 12  # in one line
_kept: OrderedDict[tuple[Path, Pose | None], tuple[_Stamps, Model]] = OrderedDict()
_files: dict[Path, tuple[Path, ...]] = {}
_opened: dict[Path, tuple[_Stamps, "GltfFile"]] = {}  # the last one that was read in a pose


def read_model(file: str | Path, pose: Pose | None = None) -> Model:
    """Read a model, from memory if the file has not changed since it was last read.

    Parameters
    ----------
    file
        A .obj, .ply, .stl, .gltf, .glb or .npz file.
    pose
        That of an animation of a .gltf or .glb file.

    Raises
    ------
    AnimationError
        If the file has no such animation.
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
    stamps, model = _kept.pop((path, pose), (None, None))
    if model is None or stamps != _stamps(model.files):
        began = time.time_ns()
        opened = None if pose is None else open_gltf(path)
        model = reader(path) if opened is None else opened.model(pose)
        check_size(path, model.mesh)
        if pose is None and reader is not read_arrays:  # what was made in Python stays as it is
            check_area(path, model.mesh)
        model = replace(model, mesh=replace(model.mesh, file=str(path), name=stem(path)))
        stamps = _stamps(model.files, began)
        if opened is not None:
            _opened.clear()
            _opened[path] = stamps, opened
    assert stamps is not None
    _kept[path, pose], _files[path] = (stamps, model), model.files
    while len(_kept) > _MOST_KEPT:
        _kept.popitem(last=False)
    if model.ignored:
        shown, rest = model.ignored[:_MOST_NOTES], len(model.ignored) - _MOST_NOTES
        more = f", and {rest} more" if rest > 0 else ""
        warnings.warn(f"{path}: ignored: {', '.join(shown)}{more}", stacklevel=2)
    return model


def open_gltf(file: str | Path) -> "GltfFile":
    """A .gltf or .glb file for its poses; the last one that was read in a pose from memory, if it has not changed.

    Raises
    ------
    AnimationError
        If it is another kind of file, which has no animations.
    SceneError
        If it cannot be read.
    """
    path = Path(os.path.abspath(file))
    if _READERS.get(path.suffix.lower()) is not _read_gltf:
        raise AnimationError(f"{path}: only .gltf and .glb files have animations")
    stamps, opened = _opened.get(path, (None, None))
    return opened if opened is not None and stamps == _stamps(opened.files) else _open(path)


def load_mesh(path: str | Path, pose: Pose | None = None) -> tuple[Mesh, dict[str, Material]]:
    """Read a model for a scene made in Python, perhaps in the ``pose`` of an animation.

    Returns
    -------
    mesh : Mesh
        With one instance at the origin; ``dataclasses.replace`` gives it other ``instances``.
    materials : dict
        The materials of its parts, for the ``materials`` of the scene, named FILE/NAME, as "chair/wood".

    Raises
    ------
    AnimationError
        If the file has no such animation.
    SceneError
        If the file, or one that it needs, is missing or damaged.
    """
    model = qualified(read_model(path, pose), stem(path))
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


def note_files(file: str | Path, files: Iterable[Path]) -> None:
    """Say for :func:`files_of` that a scene was read from these, besides ``file``."""
    path = Path(os.path.abspath(file))
    _files[path] = (path, *files)


def files_of(file: str | Path) -> tuple[Path, ...]:
    """The files that a model or a scene was read from; ``file`` alone if it was not read yet."""
    path = Path(os.path.abspath(file))
    return _files.get(path, (path,))


def _stamps(files: Iterable[Path], began: int | None = None) -> _Stamps:
    """Of files that were read from the time ``began`` on, if it is given: what is written meanwhile may have been read
    before."""
    stamps = tuple(map(_stamp, files))
    if began is None:
        return stamps
    return tuple(_CHANGING if stamp is not None and stamp[0] >= began else stamp for stamp in stamps)


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size
