# SPDX-License-Identifier: MIT
"""Primitives compressed by Draco are what they were before, and damaged ones are named."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.io import Model
from fragtracer.io.gltf.draco import EXTENSION

from .data import Gltf

draco = pytest.importorskip("DracoPy", reason="DracoPy is not installed")

SIDE = 12


def patch_of_a_sphere() -> dict[str, NDArray[Any]]:
    """Vertices of a grid of SIDE x SIDE, with all that Draco keeps of them, and their triangles."""
    u, v = (grid.ravel() for grid in np.meshgrid(*2 * [np.linspace(0, 1, SIDE)]))
    normals = np.column_stack([np.sin(u) * np.cos(v), np.sin(v), np.cos(u) * np.cos(v)])
    first = (np.arange(SIDE - 1) + SIDE * np.arange(SIDE - 1)[:, None]).ravel()
    corners = np.concatenate([first[:, None] + [0, 1, SIDE], first[:, None] + [1, SIDE + 1, SIDE]])
    return {
        "POSITION": 2 * normals + [1, 0, 0],
        "NORMAL": normals,
        "TEXCOORD_0": np.column_stack([u, v]),
        "COLOR_0": np.round(255 * np.column_stack([u, v, 0.5 * u])).astype(np.uint8),
        "triangles": corners.astype(np.uint32),
    }


def encoded(arrays: dict[str, NDArray[Any]], level: int = 7) -> bytes:
    data: bytes = draco.encode(
        arrays["POSITION"].astype(np.float32),
        arrays["triangles"],
        quantization_bits=16,
        compression_level=level,
        normals=arrays["NORMAL"],
        tex_coord=arrays["TEXCOORD_0"],
        colors=arrays["COLOR_0"],
    )
    return data


def compressed(arrays: dict[str, NDArray[Any]], data: bytes, **primitive: Any) -> Gltf:
    """A file of one primitive, of which there are the compressed data alone."""
    gltf = Gltf(extensionsUsed=[EXTENSION], extensionsRequired=[EXTENSION], nodes=[{"mesh": 0}])
    kinds = {array["attribute_type"]: array["unique_id"] for array in draco.decode(encoded(arrays)).attributes}
    numbers = {name: kinds[kind] for kind, name in enumerate(("POSITION", "NORMAL", "COLOR_0", "TEXCOORD_0"))}
    for name in numbers:
        shape, number = arrays[name].shape, 5121 if name == "COLOR_0" else 5126
        more = {"normalized": True} if name == "COLOR_0" else {}
        accessor = {"componentType": number, "count": shape[0], "type": f"VEC{shape[1]}", **more}
        gltf.content["accessors"].append(accessor)
    attributes = {name: i for i, name in enumerate(numbers)}
    extension = {"bufferView": gltf.view(data), "attributes": numbers}
    gltf.content["meshes"] = [
        {"primitives": [{"attributes": attributes, "extensions": {EXTENSION: extension}, **primitive}]}
    ]
    return gltf


def corners(model: Model) -> NDArray[np.float64]:
    """Position, normal, texture coordinates and colour of each corner, (triangles, 3, 11), in the order of the grid."""
    [part] = model.mesh.parts
    found = part.geometry
    assert found.normals is not None
    assert found.uvs is not None
    assert found.colors is not None
    rows = np.column_stack([found.positions, found.normals, found.uvs, found.colors])[found.triangles]
    keys = np.round(rows[..., 6:8] * (SIDE - 1)) @ [SIDE, 1]
    turn = (keys.argmin(axis=1)[:, None] + np.arange(3)) % 3
    rows, keys = np.take_along_axis(rows, turn[..., None], 1), np.take_along_axis(keys, turn, 1)
    return rows[np.lexsort(keys.T[::-1])]


@pytest.mark.parametrize("level", [0, 10])
def test_compressed_triangles_are_what_they_were(tmp_path: Path, level: int) -> None:
    """One after another, and as Edgebreaker has them, which sorts vertices and triangles anew."""
    arrays = patch_of_a_sphere()
    plain = Gltf(nodes=[{"mesh": 0}])
    types = {"COLOR_0": "<u1"}
    attributes = {
        name: plain.array(values, types.get(name, "<f4"), **({"normalized": True} if name in types else {}))
        for name, values in arrays.items()
        if name != "triangles"
    }
    indices = plain.array(arrays["triangles"].ravel(), "<u4")
    plain.content["meshes"] = [{"primitives": [{"attributes": attributes, "indices": indices}]}]
    expected = corners(plain.read(tmp_path))
    for mode in (4, 5):  # strips are triangles when they are decoded
        model = compressed(arrays, encoded(arrays, level), mode=mode).read(tmp_path, "x.glb")
        assert not model.ignored
        np.testing.assert_allclose(corners(model), expected, atol=2e-4)


def test_what_is_there_uncompressed_needs_no_decoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    gltf = Gltf(extensionsUsed=[EXTENSION])
    gltf.triangle(extensions={EXTENSION: {"bufferView": 0, "attributes": {"POSITION": 0}}})
    assert len(gltf.read(tmp_path).mesh.parts[0].geometry.triangles) == 1


def test_mistakes_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arrays = patch_of_a_sphere()
    data, place = encoded(arrays), f"meshes[0].primitives[0].extensions.{EXTENSION}"

    def message(gltf: Gltf) -> str:
        with pytest.raises(SceneError) as raised:
            gltf.read(tmp_path)
        return str(raised.value).removeprefix(f"{tmp_path / 'x.gltf'}: ")

    assert message(compressed(arrays, data[:-40])) == f"{place}: its data are damaged, or no mesh"
    points = draco.encode(arrays["POSITION"].astype(np.float32))
    assert message(compressed(arrays, points)) == f"{place}: its data are points, not triangles"
    fewer = compressed(arrays, data)
    fewer.content["accessors"][0]["count"] -= 1
    assert "POSITION: accessors[0] wants (143, 3) numbers of type float32, not (144, 3)" in message(fewer)
    other = compressed(arrays, data)
    other.content["meshes"][0]["primitives"][0]["extensions"][EXTENSION]["attributes"]["NORMAL"] = 9
    assert message(other) == f"{place}.attributes.NORMAL: there is no array 9 in its data"
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    assert message(compressed(arrays, data)).endswith("this model is compressed; pip install 'fragtracer[draco]'")


def test_damaged_data_are_named_or_read(tmp_path: Path) -> None:
    rng, arrays = np.random.default_rng(7), patch_of_a_sphere()
    good, messages = np.frombuffer(encoded(arrays), np.uint8), set()
    for _ in range(60):
        changed = good.copy()
        places = rng.integers(0, len(good) if rng.random() < 0.5 else 40, 3)
        changed[places] = rng.integers(0, 256, 3)
        try:
            compressed(arrays, changed.tobytes()).read(tmp_path)
        except SceneError as error:
            messages.add(str(error).partition(": ")[2])
    assert f"meshes[0].primitives[0].extensions.{EXTENSION}: its data are damaged, or no mesh" in messages
