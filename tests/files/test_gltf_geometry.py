# SPDX-License-Identifier: MIT
"""Geometry of glTF files: arrays of all kinds, strips and fans, what is used of them, skins."""

from pathlib import Path

import numpy as np
import pytest

from fragtracer.errors import SceneError
from fragtracer.scene import Material
from fragtracer.scene.tangents import with_tangents

from .data import PNG, TRIANGLE, Gltf


@pytest.mark.parametrize("name", ["x.gltf", "x.glb"])
def test_triangle(tmp_path: Path, name: str) -> None:
    gltf = Gltf()
    gltf.triangle()
    model = gltf.read(tmp_path, name)
    [part] = model.mesh.parts
    np.testing.assert_array_equal(part.geometry.positions, TRIANGLE)
    assert part.geometry.triangles.tolist() == [[0, 1, 2]]
    assert part.geometry.normals is None
    assert model.materials == {"default": Material(albedo=(1, 1, 1), metallic=1, roughness=1, double_sided=False)}
    assert not model.ignored


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (4, [0, 1, 2, 2, 1, 3, 0], [[0, 1, 2], [2, 1, 3]]),
        (5, [0, 1, 2, 3, 4], [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
    ],
)
@pytest.mark.parametrize("dtype", ["<u1", "<u2", "<u4"])
def test_modes_and_types_of_indices(
    tmp_path: Path, mode: int, indices: list[int], expected: list[list[int]], dtype: str
) -> None:
    gltf = Gltf(nodes=[{"mesh": 0}], scenes=[{"nodes": [0]}])
    position = gltf.array(np.random.default_rng(1).random((5, 3)))
    primitive = {"attributes": {"POSITION": position}, "indices": gltf.array(indices, dtype), "mode": mode}
    gltf.content["meshes"] = [{"primitives": [primitive]}]
    assert gltf.read(tmp_path).mesh.parts[0].geometry.triangles.tolist() == expected


