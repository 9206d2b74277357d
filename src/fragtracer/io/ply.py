# SPDX-License-Identifier: MIT
"""PLY, ascii and binary of both byte orders: polygons, strips, normals, texture coordinates and colours.

Read by our own code: plyfile is GPL, needs memory for what a header claims, and takes 9 times as long for ASCII;
other libraries lose attributes.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.display.tone import srgb_decode
from fragtracer.errors import SceneError
from fragtracer.io.colors import fractions
from fragtracer.io.model import Model, geometry, listed, read_file, stem
from fragtracer.io.model_images import ModelImages
from fragtracer.io.ply_elements import Element, Table, read_header, read_table
from fragtracer.io.polygons import Ints, triangulate
from fragtracer.io.strips import strip_triangles
from fragtracer.scene import Material, Mesh, Part, Texture

_POSITION = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
_UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
_COLORS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
_ALPHAS = ("alpha", "a", "diffuse_alpha")
_FACES = ("vertex_indices", "vertex_index")
_COLORED = {*sum(_COLORS, ()), *_ALPHAS}
_READ = {
    "vertex": {*_POSITION, *_NORMAL, *sum(_UVS, ()), *_COLORED},
    "face": {*_FACES, "texcoord", "texnumber", *_COLORED},
    "tristrips": set(_FACES),
}


def read_ply(path: Path) -> Model:
    """Read a .ply file.

    Whole numbers are sRGB colours, fractions linear. Faces may have colours where vertices have none. A comment
    "TextureFile NAME" names the albedo texture.

    Raises
    ------
    SceneError
        If the file is missing or damaged.
    """
    data = read_file(path)
    try:
        header, body = read_header(data)
        tables: dict[str, Table] = {}
        for element in header.elements:
            tables[element.name], body = read_table(header.format, element, body)
    except ValueError as error:
        raise SceneError(f"{path}: {error}") from error
    vertices, strips = tables.get("vertex"), tables.get("tristrips")
    faces = tables.get("face")
    if vertices is None or not vertices.columns.keys() >= set(_POSITION):
        raise SceneError(f"{path}: this file has no vertices with x, y and z")
    if not (faces or strips):
        raise SceneError(f"{path}: this file has no faces; points are not drawn, make a mesh of them")
    images = ModelImages(path.parent)
    part = Part(_geometry(str(path), vertices, faces, strips), stem(path))
    material = Material() if part.geometry.colors is None else _colored(part.geometry.colors)
    textures = [comment.split(None, 1)[1] for comment in header.comments if comment.lower().startswith("texturefile ")]
    if textures and (image := images.get(textures[0], "srgb")):
        material = replace(material, albedo=(1.0, 1.0, 1.0), albedo_texture=Texture(image))
    notes = [*images.notes, *(["textures after the first"] if textures[1:] else []), *_ignored(header.elements)]
    mesh = Mesh(parts=(part,))
    return Model(mesh, {stem(path): material}, ignored=listed(notes), files=(path, *images.files))


def _colored(colors: NDArray[Any]) -> Material:
    """A material for vertex colours, with alpha blending if any vertex is not opaque."""
    is_transparent = colors.shape[1] == 4 and bool((colors[:, 3] < 1).any())
    return Material(albedo=(1, 1, 1), alpha_mode="blend" if is_transparent else "opaque")


def _ignored(elements: list[Element]) -> list[str]:
    unread = [e.name for e in elements if e.name not in _READ and e.count]
    known = [e for e in elements if e.name in _READ]
    has_colors = any(p.name in _COLORED for e in known for p in e.properties if e.name == "vertex")
    read = _READ | {"face": _READ["face"] - _COLORED} if has_colors else _READ
    return unread + [f"{e.name} {p.name}" for e in known for p in e.properties if p.name not in read[e.name]]


def _geometry(where: str, vertices: Table, faces: Table | None, strips: Table | None) -> Any:
    columns = vertices.columns
    arrays: dict[str, Any] = {"positions": _stack(columns, _POSITION, np.float64)}
    if columns.keys() >= set(_NORMAL):
        arrays["normals"] = _stack(columns, _NORMAL, np.float32)
    for names in _UVS:
        if columns.keys() >= set(names):
            arrays["uvs"] = _stack(columns, names, np.float32) * (1, -1) + (0, 1)
    if (colors := _colors(columns)) is not None:
        arrays["colors"] = colors
    count = len(arrays["positions"])
    found: list[Ints] = []
    of_corners: dict[str, NDArray[Any]] = {}
    if faces is not None and (lists := next((faces.lists[name] for name in _FACES if name in faces.lists), None)):
        counts, indices = lists
        _check(where, indices, count)
        try:
            rows, sources = triangulate(counts, arrays["positions"][indices])
        except ValueError as error:
            raise SceneError(f"{where}: {error}") from error
        found.append(indices[rows])
        if (corner_uvs := _corner_uvs(faces, counts, rows, sources)) is not None:
            of_corners["uvs"] = corner_uvs
        if colors is None and (of_faces := _colors(faces.columns)) is not None:
            of_corners["colors"] = np.repeat(of_faces[sources], 3, axis=0)
    for counts, indices in strips.lists.values() if strips else ():
        _check(where, indices[indices >= 0], count)
        found.append(strip_triangles(_split_strips(indices, counts)))
    triangles = np.concatenate(found) if found else np.zeros((0, 3), np.int64)
    if not len(triangles):
        raise SceneError(f"{where}: there are no faces of three or more vertices in this file")
    if of_corners and len(next(iter(of_corners.values()))) == triangles.size:
        arrays = {name: array[triangles.reshape(-1)] for name, array in arrays.items()} | of_corners
        triangles = np.arange(triangles.size).reshape(-1, 3)
    return geometry(where, triangles=triangles, **arrays)


def _stack(columns: Mapping[str, NDArray[Any]], names: tuple[str, ...], dtype: Any) -> NDArray[Any]:
    with np.errstate(over="ignore"):
        return np.column_stack([columns[name].astype(dtype) for name in names])


def _colors(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.float32] | None:
    names = next((names for names in _COLORS if columns.keys() >= set(names)), None)
    if names is None:
        return None
    colors, is_counted = fractions([columns[name] for name in names])
    colors = srgb_decode(colors) if is_counted else colors
    alpha = next((fractions([columns[name]])[0] for name in _ALPHAS if name in columns), None)
    return colors if alpha is None else np.column_stack([colors, alpha])


def _check(where: str, indices: Ints, count: int) -> None:
    if indices.dtype.kind == "f":
        raise SceneError(
            f"{where}: the header gives the vertex indices of faces a floating-point type; they must be integers"
        )
    bad = indices[(indices < 0) | (indices >= count)]
    if len(bad):
        raise SceneError(f"{where}: a face has vertex {bad[0]}; the {count} vertices count from 0 to {count - 1}")


def _corner_uvs(faces: Table, counts: Ints, rows: Ints, sources: Ints) -> NDArray[np.float64] | None:
    """(corners of triangles, 2) texture coordinates of the faces, 0 for faces without; None if no face has any."""
    if "texcoord" not in faces.lists:
        return None
    numbers, values = faces.lists["texcoord"]
    has = numbers == 2 * counts
    if not (has & (counts > 2)).any():
        return None
    starts, uv_starts = np.cumsum(counts) - counts, np.cumsum(numbers) - numbers
    places = uv_starts[sources, None] + 2 * (rows - starts[sources, None])
    places = np.where(has[sources, None], places, 0).reshape(-1)
    uvs = np.column_stack([values[places], 1 - values[places + 1]])
    return np.where(np.repeat(has[sources], 3)[:, None], uvs, 0.0)


def _split_strips(indices: Ints, counts: Ints) -> list[Ints]:
    """Triangle strips, one for each list and each restart by a negative index."""
    pieces = []
    for strip in np.split(indices, np.cumsum(counts)[:-1]):
        [cuts] = np.nonzero(strip < 0)
        pieces += [piece[piece >= 0] for piece in np.split(strip, cuts)]
    return pieces
