# SPDX-License-Identifier: MIT
"""Broken files give one clear message or a model: no traceback, no hang, no runaway memory."""

import io
import json
import subprocess
import sys
import time
import tracemalloc
import warnings
from collections.abc import Iterator
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from fragtracer import io as models
from fragtracer.errors import FragtracerError, SceneError
from fragtracer.io import Model, read_model
from fragtracer.io.arrays import write_arrays
from fragtracer.io.toml import load
from fragtracer.scene import Geometry, Mesh, Part

from .data import SHARED, Gltf, shared

MODELS = (".obj", ".ply", ".gltf", ".glb")
MALFORMED = sorted(str(path.relative_to(SHARED)) for path in SHARED.glob("malformed/*/*/*") if path.suffix in MODELS)
MOST_SECONDS, MOST_BYTES = 5.0, 50e6


def outcome(path: Path) -> str:
    """What reading a file ends in: "model", or the message, within the limits."""
    tracemalloc.start()
    start = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            model = load(path).meshes[0]
        assert sum(len(part.geometry.triangles) for part in model.parts) > 0
        message = "model"
    except FragtracerError as error:
        message = str(error)
        assert message.startswith(f"{path}: ")
        assert "\n" not in message
        assert len(message) < 400
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert time.process_time() - start < MOST_SECONDS
    assert peak < MOST_BYTES
    return message


@pytest.mark.skipif(not MALFORMED, reason="there is no shared data")
def test_files_by_others() -> None:
    readable = [name for name in MALFORMED if outcome(shared(name)) == "model"]
    assert len(MALFORMED) >= 50
    assert readable == ["malformed/mesh/invalid/malformed2.obj"]


