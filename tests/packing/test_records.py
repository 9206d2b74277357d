# SPDX-License-Identifier: MIT
"""What shaders/ and packing/ say twice is the same: where the fields of records lie, and what numbers mean."""

import re
from enum import IntEnum

import numpy as np
import pytest

from fragtracer import bvh
from fragtracer.bvh.tree import MAX_DEPTH
from fragtracer.gpu.textures import WIDTH as TEXTURE_WIDTH
from fragtracer.packing import _ATTRIBUTE_FLAGS, atlas, materials, mirrors, pack, random_texture, shapes
from fragtracer.packing.hierarchy import MOST_RECORDS, RECORDS_IN_ROW
from fragtracer.packing.lights import LIGHT_RECORDS, MESH_LIGHT, LightKind
from fragtracer.packing.records import MATERIAL_RECORDS, MEDIUM_RECORDS, SIZES, BsdfModel, places, texel_count
from fragtracer.packing.shapes import SHAPE_RECORDS, SHAPE_TEXELS, Kind
from fragtracer.resources import folder
from fragtracer.scene import Disk, Material, Scene, Sphere

SHADERS = folder("shaders")
FOLDERS = ("scene", "light", "shape", "medium")
SCENE = "\n".join(path.read_text() for name in FOLDERS for path in sorted((SHADERS / name).glob("*.glsl")))
SCENE_RECORDS = MATERIAL_RECORDS | MEDIUM_RECORDS | LIGHT_RECORDS
RECORDS = SCENE_RECORDS | SHAPE_RECORDS | {"MeshLight": MESH_LIGHT}
NONE = dict.fromkeys(shapes._GEOMETRY, 0)
NO_WORDS, NO_BOUNDS = np.zeros((0, 4, 4), np.uint32), np.zeros((6, 0), np.float32)
NO_RECORDS = {
    "Ray",
    "Hit",
    "BvhRay",
    "Surface",
    "LightGroup",
    "LightSample",
    "Equiangular",
    "GridWalk",
    "MediumSample",
}  # structs of these folders that lie in no texture
LANES = "xyzw"


def read(path: str) -> str:
    return (SHADERS / path).read_text()


def code(text: str) -> str:
    """Without comments and white space but what separates words."""
    words = " ".join(re.sub(r"//.*", "", text).split())
    return re.sub(r" ?([^\w ]) ?", r"\1", words)


def snake(name: str) -> str:
    return re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower()


def field_text(kind: str, place: int) -> str:
    """What reads a field whose first word is ``place``."""
    size, lane = SIZES[kind], place % 4
    lanes = "" if size == 4 else f".{LANES[lane : lane + size]}"
    word = f"t{place // 4}{lanes}"
    if kind in ("float", "vec2", "vec3", "vec4"):
        return f"uintBitsToFloat({word})"
    return f"int({word})" if kind == "int" else word


def texels_text(name: str, count: int) -> str:
    """What the function that loads a record reads, texel by texel."""
    if name in SHAPE_RECORDS:
        return ", ".join(f"shape_texel(record, {i})" for i in range(count))
    return ", ".join("scene_texel(first)" if i == 0 else f"scene_texel(first + {i})" for i in range(count))


def expected(name: str) -> str:
    """The struct of a record and the functions that read it."""
    record, noun = RECORDS[name], snake(name)
    count = texel_count(record)
    fields = "".join(f"{kind} {field};" for field, kind in record)
    arguments = ", ".join(f"uvec4 t{i}" for i in range(count))
    values = ", ".join(field_text(kind, place) for _, kind, place in places(record))
    text = f"struct {name} {{ {fields} }};\n{name} {noun}_of({arguments}) {{ return {name}({values}); }}\n"
    if name in SHAPE_RECORDS:
        if name == "Node":  # the traversal alone reads them, with whatever else a record may be
            return text
        return text + f"{name} {noun}_load(int record) {{ return {noun}_of({texels_text(name, count)}); }}"
    if name in SCENE_RECORDS:
        body = f"int first = u_first_{noun} + {count} * index; return {noun}_of({texels_text(name, count)});"
    else:
        texel = "texel_read(u_mesh_lights, storage_place(index))"
        body = f"return {noun}_of({texel});"
    return text + f"{name} {noun}_load(int index) {{ {body} }}"


def disagreements(glsl: str) -> list[str]:
    """The records that the text of shaders/scene/ does not have as the table has them."""
    there = code(glsl)
    return [name for name in RECORDS if code(expected(name)) not in there]


def constants(text: str, prefix: str) -> dict[str, int]:
    """The whole numbers whose names begin so, without that."""
    found = re.findall(rf"^const u?int {prefix}(\w+) = (\d+)u?;", text, re.MULTILINE)
    return {name: int(number) for name, number in found}


def test_records_lie_where_the_shader_reads_them() -> None:
    assert not disagreements(SCENE)
    assert set(re.findall(r"^struct (\w+)", SCENE, re.MULTILINE)) == set(RECORDS) | NO_RECORDS


PLANTED = [
    ("Sphere", "float radius;\n    uint material;", "uint material;\n    float radius;"),  # moved
    ("Material", "vec3 f90;", "vec3 f9;"),  # another name
    ("Opacity", "int mode;", "uint mode;"),  # another type
    ("LightChoice", "int(t1.x), int(t1.y)", "int(t1.y), int(t1.x)"),  # another lane
    ("Flat", "uintBitsToFloat(t1.xyz), t1.w", "uintBitsToFloat(t2.xyz), t1.w"),  # another texel
    ("Texture", "first = u_first_texture + 4 * index", "first = u_first_texture + 3 * index"),
    ("SpotLight", "scene_texel(first + 2)", "scene_texel(first + 1)"),
    ("Triangle", "uint material;\n    vec3 c;\n    float density", "vec3 c;\n    float density; uint material"),
]


