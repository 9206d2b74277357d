# SPDX-License-Identifier: MIT
"""glTF files: the tree of nodes, arrays of all kinds, materials, cameras and lights, and what is not shown."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from fragtracer.errors import SceneError
from fragtracer.importers import Model, bounds, read_model
from fragtracer.scene import Material
from fragtracer.scene_file import load

from .data import Gltf, shared

PNG = io.BytesIO()
PIL.Image.fromarray(np.arange(16, dtype=np.uint8).reshape(2, 2, 4)).save(PNG, "PNG")
TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def read(tmp_path: Path, gltf: Gltf, name: str = "x.gltf") -> Model:
    return read_model(gltf.write(tmp_path / name))


@pytest.mark.parametrize("name", ["x.gltf", "x.glb"])
def test_triangle(tmp_path: Path, name: str) -> None:
    gltf = Gltf()
    gltf.triangle()
    model = read(tmp_path, gltf, name)
    [part] = model.mesh.parts
    np.testing.assert_array_equal(part.geometry.positions, TRIANGLE)
    assert part.geometry.triangles.tolist() == [[0, 1, 2]]
    assert part.geometry.normals is None
    assert model.materials == {"default": Material(albedo=(1, 1, 1), metallic=1, roughness=1, double_sided=False)}
    assert not model.ignored


def test_nodes_multiply_from_the_root(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    gltf = Gltf(
        nodes=[
            {"children": [1, 2], "translation": [10, 0, 0]},
            {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 3, 4]},
            {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 5, 6, 7, 1]},
            {"mesh": 0},
        ],
        scenes=[{"nodes": [3]}, {"nodes": [0]}],
        scene=1,
    )
    gltf.triangle()
    model = read(tmp_path, gltf)
    assert model.mesh.parts[0].geometry is model.mesh.parts[1].geometry
    points = [
        part.geometry.positions @ np.array(part.matrix)[:3, :3].T + np.array(part.matrix)[:3, 3]
        for part in model.mesh.parts
    ]
    np.testing.assert_allclose(points[0], [[10, 0, 0], [10, 2, 0], [7, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(points[1], [[15, 6, 7], [16, 6, 7], [15, 6, 6]], atol=1e-12)


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
    assert read(tmp_path, gltf).mesh.parts[0].geometry.triangles.tolist() == expected


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
    first, second = (part.geometry for part in read(tmp_path, gltf).mesh.parts)
    np.testing.assert_array_equal(first.positions, [[0, 0, 0], [5, 6, 7], [0, 1, 0]])
    np.testing.assert_allclose(first.uvs, [[0, 1], [1, 0], [32768 / 65535, 0]])
    np.testing.assert_allclose(first.colors, [[1, 0, 0.2, 127 / 255]] * 3, rtol=1e-6)
    np.testing.assert_allclose(first.normals, [[0, 0, -1]] * 3)
    np.testing.assert_array_equal(second.positions, [[0, 0, 0], [5, 6, 7], [0, 0, 0]])


def test_materials(tmp_path: Path) -> None:
    transform = {"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 1, "scale": [2, 3], "texCoord": 1}}
    material: dict[str, Any] = {
        "name": "all",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 1.0000001, 0.4],
            "baseColorTexture": {"index": 0, "extensions": transform},
            "metallicFactor": 0.6,
            "roughnessFactor": 0.7,
            "metallicRoughnessTexture": {"index": 1},
        },
        "normalTexture": {"index": 1, "scale": -2, "texCoord": 1},
        "occlusionTexture": {"index": 1, "strength": 0.5},
        "emissiveTexture": {"index": 0},
        "emissiveFactor": [1, 0.5, 0],
        "alphaMode": "MASK",
        "alphaCutoff": 0.3,
        "doubleSided": True,
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 10},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_unlit": {},
        },
    }
    tinted = {"extensions": {"KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 30]}}}
    old = {"diffuseFactor": [0.1, 0.2, 0.3, 0.4], "specularFactor": [0.5, 0.6, 0.7], "glossinessFactor": 0.75}
    older = {"extensions": {"KHR_materials_pbrSpecularGlossiness": {**old, "diffuseTexture": {"index": 0}}}}
    gltf = Gltf(
        materials=[material, {"name": "all"}, tinted, {"extensions": {"KHR_materials_ior": {"ior": 0}}}, older],
        samplers=[{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        textures=[{"source": 0, "sampler": 0}, {"source": 1}],
    )
    (tmp_path / "a b.png").write_bytes(PNG.getvalue())
    gltf.content["images"] = [{"bufferView": gltf.view(PNG.getvalue()), "mimeType": "image/png"}, {"uri": "a%20b.png"}]
    position = gltf.array(TRIANGLE)
    primitives = [{"attributes": {"POSITION": position}, "material": index} for index in range(5)]
    gltf.content |= {"meshes": [{"primitives": primitives}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}
    model = read(tmp_path, gltf)
    made = model.materials["all"]
    assert (made.albedo, made.opacity, made.metallic, made.roughness) == ((0.1, 0.2, 1), 0.4, 0.6, 0.7)
    assert (made.emission, made.ior, made.unlit, made.double_sided) == ((10, 5, 0), 1.33, True, True)
    assert (made.alpha_mode, made.alpha_cutoff, made.normal_scale) == ("mask", 0.3, -2)
    assert made.occlusion_strength == 0.5
    base = made.albedo_texture
    assert base is not None
    assert (base.wrap_u, base.wrap_v, base.filter, base.coordinates) == ("clamp", "mirror", "nearest", 1)
    assert (base.offset, base.rotation, base.scale) == ((0.5, 0.25), 1, (2, 3))
    assert (base.image.color_space, base.image.file) == ("srgb", None)
    np.testing.assert_array_equal(base.image.pixels, np.arange(16).reshape(2, 2, 4))
    for texture, channel in (
        (made.metallic_texture, "b"),
        (made.roughness_texture, "g"),
        (made.occlusion_texture, "r"),
    ):
        assert texture is not None
        assert (texture.channel, texture.image.color_space) == (channel, "linear")
        assert texture.image.file == str(tmp_path / "a b.png")
    assert made.normal_texture is not None
    assert made.normal_texture.coordinates == 1
    assert list(model.materials) == ["all", "all (1)", "material 2", "material 3", "material 4"]
    made = model.materials["material 4"]
    assert (made.albedo, made.opacity, made.f0) == ((0.1, 0.2, 0.3), 0.4, (0.5, 0.6, 0.7))
    assert (made.roughness, made.metallic) == (0.25, 0)
    assert made.albedo_texture is not None
    assert model.materials["material 2"].specular == 0.5
    assert model.materials["material 2"].f0 == pytest.approx((0.04, 0.02, 1))
    assert model.materials["material 3"].f0 == (1, 1, 1)


def test_cameras_and_lights(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    lights = [
        {"type": "point", "intensity": 3, "color": [1, 0.5, 0]},
        {"type": "directional", "intensity": 2},
        {"type": "spot", "spot": {}},
    ]
    link = [{"extensions": {"KHR_lights_punctual": {"light": index}}} for index in range(3)]
    gltf = Gltf(
        extensionsUsed=["KHR_lights_punctual"],
        extensions={"KHR_lights_punctual": {"lights": lights}},
        cameras=[
            {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "zfar": 1, "znear": 0}},
            {"type": "perspective", "perspective": {"yfov": np.pi / 4, "znear": 0.1}},
        ],
        nodes=[
            {"mesh": 0},
            {"camera": 0},
            {"camera": 1, "translation": [7, 0, 0], "rotation": [0, half, 0, half], "scale": [3, 3, 3]},
            {**link[0], "translation": [1, 2, 3]},
            {**link[1], "rotation": [-half, 0, 0, half]},
            link[2],
        ],
        scenes=[{"nodes": list(range(6))}],
    )
    gltf.triangle()
    with pytest.warns(UserWarning, match="ignored: orthographic cameras, spot lights$"):
        model = read(tmp_path, gltf)
    [camera] = model.cameras
    assert camera.fov_degrees == pytest.approx(45)
    np.testing.assert_allclose(camera.position, [7, 0, 0])
    np.testing.assert_allclose(camera.target, [0.5, 0, 0], atol=1e-12)
    np.testing.assert_allclose(camera.up, [0, 3, 0], atol=1e-12)
    point, sun = model.lights
    assert point.position == (1, 2, 3)
    np.testing.assert_allclose(point.intensity, [3, 1.5, 0])
    towards = np.subtract(sun.position, [0.5, 0.5, 0])
    np.testing.assert_allclose(towards / np.linalg.norm(towards), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(np.array(sun.intensity) / (towards @ towards), 2)


@pytest.mark.parametrize("normalized", [True, False])
@pytest.mark.parametrize("dtype", ["<u1", "<u2"])
def test_colors_of_vertices_are_fractions(tmp_path: Path, dtype: str, normalized: bool) -> None:
    most = np.iinfo(dtype).max
    gltf = Gltf()
    gltf.triangle(attributes={"COLOR_0": gltf.array([[0, most, 0, most]] * 3, dtype, normalized=normalized)})
    [part] = read(tmp_path, gltf).mesh.parts
    np.testing.assert_array_equal(part.geometry.colors, [[0, 1, 0, 1]] * 3)


@pytest.mark.parametrize(("mode", "cutoff", "opacity"), [("MASK", 1, 1), ("MASK", 1.01, 0), ("BLEND", 2, 1)])
def test_a_mask_that_no_alpha_reaches_is_not_there(tmp_path: Path, mode: str, cutoff: float, opacity: float) -> None:
    gltf = Gltf(materials=[{"alphaMode": mode, "alphaCutoff": cutoff}])
    gltf.triangle(material=0)
    material = read(tmp_path, gltf).materials["material 0"]
    assert (material.opacity, material.alpha_cutoff) == (opacity, 1)


@pytest.mark.parametrize(
    ("aspect", "size"),
    [(None, (640, 480)), (1, (480, 480)), (16 / 9, (640, 360)), (0.5, (240, 480)), (1e30, (640, 1)), (1e-30, (1, 480))],
)
def test_the_picture_has_the_shape_that_the_first_camera_gives_it(
    tmp_path: Path, aspect: float | None, size: tuple[int, int]
) -> None:
    perspectives = [{"yfov": 1.0, "znear": 0.1}, {"yfov": 1.0, "znear": 0.1, "aspectRatio": 3}]
    if aspect is not None:
        perspectives[0]["aspectRatio"] = aspect
    gltf = Gltf(
        cameras=[{"type": "perspective", "perspective": item} for item in perspectives],
        nodes=[{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]}, {"camera": 1, "translation": [0, 0, 5]}],
        scenes=[{"nodes": [0, 1, 2]}],
    )
    gltf.triangle()
    with pytest.warns(UserWarning, match="ignored: cameras after the first$"):
        scene = load(gltf.write(tmp_path / "x.glb"))
    assert scene.camera.position == (0, 0, 3)
    assert (scene.render.width, scene.render.height) == size


def test_what_is_not_shown_is_listed(tmp_path: Path) -> None:
    gltf = Gltf(
        extensionsUsed=["KHR_draco_mesh_compression", "KHR_materials_unlit", "KHR_materials_clearcoat"],
        animations=[{}],
        nodes=[{"mesh": 0}],
        images=[{"uri": "none.png"}],
        textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    )
    weights = gltf.array([[1, 0, 0, 0]] * 3)
    gltf.triangle(material=0, targets=[{"POSITION": 0}], attributes={"COLOR_1": weights, "_ID": weights})
    gltf.content["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 1})
    with pytest.warns(UserWarning, match="ignored") as caught:
        model = read(tmp_path, gltf)
    assert len(caught) == 1
    assert str(caught[0].message).endswith(
        "x.gltf: ignored: KHR_draco_mesh_compression, KHR_materials_clearcoat, animations, "
        "morph targets (shown without), COLOR_1, _ID, "
        "images[0]: none.png: no such file, points and lines"
    )
    assert model.materials["material 0"].albedo_texture is None


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
    [part] = read(tmp_path, gltf).mesh.parts
    np.testing.assert_array_equal(part.matrix, np.eye(4))
    np.testing.assert_allclose(part.geometry.positions, [[0, 0, 3], [0, 2, 0], [-1, 0.5, 1.5]], atol=1e-6)
    np.testing.assert_allclose(part.geometry.normals, [[0, 1, 0]] * 3, atol=1e-6)


def test_primitives_keep_the_vertices_that_they_use(tmp_path: Path) -> None:
    gltf = Gltf(nodes=[{"mesh": 0}], materials=[{"name": name} for name in ("a", "a (2)", "a")])
    attributes = {"POSITION": gltf.array(np.arange(300).reshape(100, 3)), "TEXCOORD_0": gltf.array(np.eye(100)[:, :2])}
    rows = ([7, 8, 9], [99, 1, 7], [0, 1, 2])
    gltf.content["meshes"] = [
        {"primitives": [{"attributes": attributes, "indices": gltf.array(row, "<u2")} for row in rows]}
    ]
    for index, primitive in enumerate(gltf.content["meshes"][0]["primitives"]):
        primitive["material"] = index
    model = read(tmp_path, gltf)
    for part, row in zip(model.mesh.parts, rows, strict=True):
        assert len(part.geometry.positions) == 3
        assert part.geometry.uvs is not None
        np.testing.assert_array_equal(part.geometry.positions[part.geometry.triangles[0], 0], np.multiply(row, 3))
        np.testing.assert_array_equal(part.geometry.uvs[part.geometry.triangles[0]], np.eye(100)[row, :2])
    assert list(model.materials) == ["a", "a (2)", "a (2) (2)"]


def test_a_small_file_does_not_become_a_large_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fragtracer.importers.gltf.geometry._MOST_TRIANGLES", 5)
    monkeypatch.setattr("fragtracer.importers.gltf.materials._MOST_PIXELS", 11)
    gltf = Gltf(nodes=[{"mesh": 0}])
    gltf.content["images"] = [{"bufferView": gltf.view(PNG.getvalue())} for _ in range(3)]
    gltf.content["textures"] = [{"source": index} for index in range(3)]
    gltf.content["materials"] = [{"normalTexture": {"index": index}} for index in range(3)]
    primitives = [{"attributes": {"POSITION": gltf.array(TRIANGLE)}, "material": index % 3} for index in range(6)]
    gltf.content["meshes"] = [{"primitives": primitives[:2]}]
    read(tmp_path, gltf)
    gltf.content["meshes"] = [{"primitives": primitives[:3]}]
    with pytest.raises(SceneError, match="images: more than 11 pixels together; make them smaller"):
        read(tmp_path, gltf)
    for primitive in primitives:
        del primitive["material"]
    gltf.content["meshes"] = [{"primitives": primitives}]
    with pytest.raises(SceneError, match=r"primitives\[5\]: with it the model has more than 5 triangles"):
        read(tmp_path, gltf)


def broken(change: Any) -> Gltf:
    gltf = Gltf()
    gltf.triangle(indices=gltf.array([0, 1, 2], "<u2"))
    change(gltf.content)
    return gltf


MISTAKES: dict[str, tuple[Any, str]] = {
    "required": (
        lambda d: d.update(extensionsRequired=["KHR_x", "EXT_y"]),
        "this model needs KHR_x, EXT_y, which is not supp",
    ),
    "version": (lambda d: d.update(asset={"version": "1.0"}), "this is glTF 1.0; only 2.0 is read"),
    "no asset": (lambda d: d.pop("asset"), "asset: Field required"),
    "type": (lambda d: d.update(meshes=3), "meshes: must be a valid list"),
    "negative": (
        lambda d: d["accessors"][0].update(count=-1),
        "accessors[0].count: must be greater than or equal",
    ),
    "huge": (lambda d: d["accessors"][0].update(count=4_000_000_000), "accessors[0]: 4000000000 elements end behind"),
    "huge zeros": (
        lambda d: d["accessors"][1].update(count=4_000_000_000, bufferView=None),
        "accessors[1]: claims 4000000000 elements, but has no data",
    ),
    "view": (lambda d: d["accessors"][0].update(bufferView=7), "accessors[0].bufferView: there is no number 7, only 2"),
    "view end": (lambda d: d["bufferViews"][0].update(byteLength=10**9), "bufferViews[0]: ends behind its buffer"),
    "buffer": (lambda d: d["bufferViews"][0].update(buffer=3), "bufferViews[0].buffer: there is no number 3, only 1"),
    "stride": (
        lambda d: d["bufferViews"][1].update(byteStride=4),
        "accessors[1]: its elements of 12 bytes overlap, 4 bytes apart",
    ),
    "index": (
        lambda d: d["accessors"][1].update(count=2),
        "meshes[0].primitives[0]: triangles must hold whole",
    ),
    "kind": (
        lambda d: d["meshes"][0]["primitives"][0]["attributes"].update(POSITION=0),
        "meshes[0].primitives[0].attributes.POSITION: must be an accessor of type VEC3, not SCALAR",
    ),
    "fractions": (
        lambda d: d["meshes"][0]["primitives"][0].update(indices=2),
        "meshes[0].primitives[0].indices: there is no number 2, only 2 of them",
    ),
    "no position": (
        lambda d: d["meshes"][0]["primitives"][0].update(attributes={}),
        "meshes[0].primitives[0]: has no POSITION",
    ),
    "circle": (lambda d: d.update(nodes=[{"children": [0], "mesh": 0}]), "nodes[0]: is below two nodes, or below it"),
    "two parents": (
        lambda d: d.update(nodes=[{"children": [1, 1]}, {"mesh": 0}]),
        "nodes[1]: is below two nodes, or below itself",
    ),
    "node": (lambda d: d.update(scenes=[{"nodes": [4]}]), "nodes: there is no number 4, only 1"),
    "scene": (lambda d: d.update(scene=4), "scene: there is no number 4, only 1"),
    "mesh": (lambda d: d.update(nodes=[{"mesh": 4}]), "nodes[0].mesh: there is no number 4"),
    "material": (
        lambda d: d["meshes"][0]["primitives"][0].update(material=4),
        "meshes[0].primitives[0].material: there is no number 4, only 0",
    ),
    "texture": (
        lambda d: (
            d["meshes"][0]["primitives"][0].update(material=0),
            d.update(materials=[{"normalTexture": {"index": 9}}]),
        ),
        "materials[0]: texture: there is no number 9, only 0",
    ),
    "extension": (
        lambda d: (
            d["meshes"][0]["primitives"][0].update(material=0),
            d.update(materials=[{"extensions": {"KHR_materials_ior": {"ior": "x"}}}]),
        ),
        "materials[0].extensions.KHR_materials_ior: ior: must be a valid number",
    ),
    "light": (
        lambda d: d.update(nodes=[{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}]),
        "nodes[0].light: there is no number 0, only 0",
    ),
    "large": (lambda d: d.update(nodes=[{"mesh": 0, "scale": [1e30, 1, 1]}]), "this model reaches 1e+30 m; scale it"),
    "joint": (
        lambda d: (
            d.update(nodes=[{"mesh": 0, "skin": 0}], skins=[{"joints": [3]}]),
            d["meshes"][0]["primitives"][0]["attributes"].update(JOINTS_0=1, WEIGHTS_0=1),
        ),
        "skins[0]: its joint 3 is no node of the scene",
    ),
    "joints": (
        lambda d: (
            d.update(nodes=[{"mesh": 0, "skin": 0}], skins=[{"joints": [0]}]),
            d["accessors"].append({"componentType": 5126, "count": 3, "type": "VEC4"}),
            d["meshes"][0]["primitives"][0]["attributes"].update(JOINTS_0=2, WEIGHTS_0=2),
        ),
        "meshes[0].primitives[0]: its JOINTS_0 and WEIGHTS_0 do not fit",
    ),
    "far": (
        lambda d: d.update(nodes=[{"scale": [1e30, 1, 1], "children": [1]}, {"mesh": 0, "scale": [1e30, 1, 1]}]),
        "nodes[1]: its place in the world is too far",
    ),
    "nothing": (lambda d: d.update(nodes=[{}]), "the scene of this file has no triangles"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_named(tmp_path: Path, name: str) -> None:
    change, message = MISTAKES[name]
    with pytest.raises(SceneError) as raised:
        read(tmp_path, broken(change))
    assert str(raised.value).startswith(f"{tmp_path / 'x.gltf'}: {message}")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not JSON"),
        ("[]", "a glTF document is a JSON object, not list"),
        ("[" * 100_000, "nested too deeply"),
        ('{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 1e400}]}', "buffers[0].byteLength: must be"),
        ('{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "http://x/y"}]}', "only files relative"),
        ('{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "/etc/x"}]}', "only files relative"),
        ('{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "none"}]}', "none: no such file"),
        ('{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "data:;base64,AA"}]}', "is not base64"),
        ('{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "data:;base64,AA=="}]}', "only 1 bytes"),
    ],
)
def test_broken_text(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "x.gltf").write_text(text)
    with pytest.raises(SceneError) as raised:
        read_model(tmp_path / "x.gltf")
    assert str(raised.value).startswith(f"{tmp_path / 'x.gltf'}: ")
    assert message in str(raised.value)


BOX = (12, (-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
REAL = {
    "Box/glTF-Binary/Box.glb": BOX,
    "Box/glTF-Embedded/Box.gltf": BOX,
    "Box/glTF/Box.gltf": BOX,
    "BoxTextured/glTF-Binary/BoxTextured.glb": BOX,
    "BoxTextured/glTF-Embedded/BoxTextured.gltf": BOX,
    "BoxTextured/glTF-pbrSpecularGlossiness/BoxTextured.gltf": BOX,
    "BoxTextured/glTF/BoxTextured.gltf": BOX,
    "Cameras/glTF-Embedded/Cameras.gltf": (2, (0, 0, -0.70759), (1, 0.706623, 0)),
    "Cameras/glTF/Cameras.gltf": (2, (0, 0, -0.70759), (1, 0.706623, 0)),
    "SimpleMeshes/glTF-Embedded/SimpleMeshes.gltf": (2, (0, 0, 0), (2, 1, 0)),
    "SimpleMeshes/glTF/SimpleMeshes.gltf": (2, (0, 0, 0), (2, 1, 0)),
    "TextureCoordinateTest/glTF-Embedded/TextureCoordinateTest.gltf": (10, (-1.2, -1.2, 0), (1.2, 1.2, 0.052591)),
    "TextureCoordinateTest/glTF/TextureCoordinateTest.gltf": (10, (-1.2, -1.2, 0), (1.2, 1.2, 0.052591)),
    "Triangle/glTF-Embedded/Triangle.gltf": (1, (0, 0, 0), (1, 1, 0)),
    "Triangle/glTF/Triangle.gltf": (1, (0, 0, 0), (1, 1, 0)),
}


@pytest.mark.filterwarnings("ignore:.*ignored:UserWarning")
@pytest.mark.parametrize("name", REAL)
def test_real_files(name: str) -> None:
    triangles, low, high = REAL[name]
    model = read_model(shared("gltf", name))
    assert sum(len(part.geometry.triangles) for part in model.mesh.parts) == triangles
    np.testing.assert_allclose(bounds(model.mesh), [low, high], atol=1e-5)
    if name.startswith("BoxTextured"):
        texture = model.materials["Texture"].albedo_texture
        assert texture is not None
        assert texture.image.pixels.shape[:2] == (256, 256)
    if name.startswith("Box/"):
        assert model.materials["Red"].albedo == pytest.approx((0.8, 0, 0))
        assert model.materials["Red"].metallic == 0
    if name.startswith("Cameras"):
        assert model.ignored == ("orthographic cameras",)
        [camera] = model.cameras
        np.testing.assert_allclose(camera.position, [0.5, 0.5, 3])
        assert camera.fov_degrees == pytest.approx(np.degrees(0.7))
    else:
        assert model.cameras == ()


def test_texture_coordinate_test_is_laid_out_as_its_readme_says() -> None:
    model = read_model(shared("gltf", "TextureCoordinateTest/glTF/TextureCoordinateTest.gltf"))
    corner = {"TopLeft": (0, 0), "TopRight": (1, 0), "BottomLeft": (0, 1), "BottomRight": (1, 1)}
    for part in model.mesh.parts:
        name = part.material.removesuffix("Material")
        if name in corner:
            points = part.geometry.positions @ np.array(part.matrix)[:3, :3].T + np.array(part.matrix)[:3, 3]
            center = points.mean(axis=0)
            # Its front is -z, so its right is -x.
            assert (int(center[0] < 0), int(center[1] < 0)) == corner[name]
            assert part.geometry.uvs is not None
            np.testing.assert_allclose(np.round(part.geometry.uvs.mean(axis=0)), corner[name])