def test_command_line(tmp_path: Path) -> None:
    path = tmp_path / "malformed.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 12\n")
    command = [sys.executable, "-m", "fragtracer", "render", str(path), "-o", "none.png"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == f"fragtracer: {path}: line 5: v 12 does not exist; there are 3, counted from 1\n"


def stl_files(folder: Path) -> Iterator[Path]:
    """The same two triangles in ASCII and in binary."""
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1e-3, 0]], [[0, 0, 0], [0, 1, 0], [0, 0, 2]]], "<f4")
    lines = (" ".join(f"{'VERTEX':>9} {x:g} {y:e} {z:g}" for x, y, z in triangle) for triangle in corners)
    facets = "\n".join(f"facet normal 0 0 1\nouter loop\n{line}\nendloop\nendfacet" for line in lines)
    (folder / "ascii.stl").write_text(f"solid of vertex 1 2 3\n{facets}\nendsolid of vertex 1 2 3\n")
    yield folder / "ascii.stl"
    table = np.zeros(2, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    table["corners"] = corners
    (folder / "binary.stl").write_bytes(b"solid but binary".ljust(80, b"\0") + b"\2\0\0\0" + table.tobytes())
    yield folder / "binary.stl"


def test_stl(tmp_path: Path) -> None:
    for path in stl_files(tmp_path):
        geometry = read_model(path).mesh.parts[0].geometry
        corners = geometry.positions[geometry.triangles]
        np.testing.assert_allclose(corners[:, 1], [[1, 0, 0], [0, 1, 0]])
        np.testing.assert_allclose(corners[:, 2], [[0, 1e-3, 0], [0, 0, 2]], rtol=1e-6)
    text = (tmp_path / "ascii.stl").read_text()
    for changed, message in (
        (text.replace("VERTEX 1 ", "VERTEX one "), "a vertex needs three numbers, got one 0.0"),
        (text[: text.rindex("endsolid")], "ends before endsolid: it may be cut off"),
        (text.replace("VERTEX", "", 1), "a facet has not three vertices"),
        ("solid\nendsolid\n", "there are no triangles in this file"),
        ("nothing", "this is no STL file"),
    ):
        (tmp_path / "x.stl").write_text(changed)
        with pytest.raises(SceneError, match=message):
            read_model(tmp_path / "x.stl")
    (tmp_path / "x.stl").write_bytes((tmp_path / "binary.stl").read_bytes()[:-1])
    with pytest.raises(SceneError, match="ends before the last of its 2 triangles"):
        read_model(tmp_path / "x.stl")


def good_files(folder: Path) -> Iterator[Path]:
    """A file of each format, with most of what the format can hold."""
    picture = io.BytesIO()
    PIL.Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(picture, "PNG")
    gltf = Gltf(textures=[{"source": 0, "sampler": 0}], samplers=[{"wrapS": 33071}], extensionsUsed=["KHR_x"])
    gltf.content["images"] = [{"bufferView": gltf.view(picture.getvalue()), "mimeType": "image/png"}]
    gltf.content["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "MASK"}]
    gltf.content["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.7}}]
    gltf.content["nodes"] = [{"mesh": 0, "rotation": [0, 0, 0, 1]}, {"camera": 0, "translation": [0, 0, 5]}]
    gltf.content["scenes"] = [{"nodes": [0, 1]}]
    uv, normal = gltf.array([[0, 0], [1, 0], [0, 1]]), gltf.array([[0, 0, 1]] * 3)
    gltf.triangle(material=0, indices=gltf.array([0, 1, 2], "<u2"), attributes={"TEXCOORD_0": uv, "NORMAL": normal})
    yield gltf.write(folder / "good.glb")
    yield gltf.write(folder / "good.gltf")
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 2 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n"
    (folder / "good.obj").write_text(square + "usemtl a\nf 1/1/1 2/2/1 3/1/1 5/2/1 4/1/1\nf -1//1 -2//1 -3//1\n")
    yield folder / "good.obj"
    vertex = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
    faces = "property uchar green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\n"
    head = f"{vertex}{faces}end_header\n"
    rows = "0 0 0 1 2 3\n1 0 0 4 5 6\n1 1 0 7 8 9\n0 1 0 9 9 9\n3 0 1 2\n4 0 1 2 3\n"
    (folder / "good.ply").write_text(f"ply\nformat ascii 1.0\n{head}{rows}")
    yield folder / "good.ply"
    table = np.array(
        [((x, y, 0), (1, 2, 3)) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], [("p", ">f4", 3), ("c", "u1", 3)]
    )
    lists = b"\3" + np.array([0, 1, 2], ">i4").tobytes() + b"\4" + np.array([0, 1, 2, 3], ">i4").tobytes()
    binary = f"ply\nformat binary_big_endian 1.0\n{head}".encode() + table.tobytes() + lists
    (folder / "binary.ply").write_bytes(binary)
    yield folder / "binary.ply"
    yield from stl_files(folder)
    geometry = Geometry([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], uvs=[[0, 0], [1, 0], [0, 1]])
    write_arrays(folder / "good.npz", Mesh(parts=(Part(geometry, "red"),)))
    yield folder / "good.npz"


def test_files_cut_off_or_changed(tmp_path: Path) -> None:
    rng = np.random.default_rng(20261121)
    outcomes = set()
    for good in good_files(tmp_path):
        assert outcome(good) == "model"
        data = np.frombuffer(good.read_bytes(), np.uint8)
        broken = tmp_path / f"broken{good.suffix}"
        for round_ in range(150):
            changed = data.copy()
            if round_ % 3 == 0:
                changed = changed[: rng.integers(0, len(data))]
            else:
                places = rng.integers(0, len(data), rng.integers(1, 5))
                changed[places] = rng.integers(0, 256, len(places)) if round_ % 3 == 1 else rng.choice(list(b"019-/.e"))
            broken.write_bytes(changed.tobytes())
            outcomes.add(outcome(broken).replace(str(broken), ""))
    assert len(outcomes) > 50
    assert "model" in outcomes


WRONG: list[Any] = [
    None,
    -1,
    0,
    1,
    7,
    2**31,
    2**70,
    0.5,
    -1e30,
    1e300,
    "",
    "x",
    "data:,",
    [],
    [0],
    [1e30] * 3,
    {},
    True,
]


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The way to each value of a JSON document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield (*path, key)
        yield from places(item, (*path, key))


def test_documents_with_other_values(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    good = next(path for path in good_files(tmp_path) if path.suffix == ".gltf").read_text()
    ways = list(places(json.loads(good)))
    outcomes = set()
    for _ in range(400):
        document = json.loads(good)
        *way, last = ways[rng.integers(len(ways))]
        holder = reduce(lambda value, key: value[key], way, document)
        holder[last] = WRONG[rng.integers(len(WRONG))]
        (tmp_path / "x.gltf").write_text(json.dumps(document))
        outcomes.add(outcome(tmp_path / "x.gltf"))
    assert len(outcomes) > 50
    assert "model" in outcomes


@pytest.mark.parametrize("dtype", ["<f4", "<i2"])
def test_bytes_that_are_named_many_times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, dtype: str) -> None:
    """A file of 2 MB whose 300 accessors all lie in the same bytes: as they are, or each as other numbers."""
    monkeypatch.setattr("fragtracer.io.gltf.accessors._MOST_BYTES", 2**24)
    gltf = Gltf(nodes=[{"mesh": 0}])
    points = gltf.array(np.random.default_rng(1).integers(0, 100, (150_000, 3)), dtype)
    accessor = gltf.content["accessors"][points]
    gltf.content["accessors"] += [accessor | {"normalized": dtype != "<f4"} for _ in range(300)]
    indices = gltf.array([0, 1, 2], "<u1")
    gltf.content["meshes"] = [
        {"primitives": [{"attributes": {"POSITION": 1 + i}, "indices": indices} for i in range(300)]}
    ]
    message = outcome(gltf.write(tmp_path / "x.glb"))
    assert message == "model" if dtype == "<f4" else "with it all arrays take more than 16777216 bytes" in message


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.obj", "none.obj: no such file"),
        ("folder.ply", "folder.ply: not a regular file; give the path of one"),
        ("x.fbx", "cannot read this kind of model; choose from .obj, .ply, .stl, .gltf, .glb, .npz"),
        (f"{300 * 'x'}.obj", "File name too long"),
    ],
)
def test_files_that_cannot_be_read(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(SceneError, match=message.replace(".", r"\.")):
        read_model(tmp_path / name)


def test_arrays_that_lie(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    for arrays, message in (
        ({"a": np.zeros(3)}, "there is no array 0.positions"),
        ({"0.positions": np.zeros((3, 3))}, "there is no array 0.triangles"),
        ({"0.positions": np.array([{}])}, "it holds Python objects"),
    ):
        with path.open("wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        assert message in outcome(path)
    with path.open("wb") as file:
        np.savez_compressed(file, **{"0.positions": np.zeros((10**6, 3))})
    assert "compressed" in outcome(path)
    data = path.with_name("y.npz")
    with data.open("wb") as file:
        np.savez(file, **{"0.positions": np.zeros((3, 3))})
    path.write_bytes(data.read_bytes().replace(b"(3, 3), }     ", b"(99999999, 3)}"))
    assert "damaged or not one" in outcome(path)


def test_a_model_is_read_again_when_it_has_changed(tmp_path: Path) -> None:
    path = tmp_path / "x.obj"

    def read(text: str) -> Model:
        path.write_text(text)
        return read_model(path)

    first = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert read_model(path).mesh.parts[0].geometry is first.mesh.parts[0].geometry
    assert read("v 0 0 0\nv 1 0 0\nv 0 3 0\nf 1 2 3\n#\n").mesh.parts[0].geometry != first.mesh.parts[0].geometry


def test_a_model_that_changes_while_it_is_read_is_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, readers = tmp_path / "x.obj", models._READERS
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    def slow(path: Path) -> Model:
        model = readers[".obj"](path)
        time.sleep(0.02)  # the clock of files may be some milliseconds late
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 3 0\nf 1 2 3\n")
        return model

    with monkeypatch.context() as patched:
        patched.setattr(models, "_READERS", {".obj": slow})
        first = read_model(path)
    assert read_model(path).mesh.parts[0].geometry != first.mesh.parts[0].geometry