@pytest.mark.parametrize(("name", "before", "after"), PLANTED)
def test_a_change_is_found(name: str, before: str, after: str) -> None:
    start = SCENE.index(f"struct {name} {{")
    changed = SCENE[:start] + SCENE[start:].replace(before, after, 1)
    assert changed != SCENE
    assert name in disagreements(changed)


@pytest.mark.parametrize("name", RECORDS)
def test_a_moved_field_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the table, the first two fields changing places."""
    first, second, *rest = RECORDS[name]
    monkeypatch.setitem(RECORDS, name, (second, first, *rest))
    assert disagreements(SCENE) == [name]


def test_every_table_of_the_scene_has_its_offset() -> None:
    for name in SCENE_RECORDS:
        assert f"uniform int u_first_{snake(name)};" in SCENE, name


@pytest.mark.parametrize(
    ("enum", "text", "prefix"),
    [
        (Kind, SCENE, "KIND_"),
        (LightKind, read("light/light.glsl"), "LIGHT_"),
        (BsdfModel, read("bsdf/bsdf.glsl"), "BSDF_"),
    ],
)
def test_enums_agree(enum: type[IntEnum], text: str, prefix: str) -> None:
    assert constants(text, prefix) == {member.name: member.value for member in enum}


def test_flags_agree() -> None:
    shape = read("scene/shape.glsl")
    assert constants(shape, "SHAPE_") == {"CULLED": shapes.CULLED, "STORED": shapes.STORED}
    flags = {f"{noun.upper()}S": shapes.Shapes(NO_WORDS, NO_BOUNDS, {**NONE, noun: 1}).flags for noun in NONE}
    assert constants(SCENE, "BVH_") == flags | {"STACK": 2 * (MAX_DEPTH + 1)}
    ball, disk = Sphere((0, 0, 0), 1, "m"), Disk((0, 0, 0), (0, 1, 0), 1, "m")
    for name, some in {"SPHERES": {"spheres": (ball,)}, "FLATS": {"disks": (disk,)}}.items():
        scene = Scene(materials={"m": Material()}, **some)
        assert pack(scene, scene.render, 8, 8).flags["u_bvh_shapes"] == flags[name]
    material = read("scene/material.glsl")
    assert constants(material, "ALPHA_") == {mode.upper(): i for i, mode in enumerate(materials._ALPHA_MODES)}
    flags = {name: getattr(materials, f"MATERIAL_{name}") for name in ("UNLIT", "MAPPED", "BLACK_BACK", "INTERFACE")}
    assert constants(material, "MATERIAL_") == flags
    texture = read("scene/texture.glsl")
    assert constants(texture, "WRAP_") == {mode.upper(): i for i, mode in enumerate(materials._WRAP_MODES)}
    texture_flags = {"SRGB": atlas.TEXTURE_SRGB, "FLOAT": atlas.TEXTURE_FLOAT, "NEAREST": materials.TEXTURE_NEAREST}
    uses = {name.upper(): use for name, use in materials._USES.items()}
    assert constants(texture, "TEXTURE_") == texture_flags | uses
    attributes = {name.upper(): flag for name, flag in _ATTRIBUTE_FLAGS.items()}
    assert constants(read("scene/vertex.glsl"), "ATTRIBUTE_") == attributes


def test_sizes_agree() -> None:
    sampler = constants(read("sampler/texture.glsl"), "RANDOM_")
    assert sampler == {name: getattr(random_texture, name) for name in ("WIDTH", "LAYERS", "GROUP")}
    assert bvh.tree.WIDTH == 4  # node_intersect() of shape/bvh.glsl
    (alpha_delta,) = re.findall(r"^const float ALPHA_DELTA = (\S+);", read("bsdf/ggx.glsl"), re.MULTILINE)
    assert float(alpha_delta) == materials.ALPHA_DELTA
    (narrow,) = re.findall(r"^const float NARROW_WIDEST = (\S+);", read("integrator/vertex.glsl"), re.MULTILINE)
    assert float(narrow) == mirrors.NARROW_WIDEST


def test_textures_are_as_wide_as_they_are_read() -> None:
    """By masks and shifts: 4096 texels, and 1024 records of 4."""
    storage = code(read("scene/storage.glsl"))
    assert constants(read("scene/storage.glsl"), "SHAPE_") == {"TEXELS": SHAPE_TEXELS}
    assert code(f"ivec2(index & {TEXTURE_WIDTH - 1}, index >> {TEXTURE_WIDTH.bit_length() - 1})") in storage
    rows = RECORDS_IN_ROW.bit_length() - 1
    shift = SHAPE_TEXELS.bit_length() - 1
    assert code(f"ivec2((record & {RECORDS_IN_ROW - 1}) << {shift} | texel, record >> {rows})") in storage
    assert RECORDS_IN_ROW * SHAPE_TEXELS == TEXTURE_WIDTH
    assert 1 << rows == RECORDS_IN_ROW
    # A group of the traversal's stack: a record above 7 bits.
    assert MOST_RECORDS << 7 <= 2**32
    assert "first << 7u | rest" in read("shape/bvh.glsl")
