# SPDX-License-Identifier: MIT
"""How records lie in textures of 32-bit words. The structs of shaders/scene/ say the same; a test holds them to it."""

from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Record = tuple[tuple[str, str], ...]
Words = NDArray[np.uint32]

# Fields fill texels of four words in this order and never straddle two of them.
SCENE_RECORDS: dict[str, Record] = {
    "Material": (
        *(("diffuse", "vec3"), ("alpha", "float"), ("f0", "vec3"), ("bsdf", "int")),
        *(("f90", "vec3"), ("unlit", "int"), ("emission", "vec3")),
    ),
    "Maps": (
        *(("albedo", "vec3"), ("roughness", "float"), ("dielectric_f0", "vec3"), ("metallic", "float")),
        *(("dielectric_f90", "vec3"), ("normal_scale", "float")),
        *(("albedo_texture", "int"), ("roughness_texture", "int")),
        *(("metallic_texture", "int"), ("metallic_channel", "int")),
        *(("normal_texture", "int"), ("emission_texture", "int")),
        *(("occlusion_texture", "int"), ("occlusion_strength", "float")),
    ),
    "Opacity": (("opacity", "float"), ("mode", "int"), ("cutoff", "float"), ("texture_index", "int")),
    "Texture": (
        *(("u_row", "vec3"), ("coordinates", "int"), ("v_row", "vec3"), ("channel", "int")),
        *(("x", "int"), ("y", "int"), ("width", "int"), ("height", "int")),
        *(("layer", "int"), ("flags", "int"), ("wrap_u", "int"), ("wrap_v", "int")),
    ),
    "LightChoice": (
        *(("cumulative", "float"), ("probability", "float"), ("kind", "int"), ("record", "int")),
        *(("guide_first", "int"), ("guide_last", "int")),
    ),
    "PointLight": (("position", "vec3"), ("intensity", "vec3")),
    "SpotLight": (
        *(("position", "vec3"), ("cos_scale", "float"), ("direction", "vec3"), ("cos_offset", "float")),
        ("intensity", "vec3"),
    ),
    "DirectionalLight": (("wi", "vec3"), ("irradiance", "vec3")),
    "SphereLight": (("center", "vec3"), ("radius", "float"), ("radiance", "vec3"), ("primitive", "int")),
    "AreaLight": (
        *(("a", "vec3"), ("area", "float"), ("edge_u", "vec3"), ("kind", "uint"), ("edge_v", "vec3")),
        *(("primitive", "int"), ("normal", "vec3"), ("radiance", "vec3")),
    ),
    "SunLight": (("direction", "vec3"), ("one_minus_cos", "float"), ("radiance", "vec3")),
}
SHAPE_RECORDS: dict[str, Record] = {
    "Plane": (("normal", "vec3"), ("kind", "uint"), ("offset", "float"), ("material", "uint")),
    "Sphere": (("center", "vec3"), ("kind", "uint"), ("radius", "float"), ("material", "uint"), ("light", "uint")),
    "Flat": (
        *(("a", "vec3"), ("kind", "uint"), ("b", "vec3"), ("material", "uint"), ("c", "vec3"), ("light", "uint")),
        ("normal", "vec3"),
    ),
    "Node": (
        *(("origin", "vec3"), ("kind", "uint"), ("x", "uvec2"), ("y", "uvec2"), ("z", "uvec2")),
        *(("first", "uint"), ("count", "uint")),
    ),
    "Triangle": (
        *(("a", "vec3"), ("kind", "uint"), ("b", "vec3"), ("material", "uint"), ("c", "vec3"), ("density", "float")),
        ("vertices", "uvec3"),
    ),
    "Instance": (
        *(("row_x", "vec3"), ("kind", "uint"), ("row_y", "vec3"), ("root", "uint")),
        *(("row_z", "vec3"), ("material", "uint"), ("translation", "vec3")),
    ),
}
MESH_LIGHT: Record = (("threshold", "float"), ("record", "int"), ("other", "int"))
RECORDS = SCENE_RECORDS | SHAPE_RECORDS | {"MeshLight": MESH_LIGHT}
SHAPE_TEXELS = 4  # of each record of u_shapes
SIZES = {"int": 1, "uint": 1, "float": 1, "vec2": 2, "uvec2": 2, "vec3": 3, "uvec3": 3, "vec4": 4}


class Kind(IntEnum):
    """Of a record of u_shapes, KIND_... in scene/shape.glsl."""

    NODE = 0
    TRIANGLE = 1
    INSTANCE = 2
    PLANE = 3
    SPHERE = 4
    RECTANGLE = 5
    DISK = 6
    SINGLE_TRIANGLE = 7


class LightKind(IntEnum):
    """LIGHT_... in light/light.glsl."""

    POINT = 0
    SPOT = 1
    DIRECTIONAL = 2
    SPHERE = 3
    AREA = 4
    MESH = 5
    SUN = 6
    ENVIRONMENT = 7


class BsdfModel(IntEnum):
    """BSDF_... in bsdf/bsdf.glsl."""

    DIFFUSE = 0
    COOK_TORRANCE = 1
    EON = 2


def places(record: Record) -> Iterator[tuple[str, str, int]]:
    """Name, type and first word of each field."""
    place = 0
    for name, kind in record:
        if place % 4 + SIZES[kind] > 4:
            place += 4 - place % 4
        yield name, kind, place
        place += SIZES[kind]


def texel_count(record: Record) -> int:
    """How many texels a record takes."""
    *_, (_, kind, place) = places(record)
    return -(-(place + SIZES[kind]) // 4)


def words_of(record: Record, columns: Mapping[str, Any], count: int, texels: int | None = None) -> Words:
    """Records (count, texels, 4) whose fields are given as arrays or numbers; those left out are 0.

    ``texels`` are those of a record, if more than it needs.
    """
    texels = texels or texel_count(record)
    words = np.zeros((count, texels * 4), np.uint32)
    for field, kind, place in places(record):
        if field in columns:
            size = SIZES[kind]
            values = np.asarray(columns[field])
            whole = kind in ("int", "uint", "uvec2", "uvec3")
            bits = values.astype(np.int64).astype(np.uint32) if whole else values.astype(np.float32).view(np.uint32)
            words[:, place if size == 1 else slice(place, place + size)] = bits
    return words.reshape(count, texels, 4)


def words_of_rows(record: Record, rows: Sequence[Mapping[str, Any]], texels: int | None = None) -> Words:
    """As :func:`words_of`, of records that are mappings of fields to values."""
    fields = {field for row in rows for field in row}
    sizes = {name: SIZES[kind] for name, kind in record}
    columns = {
        name: np.array([row.get(name, np.zeros(size) if size > 1 else 0) for row in rows])
        for name, size in sizes.items()
        if name in fields
    }
    return words_of(record, columns, len(rows), texels)
