# SPDX-License-Identifier: MIT
"""How records lie in textures of 32-bit words. The structs of shaders/ say the same; a test holds them to it."""

from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Record = tuple[tuple[str, str], ...]
Words = NDArray[np.uint32]

# Fields fill texels of four words in this order and never straddle two of them.
MATERIAL_RECORDS: dict[str, Record] = {
    "Material": (
        *(("diffuse", "vec3"), ("alpha", "float"), ("f0", "vec3"), ("bsdf", "int")),
        *(("f90", "vec3"), ("flags", "int"), ("emission", "vec3"), ("record", "int")),
    ),
    "Maps": (
        *(("albedo", "vec3"), ("roughness", "float"), ("dielectric_f0", "vec3"), ("metallic", "float")),
        *(("dielectric_f90", "vec3"), ("normal_scale", "float")),
        *(("albedo_texture", "int"), ("roughness_texture", "int")),
        *(("metallic_texture", "int"), ("metallic_channel", "int")),
        *(("normal_texture", "int"), ("emission_texture", "int")),
        *(("occlusion_texture", "int"), ("occlusion_strength", "float")),
    ),
    "Dielectric": (("transmittance", "vec3"), ("eta", "float"), ("absorption", "vec3"), ("dispersion", "float")),
    "Conductor": (("index", "vec3"), ("extinction", "vec3")),
    "Plastic": (("eta", "float"), ("leaving", "float"), ("nonlinear", "int"), ("coat", "int"), ("coats", "int")),
    "Coat": (("facets", "vec4"), ("angles", "vec3"), ("leaving", "float")),
    "ClearCoat": (
        *(("weight", "float"), ("roughness", "float"), ("f0", "float"), ("half_vector", "int")),
        *(("weight_texture", "int"), ("roughness_texture", "int")),
        *(("normal_texture", "int"), ("normal_scale", "float")),
    ),
    "Sheen": (("color", "vec3"), ("roughness", "float"), ("color_texture", "int"), ("roughness_texture", "int")),
    "Iridescence": (
        *(("weight", "float"), ("ior", "float"), ("thickness_minimum", "float"), ("thickness", "float")),
        *(("weight_texture", "int"), ("thickness_texture", "int")),
    ),
    "Translucency": (
        *(("color", "vec3"), ("factor", "float"), ("color_texture", "int"), ("factor_texture", "int")),
        *(("metallic", "float"), ("metallic_texture", "int")),
    ),
    "Anisotropy": (("strength", "float"), ("cosine", "float"), ("sine", "float"), ("texture_index", "int")),
    "Opacity": (("opacity", "float"), ("mode", "int"), ("cutoff", "float"), ("texture_index", "int")),
    "Blend": (("weight", "float"), ("texture_index", "int"), ("other", "int")),
    "Texture": (
        *(("u_row", "vec3"), ("coordinates", "int"), ("v_row", "vec3"), ("channel", "int")),
        *(("first", "int"), ("width", "int"), ("height", "int")),
        *(("flags", "int"), ("wrap_u", "int"), ("wrap_v", "int")),
    ),
}
MEDIUM_RECORDS: dict[str, Record] = {
    "Medium": (("extinction", "vec3"), ("g", "float"), ("albedo", "vec3"), ("is_null", "int"), ("grid", "int")),
    "Grid": (
        *(("low", "vec3"), ("first", "int"), ("inverse_size", "vec3"), ("voxels", "uvec3")),
        ("cells", "uvec3"),
    ),
}
ROW = 4096  # texels of a texture
SIZES = {"int": 1, "uint": 1, "float": 1, "vec2": 2, "uvec2": 2, "vec3": 3, "uvec3": 3, "vec4": 4}


class BsdfModel(IntEnum):
    """BSDF_... in bsdf/bsdf.glsl."""

    DIFFUSE = 0
    COOK_TORRANCE = 1
    EON = 2
    DIELECTRIC = 3
    THIN_DIELECTRIC = 4
    CONDUCTOR = 5
    PLASTIC = 6
    ROUGH_PLASTIC = 7
    COATED = 8
    SHEEN = 9
    TRANSLUCENT = 10

    @property
    def feature(self) -> str:
        """The feature that the model needs."""
        return "HAS_EXACT_FRESNEL" if self >= BsdfModel.DIELECTRIC else f"HAS_{self.name}"


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
