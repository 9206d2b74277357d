# SPDX-License-Identifier: MIT
"""Wavefront OBJ: polygons, texture coordinates, normals, vertex colours and materials.

Read by our own code: the libraries that exist triangulate concave polygons wrongly, lose texture coordinates
or materials, or are C++ that trusts its input.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fragtracer.display.tone import srgb_decode
from fragtracer.errors import SceneError
from fragtracer.io.colors import fractions
from fragtracer.io.model import Model, decoded, geometry, listed, read_file
from fragtracer.io.mtl import read_materials
from fragtracer.io.polygons import Floats, Ints, triangulate
from fragtracer.scene import Geometry, Material, Mesh, Part

DEFAULT = "default"
_CURVES = {"l", "p", "curv", "curv2", "surf", "vp", "call", "csh"}
_LEAST = {"v": 3, "vt": 1, "vn": 3}
_NUMERIC = {*_LEAST, "f", "fo"}


@dataclass
class _Lines:
    """The statements of a file by kind, with their line numbers."""

    vertices: dict[str, list[list[str]]] = field(default_factory=lambda: {"v": [], "vt": [], "vn": []})
    numbers: dict[str, list[int]] = field(default_factory=lambda: {"v": [], "vt": [], "vn": [], "f": []})
    faces: list[list[str]] = field(default_factory=list)
    counts: dict[int, tuple[int, int, int]] = field(default_factory=dict)  # before a face with negative indices
    materials: list[tuple[int, str]] = field(default_factory=list)  # the first face of each, and its name
    libraries: list[str] = field(default_factory=list)
    is_smoothed: bool = False
    ignored: list[str] = field(default_factory=list)


def read_obj(path: Path) -> Model:
    """Read an .obj file and the .mtl files that it names.

    A vertex with six numbers has a colour, taken for sRGB, from 0 to 1 or by whole numbers to 255. Faces without
    normals are flat.

    Raises
    ------
    SceneError
        If the file is missing or damaged; the message has the line.
    """
    lines = _split(decoded(path, read_file(path)))
    where = str(path)
    v, vt, vn = (_numbers(lines, kind, where) for kind in ("v", "vt", "vn"))
    counts, corners = _corners(lines, (len(v), len(vt), len(vn)), where)
    if not (counts > 2).any():
        raise SceneError(f"{path}: there are no faces in this file")
    try:
        triangles, sources = triangulate(counts, v[corners[:, 0], :3])
    except ValueError as error:
        raise SceneError(f"{path}: {error}") from error
    if not len(triangles):
        raise SceneError(f"{path}: no face in this file has an area")
    if short := int((counts < 3).sum()):
        lines.ignored.append(f"faces of fewer than three vertices ({short})")
    if lines.is_smoothed and (corners[triangles, 2] < 0).any():
        lines.ignored.append("smoothing groups (what has no normals is flat)")
    if v.shape[1] < 6 <= max(map(len, lines.vertices["v"])):
        lines.ignored.append("colours of vertices (some have none)")
    if v.shape[1] >= 6:
        v[:, 3:6] = srgb_decode(np.clip(fractions(list(v[:, 3:6].T))[0], 0, 1))
    library, files, notes = read_materials(path, lines.libraries)
    parts, used = [], {}
    for name, rows in _groups(lines, corners, triangles, sources):
        parts.append(Part(_part(where, corners[triangles[rows]], v, vt, vn), name))
        used[name] = library.get(name, Material() if v.shape[1] < 6 else Material(albedo=(1.0, 1.0, 1.0)))
    if library or not lines.libraries:
        asked = (name for name in used if name not in library and name != DEFAULT)
        notes += [f'material "{name}" (in no .mtl file; it is grey)' for name in asked]
    return Model(Mesh(parts=tuple(parts)), used, ignored=listed([*lines.ignored, *notes]), files=(path, *files))


def _split(text: str) -> _Lines:
    found = _Lines()
    v, vt, vn = (found.vertices[kind] for kind in ("v", "vt", "vn"))
    for number, line in _numbered(text):
        words = line.split()
        if not words:
            continue
        kind = words[0]
        if "#" in line and kind in _NUMERIC:
            words = line.partition("#")[0].split()
        if kind in found.vertices:
            found.vertices[kind].append(words[1:])
            found.numbers[kind].append(number)
        elif kind in ("f", "fo"):
            if "-" in line:
                found.counts[len(found.faces)] = (len(v), len(vt), len(vn))
            found.faces.append(words[1:])
            found.numbers["f"].append(number)
        elif kind == "usemtl":
            found.materials.append((len(found.faces), line.strip()[7:].strip() or DEFAULT))
        elif kind == "mtllib":
            found.libraries.append(line.strip()[7:].strip())
        elif kind == "s":
            found.is_smoothed |= words[1:] not in ([], ["0"], ["off"])
        elif kind in _CURVES:
            found.ignored.append("points, lines and curves")
    return found


def _numbered(text: str) -> Iterator[tuple[int, str]]:
    """Logical lines and their numbers; a backslash at the end of a line continues it."""
    first, held = 1, ""
    for number, line in enumerate(text.splitlines(), start=1):
        first = first if held else number
        if line.endswith("\\"):
            held += line[:-1] + " "
        else:
            yield first, held + line
            held = ""
    yield first, held


def _numbers(lines: _Lines, kind: str, where: str) -> Floats:
    """(n, width) numbers of all statements of one kind, truncated to the shortest and padded to three."""
    rows = lines.vertices[kind]
    width = min(map(len, rows), default=0)
    try:
        if rows and width < _LEAST[kind]:
            raise ValueError
        flat = np.fromiter(map(float, chain.from_iterable(row[:width] for row in rows)), np.float64)
    except ValueError:
        number, row = next((n, r) for n, r in zip(lines.numbers[kind], rows, strict=True) if not _is_row(r, kind))
        raise SceneError(
            f"{where}: line {number}: {kind} needs {_LEAST[kind]} numbers, got {' '.join(row)[:60]}"
        ) from None
    table = flat.reshape(len(rows), width)
    if not np.isfinite(table).all():
        number = lines.numbers[kind][int(np.argmin(np.isfinite(table).all(axis=1)))]
        raise SceneError(f"{where}: line {number}: {kind} must be of finite numbers")
    return np.pad(table, ((0, 0), (0, max(0, 3 - width))))


def _is_row(row: list[str], kind: str) -> bool:
    try:
        return len([float(word) for word in row]) >= _LEAST[kind]
    except ValueError:
        return False


def _corners(lines: _Lines, totals: tuple[int, int, int], where: str) -> tuple[Ints, Ints]:
    """The number of vertices of each face, and (vertices, 3) indices of v, vt and vn from 0, -1 if there is none."""
    counts = np.fromiter(map(len, lines.faces), np.int64, len(lines.faces))
    words = (f"{word}//".split("/")[:3] for word in chain.from_iterable(lines.faces))
    try:
        corners = np.array([int(word or 0) for word in chain.from_iterable(words)], np.int64).reshape(-1, 3)
    except (ValueError, OverflowError):
        bad = next(i for i, face in enumerate(lines.faces) if not all(map(_is_corner, face)))
        text = " ".join(lines.faces[bad])[:60]
        raise SceneError(f"{where}: line {lines.numbers['f'][bad]}: these are no vertices of a face: {text}") from None
    starts = np.cumsum(counts) - counts
    for face, before in lines.counts.items():
        rows = corners[starts[face] : starts[face] + counts[face]]
        rows += np.where((rows < 0) & (rows >= np.negative(before)), np.add(before, 1), 0)
    bad_corners = (corners < [1, 0, 0]) | (corners > totals)
    if bad_corners.any():
        corner, kind = (int(i[0]) for i in np.nonzero(bad_corners))
        face = int(np.searchsorted(starts, corner, side="right")) - 1
        raise SceneError(
            f"{where}: line {lines.numbers['f'][face]}: {('v', 'vt', 'vn')[kind]} {corners[corner, kind]} "
            f"does not exist; there are {totals[kind]}, counted from 1"
        )
    return counts, corners - 1


def _is_corner(word: str) -> bool:
    try:
        return all(abs(int(part or 0)) < 2**62 for part in word.split("/"))
    except ValueError:
        return False


def _groups(lines: _Lines, corners: Ints, triangles: Ints, sources: Ints) -> Iterator[tuple[str, Ints]]:
    """Material names and triangle indices, grouped by material and by which attributes there are."""
    starts = np.array([0, *(face for face, _ in lines.materials)])
    names = [DEFAULT, *(name for _, name in lines.materials)]
    different = list(dict.fromkeys(names))
    numbers = {name: number for number, name in enumerate(different)}
    number_of = np.array([numbers[name] for name in names])
    material = number_of[np.searchsorted(starts, sources, side="right") - 1]
    has = np.all(corners[triangles][:, :, 1:] >= 0, axis=1).astype(np.int64)
    group = material * 4 + has[:, 0] * 2 + has[:, 1]
    order = np.argsort(group, kind="stable")
    for rows in np.split(order, np.nonzero(np.diff(group[order]))[0] + 1):
        yield different[int(material[rows[0]])], rows


def _part(where: str, corners: NDArray[np.int64], v: Floats, vt: Floats, vn: Floats) -> Geometry:
    rows, triangles = _unique(corners.reshape(-1, 3))
    positions, uvs, normals, colors = v[rows[:, 0], :3], None, None, None
    if (corners[:, :, 1] >= 0).all():
        uvs = vt[rows[:, 1], :2] * (1, -1) + (0, 1)
    if (corners[:, :, 2] >= 0).all():
        normals = vn[rows[:, 2]]
    if v.shape[1] >= 6:
        colors = v[rows[:, 0], 3:6]
    return geometry(
        where, positions=positions, triangles=triangles.reshape(-1, 3), normals=normals, uvs=uvs, colors=colors
    )


def _unique(corners: Ints) -> tuple[Ints, Ints]:
    """The unique rows, and the index of each row among them."""
    sizes = [int(size) for size in corners.max(axis=0) + 2]
    if sizes[0] * sizes[1] * sizes[2] >= 2**62:
        found, inverse = np.unique(corners, axis=0, return_inverse=True)
        return found, inverse
    keys = ((corners[:, 0] + 1) * sizes[1] + corners[:, 1] + 1) * sizes[2] + corners[:, 2] + 1
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    return corners[first], inverse
