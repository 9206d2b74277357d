# SPDX-License-Identifier: MIT
"""PLY files of all three formats, and headers that lie."""

import tracemalloc
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

from fragtracer.errors import SceneError
from fragtracer.io import bounds, read_model
from fragtracer.scene import Material

from .data import shared

ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
POSITIONS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]]


def write(path: Path, order: str, vertex: list[tuple[str, str]], rows: np.ndarray, lists: list[list[int]]) -> Path:
    """Vertices with properties of (type, name), and faces."""
    types = {"float": "f4", "uchar": "u1", "double": "f8"}
    kind = next(name for name, value in ORDERS.items() if value == order)
    lines = [f"ply\nformat {kind} 1.0\nelement vertex {len(rows)}", *(f"property {t} {name}" for t, name in vertex)]
    lines += [f"element face {len(lists)}", "property list uchar int vertex_indices", "end_header\n"]
    header = "\n".join(lines).encode()
    if not order:
        body = [" ".join(str(v) for v in row) for row in rows] + [" ".join(map(str, [len(f), *f])) for f in lists]
        path.write_bytes(header + "\n".join(body).encode() + b"\n")
        return path
    table = np.zeros(len(rows), [(name, order + types[t]) for t, name in vertex])
    for column, (_, name) in enumerate(vertex):
        table[name] = rows[:, column]
    faces = b"".join(bytes([len(face)]) + np.array(face, order + "i4").tobytes() for face in lists)
    path.write_bytes(header + table.tobytes() + faces)
    return path


