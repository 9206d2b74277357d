# SPDX-License-Identifier: MIT
"""glTF files with something wrong: what is wrong, and where, is said; small files stay small."""

from pathlib import Path
from typing import Any

import pytest

from fragtracer.errors import SceneError
from fragtracer.io import read_model

from .data import PNG, TRIANGLE, Gltf


def broken(change: Any) -> Gltf:
    gltf = Gltf()
    gltf.triangle(indices=gltf.array([0, 1, 2], "<u2"))
    change(gltf.content)
    return gltf


MISTAKES: dict[str, tuple[Any, str]] = {
    "required": (
        lambda d: d.update(extensionsRequired=["KHR_x", "EXT_y"]),
        "this model needs KHR_x, EXT_y, which is not supported; save it without",
    ),
    "least version": (
        lambda d: d.update(asset={"version": "2.1", "minVersion": "2.1"}),
        "asset.minVersion: it wants readers of glTF 2.1",
    ),
    "version": (lambda d: d.update(asset={"version": "1.0"}), "this is glTF 1.0; only 2.0 is read"),
    "no asset": (lambda d: d.pop("asset"), "asset: is missing"),
    "type": (lambda d: d.update(meshes=3), "meshes: must be an array, got 3"),
    "negative": (
        lambda d: d["accessors"][0].update(count=-1),
        "accessors[0].count: must be at least 0, got -1",
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
    "circle": (
        lambda d: d.update(nodes=[{"children": [0], "mesh": 0}]),
        "nodes[0]: has two parents, or is its own ancestor",
    ),
    "two parents": (
        lambda d: d.update(nodes=[{"children": [1, 1]}, {"mesh": 0}]),
        "nodes[1]: has two parents, or is its own ancestor",
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
        'materials[0].extensions.KHR_materials_ior: ior: must be a number, got "x"',
    ),
    "no extension": (
        lambda d: (
            d["meshes"][0]["primitives"][0].update(material=0),
            d.update(materials=[{"extensions": {"KHR_materials_ior": 3}}]),
        ),
        "materials[0].extensions.KHR_materials_ior: must be an object, got 3",
    ),
    "matrix": (
        lambda d: d.update(nodes=[{"matrix": [1] * 15}]),
        "nodes[0].matrix: must have at least 16 elements, not 15",
    ),
    "short vector": (lambda d: d.update(nodes=[{"scale": [1, 2]}]), "nodes[0].scale[2]: is missing"),
    "word": (
        lambda d: d.update(materials=[{"alphaMode": "mask"}]),
        "materials[0].alphaMode: must be 'OPAQUE', 'MASK' or",
    ),
    "coat": (
        lambda d: (
            d["meshes"][0]["primitives"][0].update(material=0),
            d.update(materials=[{"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 2}}}]),
        ),
        "materials[0].extensions.KHR_materials_clearcoat: clearcoatFactor: must be at most 1, got 2",
    ),
    "sheen": (
        lambda d: (
            d["meshes"][0]["primitives"][0].update(material=0),
            d.update(materials=[{"extensions": {"KHR_materials_sheen": {"sheenColorFactor": [0, 1.5, 0]}}}]),
        ),
        "materials[0].extensions.KHR_materials_sheen: sheenColorFactor[1]: must be at most 1, got 1.5",
    ),
    "film": (
        lambda d: (
            d["meshes"][0]["primitives"][0].update(material=0),
            d.update(materials=[{"extensions": {"KHR_materials_iridescence": {"iridescenceIor": 0.9}}}]),
        ),
        "materials[0].extensions.KHR_materials_iridescence: iridescenceIor: must be at least 1, got 0.9",
    ),
    "diffuse transmission": (
        lambda d: (
            d["meshes"][0]["primitives"][0].update(material=0),
            d.update(
                materials=[{"extensions": {"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": -1}}}]
            ),
        ),
        "materials[0].extensions.KHR_materials_diffuse_transmission: diffuseTransmissionFactor: must be at least 0",
    ),
    "light": (
        lambda d: d.update(nodes=[{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}]),
        "nodes[0].light: there is no number 0, only 0",
    ),
    "cone": (
        lambda d: d.update(
            nodes=[{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}],
            extensions={"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {"outerConeAngle": 2}}]}},
        ),
        "document.extensions.KHR_lights_punctual: lights[0].spot.outerConeAngle: must be at most 1.571, got 2",
    ),
    "large": (
        lambda d: d.update(nodes=[{"mesh": 0, "scale": [1e30, 1, 1]}]),
        "this model has bounds of 1e+30 m; scale it",
    ),
    "places": (
        lambda d: d.update(nodes=[{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {}}}}]),
        "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes: must have TRANSLATION, ROTATION or SCALE, and as many",
    ),
    "far places": (
        lambda d: d.update(
            nodes=[
                {
                    "mesh": 0,
                    "translation": [3e38, 0, 0],
                    "scale": [3e38, 1, 1],
                    "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}},
                }
            ]
        ),
        "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes: one of the places is not finite, or overflows",
    ),
    "joint": (
        lambda d: (
            d.update(nodes=[{"mesh": 0, "skin": 0}], skins=[{"joints": [3]}]),
            d["meshes"][0]["primitives"][0]["attributes"].update(JOINTS_0=1, WEIGHTS_0=1),
        ),
        "skins[0]: its joint 3 is not a node of the scene",
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
        "nodes[1]: its world matrix overflows",
    ),
    "projection": (
        lambda d: d.update(nodes=[{"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0], "mesh": 0}]),
        "nodes[0].matrix: the last of each four numbers must be 0, 0, 0 and 1",
    ),
    "lines": (
        lambda d: d["meshes"][0]["primitives"][0].update(mode=1),
        "the scene of this file has no triangles; points and lines are not drawn, make a mesh of them",
    ),
    "nothing": (lambda d: d.update(nodes=[{}]), "the scene of this file has no triangles"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_named(tmp_path: Path, name: str) -> None:
    change, message = MISTAKES[name]
    with pytest.raises(SceneError) as raised:
        broken(change).read(tmp_path)
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


def test_a_small_file_does_not_become_a_large_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fragtracer.io.gltf.geometry._MOST_TRIANGLES", 5)
    monkeypatch.setattr("fragtracer.io.gltf.materials._MOST_PIXELS", 11)
    gltf = Gltf(nodes=[{"mesh": 0}])
    gltf.content["images"] = [{"bufferView": gltf.view(PNG)} for _ in range(3)]
    gltf.content["textures"] = [{"source": index} for index in range(3)]
    gltf.content["materials"] = [{"normalTexture": {"index": index}} for index in range(3)]
    primitives = [{"attributes": {"POSITION": gltf.array(TRIANGLE)}, "material": index % 3} for index in range(6)]
    gltf.content["meshes"] = [{"primitives": primitives[:2]}]
    gltf.read(tmp_path)
    gltf.content["meshes"] = [{"primitives": primitives[:3]}]
    with pytest.raises(SceneError, match="images: more than 11 pixels together; make them smaller"):
        gltf.read(tmp_path)
    for primitive in primitives:
        del primitive["material"]
    gltf.content["meshes"] = [{"primitives": primitives}]
    with pytest.raises(SceneError, match=r"primitives\[5\]: with it the model has more than 5 triangles"):
        gltf.read(tmp_path)
