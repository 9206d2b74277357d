# SPDX-License-Identifier: MIT
"""How records lie in memory, written once: the texels of numpy and the GLSL that reads them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Record = tuple[tuple[str, str], ...]

# Fields fill texels of four floats in this order and never straddle two of them.
RECORDS: dict[str, Record] = {
    "Sphere": (("center", "vec3"), ("radius", "float"), ("material", "int"), ("light", "int")),
    "Plane": (("normal", "vec3"), ("offset", "float"), ("material", "int")),
    "Rectangle": (("plane", "vec4"), ("u_row", "vec4"), ("v_row", "vec4"), ("material", "int"), ("light", "int")),
    "Triangle": (("plane", "vec4"), ("u_row", "vec4"), ("v_row", "vec4"), ("material", "int"), ("light", "int")),
    "Material": (
        *(("diffuse", "vec3"), ("alpha", "float"), ("f0", "vec3"), ("f90", "vec3"), ("emission", "vec3")),
        ("unlit", "int"),
    ),
    "Maps": (  # one for each material, where any has textures; -1 is no texture
        *(("albedo", "vec3"), ("roughness", "float"), ("dielectric_f0", "vec3"), ("metallic", "float")),
        *(("dielectric_f90", "vec3"), ("normal_scale", "float")),
        *(("albedo_texture", "int"), ("roughness_texture", "int"), ("metallic_texture", "int")),
        *(("normal_texture", "int"), ("emission_texture", "int"), ("occlusion_texture", "int")),
        ("occlusion_strength", "float"),
    ),
    "Opacity": (
        *(("opacity", "float"), ("mode", "int"), ("cutoff", "float"), ("texture_index", "int")),
        ("one_sided", "int"),
    ),
    "Texture": (
        *(("u_row", "vec3"), ("coordinates", "int")),  # u = u_row . (u, v, 1) of the set `coordinates`
        *(("v_row", "vec3"), ("channel", "int")),
        *(("x", "int"), ("y", "int"), ("width", "int"), ("height", "int")),  # texels of `layer`
        *(("layer", "int"), ("flags", "int"), ("wrap_u", "int"), ("wrap_v", "int")),
    ),
    "Light": (
        *(("radiance", "vec3"), ("probability", "float")),  # of being chosen
        *(("position", "vec3"), ("radius", "float")),  # a sphere's centre, or the corner the edges leave from
        *(("edge_u", "vec3"), ("cumulative", "float")),  # probability of this light and those before it
        *(("edge_v", "vec3"), ("area", "float")),
        *(("normal", "vec3"), ("kind", "int"), ("primitive", "int")),
    ),
}
# Of meshes (packing/meshes.py): words of 32 bits, told apart by the last one of their first texel.
MESH_TREE_RECORDS: dict[str, Record] = {
    "MeshNode": (  # bounds of children in steps of 2^exponent from the origin, a byte for each child
        *(("origin", "vec3"), ("kind", "uint")),  # the kind in the highest byte, biased exponents of x, y, z below it
        *(("x", "uvec2"), ("y", "uvec2"), ("z", "uvec2")),  # lower bounds, upper bounds
        *(("first", "uint"), ("count", "uint")),  # of the children, which are side by side
    ),
    "MeshTriangle": (
        *(("a", "vec3"), ("kind", "uint")),  # flags in the lower bytes
        *(("b", "vec3"), ("material", "uint"), ("c", "vec3")),
        ("density", "float"),  # per area, of a light sample of all meshes; 0: no light
        ("vertices", "uvec3"),
    ),
    "MeshInstance": (  # to its own space: rows * (p - translation)
        *(("row_x", "vec3"), ("kind", "uint")),
        *(("row_y", "vec3"), ("root", "uint"), ("row_z", "vec3"), ("material", "uint")),
        ("translation", "vec3"),
    ),
}
# Floats.
MESH_RECORDS: dict[str, Record] = {
    "MeshLight": (("threshold", "float"), ("record", "int"), ("other", "int")),
    # Only the fields that a scene needs.
    "MeshVertex": (("normal", "vec3"), ("uv", "vec2"), ("uv_1", "vec2"), ("tangent", "vec4"), ("color", "vec4")),
}
MESH_TREE_TEXELS = 4  # of each record of a tree; what a traversal needs is in the first three
_SIZES = {"int": 1, "uint": 1, "float": 1, "vec2": 2, "uvec2": 2, "vec3": 3, "uvec3": 3, "vec4": 4}
SHAPES = ("Sphere", "Plane", "Rectangle", "Triangle")

# Above this, code made for each record grows faster than it gains.
_MAX_SELECTED = 8
# A round of a traversal loop takes this many shapes where there are more than that: llvmpipe stops a
# draw after 65,535 rounds of all its loops together.
_UNROLLED = 16


def texels_of(name: str, rows: Sequence[Mapping[str, Any]]) -> NDArray[np.float32]:
    """The texels, float32 (n, 4), of records of the kind ``name``, each a mapping of fields to values;
    fields that are left out are 0."""
    record = RECORDS[name]
    stride = _stride(record)
    texels = np.zeros((len(rows), stride * 4), np.float32)
    for field, kind, place in _places(record):
        for texel, row in zip(texels, rows, strict=True):
            if field in row:
                texel[place : place + _SIZES[kind]] = row[field]
    return texels.reshape(-1, 4)


def texels_of_columns(record: Record, columns: Mapping[str, Any], count: int) -> NDArray[np.float32]:
    """The texels, float32 (count, texels, 4), of records whose fields are given as arrays or numbers."""
    texels = np.zeros((count, _stride(record) * 4), np.float32)
    for field, kind, place in _places(record):
        if field in columns:
            size = _SIZES[kind]
            texels[:, place if size == 1 else slice(place, place + size)] = columns[field]
    return texels.reshape(count, _stride(record), 4)


def words_of_columns(record: Record, columns: Mapping[str, Any], count: int) -> NDArray[np.uint32]:
    """As :func:`texels_of_columns`, but uint32 (count, MESH_TREE_TEXELS, 4), with the bits of what is a float."""
    words = np.zeros((count, MESH_TREE_TEXELS * 4), np.uint32)
    for field, kind, place in _places(record):
        if field in columns:
            size = _SIZES[kind]
            values = np.asarray(columns[field])
            values = values.astype(np.uint32) if kind.startswith("u") else values.astype(np.float32).view(np.uint32)
            words[:, place if size == 1 else slice(place, place + size)] = values
    return words.reshape(count, MESH_TREE_TEXELS, 4)


def mesh_layout(vertex_fields: Sequence[str]) -> str:
    """GLSL structs for the records of meshes, and functions that make them of their texels.

    ``vertex_fields`` are those of MeshVertex that are packed.
    """
    records = MESH_RECORDS | {"MeshVertex": vertex_record(vertex_fields)}
    parts = [_texel_glsl(name, record, "uvec4") for name, record in MESH_TREE_RECORDS.items()]
    return "\n".join(parts + [_texel_glsl(name, record, "vec4") for name, record in records.items() if record])


def vertex_record(fields: Sequence[str]) -> Record:
    """MeshVertex with these fields alone."""
    return tuple(field for field in MESH_RECORDS["MeshVertex"] if field[0] in fields)


def _texel_glsl(name: str, record: Record, texel: str) -> str:
    noun = "".join("_" + c.lower() if c.isupper() else c for c in name).removeprefix("_")
    fields = "".join(f" {kind} {field};" for field, kind in record)
    texels = ", ".join(f"{texel} t{i}" for i in range(_stride(record)))
    value = _glsl_value if texel == "vec4" else _glsl_value_of_words
    values = ", ".join(value(kind, place) for _, kind, place in _places(record))
    return f"struct {name} {{{fields} }};\n{name} {noun}_of({texels}) {{ return {name}({values}); }}\n"


def _places(record: Record) -> Iterable[tuple[str, str, int]]:
    """Name, type and first float of each field."""
    place = 0
    for name, kind in record:
        if place % 4 + _SIZES[kind] > 4:
            place += 4 - place % 4
        yield name, kind, place
        place += _SIZES[kind]


def _stride(record: Record) -> int:
    *_, (_, kind, place) = _places(record)
    return -(-(place + _SIZES[kind]) // 4)


def scene_layout(records: Mapping[str, Sequence[Any]], texels: NDArray[np.float32], baked: bool) -> str:
    """GLSL that reads ``texels``, the records of all kinds one after the other.

    For each kind: a struct; ``x_load(i)`` for an index that is the same for all pixels, ``x_select(i)``
    for one that differs between them; and for shapes ``FOR_EACH_X(BODY)``, which runs the macro
    ``BODY(i)`` for all of them.
    """
    parts = [_STORAGE]
    if baked:
        rows = ", ".join(f"vec4({', '.join(repr(float(x)) for x in texel)})" for texel in texels)
        parts.append(f"const vec4 BAKED_SCENE[SCENE_TEXELS] = vec4[]({rows});\n")
    first = 0
    for name, rows_of in records.items():
        parts.append(_record_glsl(name, first, len(rows_of), baked))
        first += _stride(RECORDS[name]) * len(rows_of)
    return "\n".join(parts)


def _record_glsl(name: str, first: int, count: int, baked: bool) -> str:
    stride = _stride(RECORDS[name])
    fields = "".join(f" {kind} {field};" for field, kind in RECORDS[name])
    values = ", ".join(_glsl_value(kind, place) for _, kind, place in _places(RECORDS[name]))
    head, tail = f"{name} {name.lower()}", f"    return {name}({values});\n}}\n"
    load = f"{head}_load(int index) {{\n    int base = {first} + {stride} * index;\n"
    source = "BAKED_SCENE[{}]" if baked else "scene_texel({})"
    load += "".join(f"    vec4 t{i} = {source.format(f'base + {i}')};\n" for i in range(stride)) + tail
    select = f"{head}_select(int index) {{\n"
    if baked and count <= _MAX_SELECTED:
        select += "".join(f"    vec4 t{i} = {source.format(first + i)};\n" for i in range(stride) if count)
        for k in range(1, count):
            select += "".join(
                f"    t{i} = index == {k} ? {source.format(first + stride * k + i)} : t{i};\n" for i in range(stride)
            )
    else:
        select += f"    int base = {first} + {stride} * index;\n"
        select += "".join(f"    vec4 t{i} = scene_texel(base + {i});\n" for i in range(stride))
    select += tail
    code = f"struct {name} {{{fields} }};\n"
    if count:
        code += load + select
    if name in SHAPES:
        loop = " ".join(f"BODY({i})" for i in range(count)) if baked else _loop(count)
        code += f"#define FOR_EACH_{name.upper()}(BODY) {loop}\n"
    return code


def loop_rounds(count: int) -> int:
    """How often the loop over ``count`` shapes goes round."""
    return count if count <= 4 * _UNROLLED else -(-count // _UNROLLED)


def _loop(count: int) -> str:
    """GLSL that runs BODY for 0 to count - 1, several in a round where there are many."""
    if count <= 4 * _UNROLLED:
        return f"for (int i_ = 0; i_ < {count}; i_++) {{ BODY(i_) }}" if count else ""
    whole = count - count % _UNROLLED
    round_of = " ".join(f"BODY(i_ + {i})" for i in range(_UNROLLED))
    rest = " ".join(f"BODY({i})" for i in range(whole, count))
    return f"for (int i_ = 0; i_ < {whole}; i_ += {_UNROLLED}) {{ {round_of} }} {rest}"


def _glsl_value(kind: str, place: int) -> str:
    value = _glsl_lanes(kind, place)
    return f"int({value})" if kind == "int" else value


def _glsl_value_of_words(kind: str, place: int) -> str:
    value = _glsl_lanes(kind, place)
    return value if kind.startswith("u") else f"uintBitsToFloat({value})"


def _glsl_lanes(kind: str, place: int) -> str:
    texel, lane = divmod(place, 4)
    return f"t{texel}.{'xyzw'[lane : lane + _SIZES[kind]]}"


_STORAGE = """\
#if SCENE_IN_UNIFORMS
layout(std140) uniform SceneBlock { vec4 u_scene[SCENE_TEXELS]; };
vec4 scene_texel(int index) { return u_scene[index]; }
#else
uniform highp sampler2D u_scene;
vec4 scene_texel(int index) { return texelFetch(u_scene, ivec2(index % 4096, index / 4096), 0); }
#endif
"""
