# SPDX-License-Identifier: MIT
"""Buffer views compressed by meshoptimizer are what they were before, and damaged ones are named."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.io.gltf.meshopt import EXTENSIONS
from fragtracer.scene import Geometry

from .data import Gltf

meshopt = pytest.importorskip("meshopt", reason="meshopt is not installed")

COUNT = 40
_RNG = np.random.default_rng(5)
POSITIONS = _RNG.normal(size=(COUNT, 3)).astype(np.float32)
NORMALS = POSITIONS / np.linalg.norm(POSITIONS, axis=1)[:, None]
COLORS = _RNG.random((COUNT, 4))
INDICES = _RNG.permutation(np.repeat(np.arange(COUNT, dtype=np.uint32), 3))


def compressed(gltf: Gltf, values: NDArray[Any], mode: str, dtype: str, encoded: bytes, **more: Any) -> int:
    """The accessor of ``values`` (count, width), of which the file has those ``encoded`` alone: what readers without
    the extension would need is in a buffer that is not there."""
    accessor = gltf.array(values, dtype, **({} if dtype in ("<f4", "<u4", "<u2") else {"normalized": True}))
    gltf.data = gltf.data[: gltf.content["bufferViews"].pop()["byteOffset"]]
    where, stride = gltf.content["bufferViews"].pop(gltf.view(encoded)), values[0].nbytes
    extension = {**where, "byteStride": stride, "count": len(values), "mode": mode, **more}
    view = {"buffer": 1, "byteLength": values.nbytes, "extensions": {EXTENSIONS[1]: extension}}
    gltf.content["bufferViews"].append(view | ({"byteStride": stride} if mode == "ATTRIBUTES" else {}))
    return accessor


def mesh(extension: str = EXTENSIONS[1], mode: str = "TRIANGLES", version: int = 0) -> Gltf:
    """Positions as they are, normals and colours by filters, and indices."""
    gltf = Gltf(nodes=[{"mesh": 0}], extensionsUsed=[extension], extensionsRequired=[extension])
    gltf.others = [{"byteLength": 10**4, "extensions": {extension: {"fallback": True}}}]
    rows = {
        "NORMAL": meshopt.encode_filter_oct(np.column_stack([NORMALS, np.ones(COUNT)]).astype(np.float32), 4, 8),
        "COLOR_0": meshopt.encode_filter_color(COLORS.astype(np.float32), 4, 8),
        "POSITION": POSITIONS.view(np.uint8).reshape(COUNT, 12),
    }
    if version == 0:
        rows["POSITION"] = meshopt.encode_filter_exp(POSITIONS, 24)
    kinds = {"NORMAL": ("<i1", "OCTAHEDRAL"), "COLOR_0": ("<u1", "COLOR")}
    attributes = {}
    for name, bytes_of_rows in rows.items():
        dtype, kind = kinds.get(name, ("<f4", "NONE" if version else "EXPONENTIAL"))
        data = meshopt.encode_gltf_buffer(bytes_of_rows, "ATTRIBUTES", version)
        values = bytes_of_rows.view(dtype)
        attributes[name] = compressed(gltf, values, "ATTRIBUTES", dtype, data, filter=kind)
        if name == "NORMAL":  # the fourth byte of an element fills it up
            gltf.content["accessors"][-1]["type"] = "VEC3"
    dtype = "<u4" if version else "<u2"
    indices = INDICES.astype(dtype)
    number = compressed(gltf, indices[:, None], mode, dtype, meshopt.encode_gltf_buffer(INDICES, mode))
    gltf.content["meshes"] = [{"primitives": [{"attributes": attributes, "indices": number}]}]
    for view in gltf.content["bufferViews"]:
        view["extensions"] = {extension: next(iter(view["extensions"].values()))}
    return gltf


def geometry(gltf: Gltf, tmp_path: Path, name: str = "x.gltf") -> Geometry:
    model = gltf.read(tmp_path, name)
    assert not model.ignored
    [part] = model.mesh.parts
    return part.geometry


@pytest.mark.parametrize(
    ("extension", "mode", "version", "name"),
    [(EXTENSIONS[0], "INDICES", 1, "x.glb"), (EXTENSIONS[1], "TRIANGLES", 0, "x.gltf")],
)
def test_what_is_compressed_is_what_it_was(tmp_path: Path, extension: str, mode: str, version: int, name: str) -> None:
    """All modes and filters but that of quaternions, which nothing here reads; both versions of the codec."""
    found = geometry(mesh(extension, mode, version), tmp_path, name)
    order = np.arange(3 * COUNT).reshape(-1, 3)
    if mode == "TRIANGLES":  # each may begin with another of its corners
        turned = np.stack([np.roll(INDICES.reshape(-1, 3), k, axis=1) for k in range(3)])
        assert (turned == found.triangles).all(axis=2).any(axis=0).all()
    else:
        np.testing.assert_array_equal(found.triangles, INDICES[order])
    np.testing.assert_allclose(found.positions, POSITIONS, rtol=0, atol=0 if version else 1e-6)
    assert found.normals is not None
    assert found.colors is not None
    np.testing.assert_allclose(found.normals, NORMALS, atol=0.02)
    np.testing.assert_allclose(found.colors, COLORS[:, : found.colors.shape[1]], atol=0.02)


def test_what_is_there_uncompressed_needs_no_decoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gltf = Gltf(extensionsUsed=[EXTENSIONS[1]])
    gltf.triangle()
    where = {"buffer": 0, "byteLength": 4, "byteStride": 12, "count": 3, "mode": "ATTRIBUTES"}
    gltf.content["bufferViews"][0]["extensions"] = {EXTENSIONS[1]: where}
    with pytest.raises(SceneError, match="its data are damaged"):
        gltf.read(tmp_path)
    monkeypatch.setitem(sys.modules, "meshopt", None)
    assert len(gltf.read(tmp_path).mesh.parts[0].geometry.triangles) == 1


def test_mistakes_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = f"bufferViews[2].extensions.{EXTENSIONS[1]}"  # of the positions, which are read first

    def message(**changes: Any) -> str:
        gltf = mesh()
        gltf.content["bufferViews"][2]["extensions"][EXTENSIONS[1]] |= changes
        with pytest.raises(SceneError) as raised:
            gltf.read(tmp_path)
        return str(raised.value).removeprefix(f"{tmp_path / 'x.gltf'}: ")

    assert message(byteLength=90) == f"{place}: its data are damaged, or no 40 ATTRIBUTES of 12 bytes"
    assert message(mode="TRIANGLES") == f"{place}: its data are damaged, or no 40 TRIANGLES of 12 bytes"
    assert message(count=2**40) == f"{place}: {2**40} elements of 12 bytes are not the 480 of its view"
    assert "ends behind its buffer" in message(byteLength=10**6)
    assert message(buffer=1) == "buffers[1]: has no uri, and there is no binary chunk for it"
    assert message(mode="POINTS") == f"{place}: mode: must be 'ATTRIBUTES', 'TRIANGLES' or 'INDICES', got \"POINTS\""
    monkeypatch.setitem(sys.modules, "meshopt", None)
    assert message() == f"{place}: this model is compressed; pip install 'fragtracer[meshopt]'"


def test_claims_of_much_memory_are_refused(tmp_path: Path) -> None:
    gltf = mesh()
    view = gltf.content["bufferViews"][2]
    view["extensions"][EXTENSIONS[1]]["count"] = 2**30
    view["byteLength"] = 12 * 2**30
    with pytest.raises(SceneError, match="takes more than 4294967296 bytes"):
        gltf.read(tmp_path)


def test_damaged_data_are_named_or_read(tmp_path: Path) -> None:
    rng, messages = np.random.default_rng(7), set()
    for _ in range(60):
        gltf = mesh()
        data = bytearray(gltf.data)
        for place in rng.integers(0, len(data), 3):
            data[place] = rng.integers(0, 256)
        gltf.data = bytes(data)
        try:
            gltf.read(tmp_path)
        except SceneError as error:
            messages.add(str(error).partition(": its data")[2])
    assert " are damaged, or no 120 TRIANGLES of 2 bytes" in messages