@pytest.mark.parametrize("order", ORDERS.values())
@pytest.mark.parametrize("lists", [[[0, 1, 2], [0, 2, 3]], [[0, 1, 2, 3], [3, 2, 4]], [[0, 1, 2, 4, 3]]])
def test_polygons(tmp_path: Path, order: str, lists: list[list[int]]) -> None:
    vertex = [("float", "x"), ("float", "y"), ("double", "z")]
    model = read_model(write(tmp_path / "x.ply", order, vertex, np.array(POSITIONS), lists))
    geometry = model.mesh.parts[0].geometry
    np.testing.assert_array_equal(geometry.positions, POSITIONS)
    assert len(geometry.triangles) == sum(len(face) - 2 for face in lists)
    a, b, c = (geometry.positions[geometry.triangles[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


@pytest.mark.parametrize("order", ORDERS.values())
def test_attributes(tmp_path: Path, order: str) -> None:
    names = ["x", "y", "z", "nx", "ny", "nz", "s", "t"]
    colors = ["red", "green", "blue", "alpha"]
    vertex = [("float", name) for name in names] + [("uchar", name) for name in colors]
    rows = np.array([[0, 0, 0, 0, 0, 1, 0.25, 0.75, 255, 0, 128, 51]] * 3, object)
    rows[1, 0] = rows[2, 1] = 1
    model = read_model(write(tmp_path / "x.ply", order, vertex, rows, [[0, 1, 2]]))
    geometry = model.mesh.parts[0].geometry
    np.testing.assert_allclose(geometry.normals, [[0, 0, 1]] * 3)
    np.testing.assert_allclose(geometry.uvs, [[0.25, 0.25]] * 3)
    np.testing.assert_allclose(geometry.colors, [[1, 0, 0.215861, 0.2]] * 3, atol=1e-5)
    assert model.materials["x"].alpha_mode == "blend"
    rows[:, -1] = 255
    model = read_model(write(tmp_path / "y.ply", order, vertex, rows, [[0, 1, 2]]))
    assert model.materials["y"].alpha_mode == "opaque"


VERTICES = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize(
    ("kind", "row", "linear"),
    [
        ("uchar", "255 0 128", (1, 0, 0.215861)),
        ("int", "255 0 128", (1, 0, 0.215861)),
        ("float", "255 0 128", (1, 0, 0.215861)),
        ("float", "1 0 0.5", (1, 0, 0.5)),
        ("int", "65535 0 32896", (1, 0, 0.215861)),
        ("ushort", "65535 0 32896", (1, 0, 0.215861)),
        ("char", "127 0 -1", (1, 0, 0)),
    ],
)
def test_colours_of_vertices_and_of_faces(tmp_path: Path, kind: str, row: str, linear: tuple[float, ...]) -> None:
    names = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
    head, indices = "ply\nformat ascii 1.0\n", "property list uchar int vertex_indices\n"
    (tmp_path / "x.ply").write_text(
        f"{head}{VERTICES}{names}element face 1\n{indices}end_header\n"
        f"0 0 0 {row}\n1 0 0 {row}\n1 1 0 {row}\n0 1 0 {row}\n4 0 1 2 3\n"
    )
    (tmp_path / "y.ply").write_text(
        f"{head}{VERTICES}element face 2\n{indices}{names}end_header\n"
        f"0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 0 0 0\n3 0 2 3 {row}\n"
    )
    of_vertices, of_faces = (read_model(tmp_path / f"{name}.ply").mesh.parts[0].geometry for name in "xy")
    np.testing.assert_allclose(of_vertices.colors, [linear] * 4, atol=1e-5)
    np.testing.assert_allclose(of_faces.colors[of_faces.triangles], [[(0, 0, 0)] * 3, [linear] * 3], atol=1e-5)


def test_colours_of_faces_give_way_to_those_of_vertices(tmp_path: Path) -> None:
    names = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    (tmp_path / "x.ply").write_text(
        f"ply\nformat ascii 1.0\n{VERTICES}{names}element face 1\nproperty list uchar int vertex_indices\n{names}"
        "end_header\n0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 255 0 0\n0 1 0 255 0 0\n3 0 1 2 0 0 0\n"
    )
    with pytest.warns(UserWarning, match="ignored: face red, face green, face blue$"):
        model = read_model(tmp_path / "x.ply")
    np.testing.assert_array_equal(model.mesh.parts[0].geometry.colors, [(1, 0, 0)] * 4)


def test_corner_coordinates_and_texture(tmp_path: Path) -> None:
    PIL.Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "my map.png")
    text = (
        "ply\nformat ascii 1.0\ncomment TextureFile my map.png\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\n"
        "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0.5 0.5 0 0 0 1\n"
    )
    (tmp_path / "x.ply").write_text(text)
    model = read_model(tmp_path / "x.ply")
    geometry = model.mesh.parts[0].geometry
    assert geometry.uvs is not None
    np.testing.assert_allclose(
        geometry.uvs[geometry.triangles], [[[0, 1], [1, 1], [1, 0]], [[0.5, 0.5], [0, 1], [0, 0]]]
    )
    texture = model.materials["x"].albedo_texture
    assert texture is not None
    assert texture.image.pixels.shape == (2, 2, 3)


def test_faces_with_and_without_coordinates(tmp_path: Path) -> None:
    text = (
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 3\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n0 0\n3 0 2 1 0\n"
    )
    (tmp_path / "x.ply").write_text(f"{text}3 0 1 2 0\n")
    assert read_model(tmp_path / "x.ply").mesh.parts[0].geometry.uvs is None
    (tmp_path / "x.ply").write_text(f"{text}3 0 1 2 6 1 1 0 1 1 0\n")
    uvs = read_model(tmp_path / "x.ply").mesh.parts[0].geometry.uvs
    np.testing.assert_array_equal(uvs, [[0, 0], [0, 0], [0, 0], [1, 0], [0, 0], [1, 1]])


def test_strips(tmp_path: Path) -> None:
    text = (
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nelement camera 1\nproperty float fov\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n8 0 1 2 3 -1 2 3 4\n40\n"
    )
    (tmp_path / "x.ply").write_text(text)
    with pytest.warns(UserWarning, match="ignored: camera$"):
        geometry = read_model(tmp_path / "x.ply").mesh.parts[0].geometry
    assert geometry.triangles.tolist() == [[0, 1, 2], [1, 3, 2], [2, 3, 4]]


TRIANGLE = (
    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_names_and_comments_of_any_language(tmp_path: Path, encoding: str, end: str) -> None:
    PIL.Image.new("RGB", (1, 1)).save(tmp_path / "größe.png")
    header = "ply\nformat ascii 1.0\ncomment made by Åsa\ncomment a\x85b\vc\ncomment TextureFile größe.png\n"
    (tmp_path / "x.ply").write_bytes((header + TRIANGLE).replace("\n", end).encode(encoding))
    assert read_model(tmp_path / "x.ply").materials["x"].albedo_texture is not None


def test_a_picture_whose_path_the_system_refuses_is_ignored(tmp_path: Path) -> None:
    (tmp_path / "x.ply").write_text(f"ply\nformat ascii 1.0\ncomment TextureFile {'x' * 300}.png\n{TRIANGLE}")
    with pytest.warns(UserWarning, match=r"ignored: image x{300}\.png: cannot read this texture: "):
        assert read_model(tmp_path / "x.ply").materials["x"] == Material()


VERTEX = "property float x\nproperty float y\nproperty float z\n"
FACE = "property list uchar int vertex_indices\n"
BINARY = "ply\nformat binary_little_endian 1.0\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a PLY file"),
        ("ply\n", "not a PLY file"),
        ("ply\nend_header\n", "does not say whether the file is ascii or binary"),
        ("ply\nformat ascii 1.0\nend_header\n", "no vertices with x, y and z"),
        ("ply\nformat tar 1.0\nend_header\n", "a line that cannot be read: 'format tar 1.0'"),
        ("ply\nformat ascii 1.0\nelement vertex -3\nend_header\n", "a line that cannot be read: 'element vertex -3'"),
        (f"{BINARY}element vertex 4000000000\n{VERTEX}end_header\n", "claims 4000000000 of vertex, more than the file"),
        (f"{BINARY}element vertex 0\n{VERTEX}element face 4000000000\n{FACE}end_header\n", "claims 4000000000 of face"),
        (f"{BINARY}element vertex 99999999999999999999\n{VERTEX}end_header\n", "a line that cannot be read"),
        (
            f"{BINARY}element vertex 0\n{VERTEX}element face 1\n{FACE}end_header\n\xff\0\0",
            "a list of vertex_indices is longer than the rest of the file",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 0\n{VERTEX}element face 2\n{FACE}end_header\n3 0 0 0 4e9 1\n",
            "a list of vertex_indices is longer",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 1\n{VERTEX}element face 1\n{FACE}end_header\n0 0 0\n3 0 0 1\n",
            "a face has vertex 1; the 1 vertices count from 0 to 0",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 1\n{VERTEX}element face 1\n{FACE}end_header\n0 0 0\ninf 0 0 0\n",
            "a list of vertex_indices is longer",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 2\n{VERTEX}element face 1\n{FACE}end_header\n"
            "0 0 0\n1 1 1\n3 0 0 .5\n",
            "vertex_indices must hold whole numbers",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 1\n{VERTEX}element face 1\n"
            "property list uchar float vertex_indices\nend_header\n0 0 0\n3 0 0 0\n",
            "gives the vertex indices of faces a floating-point type",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 4\n{VERTEX.replace('float', 'double')}element face 1\n{FACE}"
            "end_header\n1e300 0 0\n-1e300 0 0\n0 1e300 0\n0 0 0\n4 0 1 2 3\n",
            "positions must be finite, and none beyond",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 1\n{VERTEX}element face 1\n{FACE}end_header\n0 0 nan\n3 0 0 0\n",
            "positions must be finite",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 1\n{VERTEX}element face 1\n{FACE}end_header\n0 zero 0\n3 0 0 0\n",
            "something else than numbers behind the header",
        ),
        (
            f"ply\nformat ascii 1.0\nelement vertex 1\n{VERTEX}element face 1\n{FACE}end_header\n0 0 0\n2 0 0\n",
            "there are no faces of three or more vertices",
        ),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "x.ply").write_bytes(text.encode("latin-1"))
    tracemalloc.start()
    with pytest.raises(SceneError) as raised:
        read_model(tmp_path / "x.ply")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert str(raised.value).startswith(f"{tmp_path / 'x.ply'}: ")
    assert message in str(raised.value)
    assert peak < 10e6


def test_real_file() -> None:
    model = read_model(shared("mesh", "cube_binary.ply"))
    assert len(model.mesh.parts[0].geometry.triangles) == 12
    np.testing.assert_array_equal(bounds(model.mesh), [[0, 0, 0], [1, 1, 1]])
