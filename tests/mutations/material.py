# SPDX-License-Identifier: MIT
"""Errors in materials and textures."""

import test_anisotropy
import test_blends
import test_cube_maps
import test_dielectrics
import test_textured

from mutations.checks import SHADOWS
from mutations.mutation import Check, Mutation
from shaders import test_coats, test_material, test_texture

SHEETS = Check(test_textured.test_shadows_of_sheets, sheets=4)

MUTATIONS = [
    Mutation(
        "shadow ray too short",
        "material/visibility.glsl",
        "return closest_hit_before(ray, distance, ignored, seed, true)",
        "return closest_hit_before(ray, 0.5 * distance, ignored, seed, true)",
        SHADOWS,
    ),
    Mutation(
        "sRGB taken for linear",
        "texture/texture.glsl",
        "    if ((t.flags & TEXTURE_SRGB) != 0) value.rgb = texture_decode_srgb(value.rgb);\n",
        "",
        Check(test_texture.test_decoding_of_every_byte),
    ),
    Mutation(
        "image upside down",
        "texture/texture.glsl",
        "texture_wrap(uv.y, t.wrap_v)",
        "texture_wrap(1.0 - uv.y, t.wrap_v)",
        Check(test_texture.test_nearest_takes_the_texel_that_begins_at_an_edge),
    ),
    Mutation(
        "scale of a normal map ignored",
        "material/material.glsl",
        "* vec3(scale, scale, 1.0);",
        ";",
        Check(test_material.test_mapped_normal, scale=0.5, sign=1.0),
    ),
    Mutation(
        "shadow of what is there in part as of what is there",
        "material/visibility.glsl",
        "closest_hit_before(ray, distance, ignored, seed, true).primitive",
        "scene_intersect(ray, distance, ignored, true).primitive",
        SHEETS,
    ),
    Mutation(
        "one decision for all sheets",
        "material/visibility.glsl",
        "            seed = hash_uint(seed + 0x9e3779b9u);\n",
        "",
        SHEETS,
    ),
    Mutation(
        "one face of the cube mirrored",
        "texture/cube.glsl",
        "CubePlace(side.y < 0.0 ? 3 : 2, vec2(direction.x,",
        "CubePlace(side.y < 0.0 ? 3 : 2, vec2(-direction.x,",
        Check(test_cube_maps.test_lookup_finds_its_direction),
        kept=True,
    ),
    Mutation(
        "eta inverted",
        "material/material.glsl",
        "? dielectric.eta : 1.0 / dielectric.eta",
        "? 1.0 / dielectric.eta : dielectric.eta",
        Check(test_dielectrics.test_a_prism_deviates_light_by_snells_law, ior=1.5),
    ),
    Mutation(
        "light reflected back to the base of a plastic lost",
        "material/material.glsl",
        "(1.0 - again + again * plastic.leaving)",
        "1.0",
        Check(test_dielectrics.test_white_plastic_reflects_everything, ior=1.5),
    ),
    Mutation(
        "the texture of what passes a dielectric left out",
        "material/material.glsl",
        "        b.transmittance = b.diffuse;",
        "",
        Check(test_dielectrics.test_a_texture_colours_what_passes, model="thin-dielectric"),
    ),
    Mutation(
        "directions of brushing turned the other way",
        "material/material.glsl",
        "turned.y * along.x + turned.x * along.y",
        "turned.y * along.x - turned.x * along.y",
        Check(test_anisotropy.test_a_texture_turns_facets_and_makes_them_less_wide),
    ),
    Mutation(
        "weights of blended materials exchanged",
        "material/material.glsl",
        "hash_to_unit(hash_uint(seed ^ 0xb5297a4du)) < weight",
        "hash_to_unit(hash_uint(seed ^ 0xb5297a4du)) >= weight",
        Check(test_blends.test_a_surface_scatters_by_both_with_their_weights, texture=None, estimator="mis"),
    ),
    Mutation(
        "tangents of meshes not used",
        "material/material.glsl",
        "has_tangent ? surface.tangent.xyz : level",
        "level",
        Check(test_anisotropy.test_facets_are_wider_along_the_tangent, name="mesh"),
    ),
    Mutation(
        "the internal reflectance of a smooth coat for that of a rough one",
        "material/material.glsl",
        "            plastic.leaving = coat.leaving;\n",
        "",
        Check(test_coats.test_a_texture_varies_the_coat),
    ),
]
