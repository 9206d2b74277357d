# SPDX-License-Identifier: MIT
"""Errors in warps, random numbers and the camera."""

from typing import Any

import test_convergence
import test_cube_maps

from fragtracer.gpu.tracer import upload_random_texture
from mutations.checks import points_on_area, values
from mutations.mutation import Check, Mutation
from shaders import test_camera, test_hash, test_math, test_sampler, test_warp


def blocks_of_the_random_texture_differ(ctx: Any) -> None:
    texture = upload_random_texture(ctx)
    try:
        test_sampler.test_blocks_differ(ctx, texture)
    finally:
        texture.release()


def pixels_and_vertices_are_stratified_together(ctx: Any) -> None:
    texture = upload_random_texture(ctx)
    try:
        test_sampler.test_mean_converges_without_floor(ctx, texture, "camera and vertex")
    finally:
        texture.release()


WARP_NAMES = ("name", "width", "arguments", "pdf_arguments", "domain")
STANDARD_ERROR = Check(test_convergence.test_standard_error_is_true, sampler="texture")

MUTATIONS = [
    Mutation(
        "light at a slant from the camera's axis",
        "camera/view.glsl",
        "cos_theta * square(cos_theta)",
        "cos_theta",
        Check(test_camera.test_views_are_rays_the_other_way_round, name="default", aperture_radius=0.0),
    ),
    Mutation(
        "cosine pdf 2 % too large",
        "core/warp.glsl",
        "max(0.0, v.z) * INVERSE_PI",
        "max(0.0, v.z) * 0.32468",
        Check(test_warp.test_samples_have_the_density, **dict(zip(WARP_NAMES, test_warp.WARPS[1], strict=True))),
    ),
    Mutation(
        "MIS weight squared",
        "core/math.glsl",
        "return 1.0 / (1.0 + ratio * ratio);",
        "return 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));",
        Check(test_math.test_power_heuristic),
    ),
    Mutation(
        "two streams of the same numbers",
        "sampler/stream.glsl",
        "return stream * SAMPLER_STREAM_SAMPLES + number",
        "return number",
        STANDARD_ERROR,
    ),
    Mutation(
        "all vertices share their random numbers",
        "sampler/sampler.glsl",
        "return 1 + vertex; ",
        "return 1; ",
        Check(test_sampler.test_no_two_uses_share_a_dimension),
    ),
    Mutation(
        "number not stretched after its first use",
        "core/math.glsl",
        "    u = (first ? u : u - probability) / (first ? probability : 1.0 - probability);\n",
        "",
        Check(test_math.test_choose_first_stretches_what_is_left, probability=1 / 3),
    ),
    Mutation(
        "triangle sampled with a folded corner",
        "core/warp.glsl",
        "vec2(0.5 * u.x, u.y - 0.5 * u.x)",
        "vec2(0.5 * u.x, u.y * u.y)",
        points_on_area("triangle"),
    ),
    Mutation(
        "focus on a sphere, not a plane",
        "camera/camera.glsl",
        "u_focus_distance / -direction.z",
        "u_focus_distance / length(direction)",
        Check(test_camera.test_lens, aperture_radius=0.4, focus_distance=5.0),
    ),
    Mutation(
        "1 / pi with a wrong digit",
        "core/constants.glsl",
        "INVERSE_PI = 0.318309886183791",
        "INVERSE_PI = 0.318209886183791",
        values("diffuse", "grey"),
    ),
    Mutation(
        "sign of the frame forgotten",
        "core/frame.glsl",
        "s + n.y * n.y * a",
        "1.0 + n.y * n.y * a",
        Check(test_math.test_frame_is_orthonormal_and_right_handed),
    ),
    Mutation(
        "half of Hammersley's points left out",
        "core/hammersley.glsl",
        "float(bits >> 8u)",
        "float(bits >> 9u)",
        Check(test_cube_maps.test_brdf_map_is_the_integral, geometry="SMITH"),
        kept=True,
    ),
    Mutation(
        "hash shifted by one bit more",
        "core/hash.glsl",
        "x ^= x >> 15u;",
        "x ^= x >> 16u;",
        Check(test_hash.test_hashes_are_those_of_their_papers),
    ),
    Mutation(
        "all dimensions alike",
        "sampler/hash.glsl",
        "uint(dimension), index)",
        "0u, index)",
        Check(test_sampler.test_neighbours_are_independent, random_texture=None, kind="HASH", step="dimension"),
    ),
    Mutation(
        "number of the roulette not its own",
        "sampler/roulette.glsl",
        "hash_to_unit(hash_uint(bits.z ^ hash_uint(bits.w + index)))",
        "hash_to_unit(bits.z)",
        Check(test_sampler.test_numbers_are_uniform, random_texture=None, kind="HASH", seed=0),
    ),
    Mutation(
        "texture of random numbers repeats",
        "sampler/texture.glsl",
        "uint(dimension), block)",
        "uint(dimension), 0u)",
        Check(blocks_of_the_random_texture_differ),
    ),
    Mutation(
        "points of each dimension in an order of their own",
        "sampler/texture.glsl",
        "^ group)",
        "^ uint(dimension))",
        Check(pixels_and_vertices_are_stratified_together),
    ),
]