def test_strides_offsets_sparse_and_normalized(tmp_path: Path) -> None:
    gltf = Gltf(nodes=[{"mesh": 0}], scenes=[{"nodes": [0]}])
    table = np.zeros(3, [("pad", "<u4"), ("position", "<f4", 3), ("uv", "<u2", 2)])
    table["position"], table["uv"] = TRIANGLE, [[0, 65535], [65535, 0], [32768, 0]]
    view = gltf.view(table.tobytes(), stride=table.dtype.itemsize)
    rows, moved = gltf.view(np.array([1], "<u2").tobytes()), gltf.view(np.array([5, 6, 7], "<f4").tobytes())
    sparse = {"count": 1, "indices": {"bufferView": rows, "componentType": 5123}, "values": {"bufferView": moved}}
    shared_parts = {"bufferView": view, "count": 3}
    gltf.content["accessors"] += [
        {**shared_parts, "byteOffset": 4, "componentType": 5126, "type": "VEC3", "sparse": sparse},
        {**shared_parts, "byteOffset": 16, "componentType": 5123, "type": "VEC2", "normalized": True},
        {"count": 3, "componentType": 5126, "type": "VEC3", "sparse": sparse},
    ]
    color = gltf.array([[255, 0, 51, 127]] * 3, "<u1", normalized=True)
    normal = gltf.array([[0, 0, -128]] * 3, "<i1", normalized=True)
    attributes = {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": color, "NORMAL": normal}
    gltf.content["meshes"] = [{"primitives": [{"attributes": attributes}, {"attributes": {"POSITION": 2}}]}]
    first, second = (part.geometry for part in gltf.read(tmp_path).mesh.parts)
    np.testing.assert_array_equal(first.positions, [[0, 0, 0], [5, 6, 7], [0, 1, 0]])
    np.testing.assert_allclose(first.uvs, [[0, 1], [1, 0], [32768 / 65535, 0]])
    np.testing.assert_allclose(first.colors, [[1, 0, 0.2, 127 / 255]] * 3, rtol=1e-6)
    np.testing.assert_allclose(first.normals, [[0, 0, -1]] * 3)
    np.testing.assert_array_equal(second.positions, [[0, 0, 0], [5, 6, 7], [0, 0, 0]])


def test_skins_are_posed(tmp_path: Path) -> None:
    """Vertex 0 on a bone that has moved, 1 on one that has turned about z and was bound elsewhere, 2 between."""
    half = np.sqrt(0.5)
    gltf = Gltf(
        nodes=[
            {"mesh": 0, "skin": 0, "translation": [100, 100, 100]},
            {"translation": [0, 0, 3]},
            {"rotation": [0, 0, half, half], "children": [1]},
        ],
        scenes=[{"nodes": [0, 2]}],
    )
    bind = np.eye(4)
    bind[3, :3] = [1, 0, 0]  # the last column, as the file has columns
    inverse = gltf.view(np.array([np.eye(4), bind], "<f4").tobytes())
    gltf.content["accessors"].append({"bufferView": inverse, "componentType": 5126, "count": 2, "type": "MAT4"})
    gltf.content["skins"] = [{"joints": [1, 2], "inverseBindMatrices": 0}]
    joints = gltf.array([[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]], "<u1")
    weights = gltf.array([[1, 0, 0, 0], [1, 0, 0, 0], [0.5, 0.5, 0, 0]])
    normals = gltf.array([[1, 0, 0]] * 3)
    gltf.triangle(attributes={"JOINTS_0": joints, "WEIGHTS_0": weights, "NORMAL": normals})
    [part] = gltf.read(tmp_path).mesh.parts
    np.testing.assert_array_equal(part.matrix, np.eye(4))
    np.testing.assert_allclose(part.geometry.positions, [[0, 0, 3], [0, 2, 0], [-1, 0.5, 1.5]], atol=1e-6)
    np.testing.assert_allclose(part.geometry.normals, [[0, 1, 0]] * 3, atol=1e-6)


@pytest.mark.parametrize("has_tangents", [True, False])
def test_the_back_of_an_emitter_has_its_normal_map_reversed(tmp_path: Path, has_tangents: bool) -> None:
    """Its normals are those of the front reversed, so that its tangents and bitangents are (glTF 2.0, section
    3.9.6), whether the file has tangents or these are computed. Two materials may map one geometry differently."""
    gltf = Gltf(textures=[{"source": 0}])
    gltf.content["images"] = [{"bufferView": gltf.view(PNG), "mimeType": "image/png"}]
    glowing = {"emissiveFactor": [1, 1, 1], "doubleSided": True}
    gltf.content["materials"] = [
        glowing | {"normalTexture": {"index": 0, "texCoord": coordinates}} for coordinates in (0, 1)
    ]
    attributes = {
        "POSITION": gltf.array(TRIANGLE),
        "TEXCOORD_0": gltf.array([[0, 1], [1, 1], [0, 0]]),
        "TEXCOORD_1": gltf.array([[0, 0], [0, 1], [1, 0]]),
    }
    if has_tangents:
        attributes["NORMAL"] = gltf.array([[0, 0, 1]] * 3)
        attributes["TANGENT"] = gltf.array([[1, 0, 0, 1]] * 3)
    gltf.content["meshes"] = [{"primitives": [{"attributes": attributes, "material": m} for m in (0, 1)]}]
    gltf.content |= {"nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}
    model = gltf.read(tmp_path)
    frames = []
    for part in model.mesh.parts:
        texture = model.materials[part.material].normal_texture
        assert texture is not None
        geometry = with_tangents(part.geometry, texture.coordinates)
        assert geometry.tangents is not None
        a, b, c = geometry.positions[geometry.triangles[0]]
        normal, tangent = np.cross(b - a, c - a), geometry.tangents[geometry.triangles[0, 0]]
        frames.append((tangent[:3], tangent[3] * np.cross(normal, tangent[:3]), normal))
    first, second = ([1, 0, 0], [0, 1, 0], [0, 0, 1]), ([0, 1, 0], [-1, 0, 0], [0, 0, 1])
    fronts = [first, first if has_tangents else second]
    expected = [np.multiply(side, front) for front in fronts for side in (1, -1)]
    np.testing.assert_allclose(frames, expected, atol=1e-7)


def test_primitives_keep_the_vertices_that_they_use(tmp_path: Path) -> None:
    gltf = Gltf(nodes=[{"mesh": 0}], materials=[{"name": name} for name in ("a", "a (2)", "a")])
    positions = [[3 * i, i * i, 0] for i in range(100)]
    attributes = {"POSITION": gltf.array(positions), "TEXCOORD_0": gltf.array(np.eye(100)[:, :2])}
    rows = ([7, 8, 9], [99, 1, 7], [0, 1, 2])
    gltf.content["meshes"] = [
        {"primitives": [{"attributes": attributes, "indices": gltf.array(row, "<u2")} for row in rows]}
    ]
    for index, primitive in enumerate(gltf.content["meshes"][0]["primitives"]):
        primitive["material"] = index
    model = gltf.read(tmp_path)
    for part, row in zip(model.mesh.parts, rows, strict=True):
        assert len(part.geometry.positions) == 3
        assert part.geometry.uvs is not None
        np.testing.assert_array_equal(part.geometry.positions[part.geometry.triangles[0], 0], np.multiply(row, 3))
        np.testing.assert_array_equal(part.geometry.uvs[part.geometry.triangles[0]], np.eye(100)[row, :2])
    assert list(model.materials) == ["a", "a (2)", "a (2) (2)"]


@pytest.mark.parametrize("normalized", [True, False])
@pytest.mark.parametrize("dtype", ["<u1", "<u2"])
def test_colors_of_vertices_are_fractions(tmp_path: Path, dtype: str, normalized: bool) -> None:
    most = np.iinfo(dtype).max
    gltf = Gltf()
    gltf.triangle(attributes={"COLOR_0": gltf.array([[0, most, 0, most]] * 3, dtype, normalized=normalized)})
    [part] = gltf.read(tmp_path).mesh.parts
    np.testing.assert_array_equal(part.geometry.colors, [[0, 1, 0, 1]] * 3)


def test_places_of_an_instanced_mesh(tmp_path: Path) -> None:
    """Where nodes of their own would have it, below the node's own matrix; what is not said of them is as of nodes."""
    rng = np.random.default_rng(4)
    moves, turns, sizes = rng.random((3, 3)), np.eye(4)[[3, 0, 1]] * 0.6 + 0.2, rng.random((3, 3))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    turns = np.round(turns * 32767) / 32767
    above = {"translation": [1, 2, 3], "scale": [2, 1, 1]}
    children = [
        {"mesh": 0, "translation": t.tolist(), "rotation": r.tolist(), "scale": s.tolist()}
        for t, r, s in zip(moves, turns, sizes, strict=True)
    ]
    apart = Gltf(nodes=[{**above, "children": [1, 2, 3]}, *children])
    apart.triangle()
    expected = [np.array(part.matrix) for part in apart.read(tmp_path).mesh.parts]
    name = "EXT_mesh_gpu_instancing"
    gltf = Gltf(extensionsUsed=[name], extensionsRequired=[name])
    places = {
        "TRANSLATION": gltf.array(moves),
        "ROTATION": gltf.array(np.round(turns * 32767), "<i2", normalized=True),
        "SCALE": gltf.array(sizes),
    }
    extensions = {name: {"attributes": places}}
    gltf.content["nodes"] = [{"mesh": 2, **above, "extensions": extensions}]
    for _ in range(3):
        gltf.triangle()
    model = gltf.read(tmp_path)
    assert not model.ignored
    np.testing.assert_allclose([part.matrix for part in model.mesh.parts], expected, atol=1e-6)
    del places["ROTATION"], places["SCALE"]
    moved = [np.array(part.matrix) for part in gltf.read(tmp_path).mesh.parts]
    np.testing.assert_allclose(
        moved,
        [[[2, 0, 0, 2 * x + 1], [0, 1, 0, y + 2], [0, 0, 1, z + 3], [0, 0, 0, 1]] for x, y, z in moves],
        atol=1e-6,
    )
    assert len({id(part.geometry) for part in model.mesh.parts}) == 1


def test_morph_targets_have_the_weights_of_node_or_mesh(tmp_path: Path) -> None:
    """Those of the node come first; where there are none, or 0, nothing moves. Two nodes share what is the same."""
    gltf = Gltf(nodes=[{"mesh": 0}, {"mesh": 0, "weights": [0, 0]}, {"mesh": 0, "weights": [1, -2]}, {"mesh": 0}])
    moves = np.random.default_rng(6).random((2, 3, 3))
    turned = gltf.array([[1, 0, 0]] * 3)
    targets = [{"POSITION": gltf.array(moves[0]), "NORMAL": turned}, {"POSITION": gltf.array(moves[1])}]
    gltf.triangle(targets=targets, attributes={"NORMAL": gltf.array([[0, 0, 1]] * 3)})
    gltf.content["meshes"][0]["weights"] = [0.5, 0.25]
    gltf.content["scenes"] = [{"nodes": [0, 1, 2, 3]}]
    model = gltf.read(tmp_path)
    assert not model.ignored
    found = [part.geometry for part in model.mesh.parts]
    assert found[0] is found[3]
    for geometry, (a, b) in zip(found, [(0.5, 0.25), (0, 0), (1, -2)], strict=False):
        np.testing.assert_allclose(geometry.positions, TRIANGLE + a * moves[0] + b * moves[1], atol=1e-6)
        assert geometry.normals is not None
        direction = geometry.normals[0] / np.linalg.norm(geometry.normals[0])
        np.testing.assert_allclose(direction, np.array([a, 0, 1]) / np.hypot(a, 1), atol=1e-6)
    far = gltf.array([[3e38, np.inf, 0]] * 3)
    gltf.content["meshes"][0] |= {"weights": [3e38, -1]}
    targets[:] = [{"POSITION": far}, {"POSITION": far}]
    with pytest.raises(SceneError, match=r"primitives\[0\]: positions must be finite"):
        gltf.read(tmp_path)
    targets[0]["POSITION"] = gltf.array(moves[0, :2])
    with pytest.raises(SceneError, match=r"primitives\[0\].targets.POSITION: has 2 rows for 3 vertices"):
        gltf.read(tmp_path)
