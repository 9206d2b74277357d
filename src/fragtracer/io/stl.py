# SPDX-License-Identifier: MIT
"""STL, binary and ASCII: triangles without anything else; their normals are those of their vertices' order."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.io.model import Model, decoded, geometry, read_file, stem
from fragtracer.scene import Material, Mesh, Part

_HEADER = 84  # bytes, of a binary file, of which the last four are the number of triangles
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_NAMES = re.compile(r"^\s*(end)?solid.*$", re.IGNORECASE | re.MULTILINE)
_VERTEX = re.compile(r"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_FACET = re.compile(r"\bendfacet\b", re.IGNORECASE)


def read_stl(path: Path) -> Model:
    """Read an .stl file.

    Raises
    ------
    SceneError
        If the file is missing or damaged.
    """
    data = read_file(path)
    ignored: tuple[str, ...] = ()
    if data[:5].lower() == b"solid" and b"\0" not in data[:1024]:  # binary files may begin so as well
        corners = _corners(path, decoded(path, data))
    else:
        count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
        if len(data) < _HEADER + count * _TRIANGLE.itemsize:
            raise SceneError(f"{path}: this is no STL file, or it ends before the last of its {count} triangles")
        table = np.frombuffer(data, _TRIANGLE, count, _HEADER)
        corners = table["corners"].reshape(-1, 3).astype(np.float64)
        ignored = ("colours or other attributes of triangles",) if table["attribute"].any() else ()
    if not len(corners):
        raise SceneError(f"{path}: there are no triangles in this file")
    triangles = np.arange(len(corners)).reshape(-1, 3)
    part = Part(geometry(str(path), positions=corners, triangles=triangles), stem(path))
    return Model(Mesh(parts=(part,)), {stem(path): Material()}, ignored=ignored, files=(path,))


def _corners(path: Path, text: str) -> NDArray[np.float64]:
    """The vertices of an ASCII file, (3 triangles, 3)."""
    is_whole = "endsolid" in text[-1024:].lower()
    text = _NAMES.sub("", text)
    rows, count = _VERTEX.findall(text), len(_FACET.findall(text))
    try:
        corners = np.array(rows, np.float64).reshape(-1, 3)
    except ValueError:
        bad = next(row for row in rows if not all(map(_is_number, row)))
        raise SceneError(f"{path}: a vertex needs three numbers, got {' '.join(bad)[:60]}") from None
    if len(corners) != 3 * count or not is_whole:
        raise SceneError(f"{path}: a facet has not three vertices, or the file ends before endsolid: it may be cut off")
    return corners


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
