# SPDX-License-Identifier: MIT
"""Errors for the shaders, each a slip that someone has made: what it is, where, the text it replaces, and the test of
the suite that must find it.

Every one changes what the picture converges to, or hides that something went wrong. Of the tests that find it, the one
named is among the quickest; a few are given to the comparison with Mitsuba, which has to find errors as well.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import test_direct_light
import test_furnace
import test_textured
from studio import comparison_with_mitsuba

from fragtracer.gpu.specialise import Level
from shaders import (
    test_bsdf_sample,
    test_bsdf_values,
    test_film,
    test_ggx,
    test_intersect,
    test_light,
    test_material,
    test_math,
    test_mesh,
    test_mesh_light,
    test_pixel_filter,
    test_shapes,
    test_sphere_light,
    test_texture,
)


class Check:
    """A test of the suite, and the arguments it is called with besides its fixtures."""

    def __init__(self, test: Callable[..., None], **arguments: Any) -> None:
        self._test, self._arguments = test, arguments

    def __call__(self, **fixtures: Any) -> None:
        """Raises :class:`AssertionError` where it fails."""
        asked = inspect.signature(self._test).parameters
        self._test(**{name: value for name, value in fixtures.items() if name in asked}, **self._arguments)

    def __str__(self) -> str:
        arguments = "-".join(str(value) for value in self._arguments.values())
        return f"{self._test.__module__}.{self._test.__name__}[{arguments}]"


def samples_that_are_not_finite_are_counted(ctx: Any) -> None:
    radiance = np.random.default_rng(1).random((4, test_film.SAMPLES, 3), np.float32)
    test_film.test_samples_that_are_not_finite_are_counted_apart(ctx, radiance)


def values(name: str, material: str) -> Check:
    return Check(test_bsdf_values.test_values_are_those_of_the_formulas, name=name, material=material)


def closest_hit(storage: str, culled: bool = False) -> Check:
    return Check(test_intersect.test_closest_hit, storage=storage, scale=1.0, culled=culled)


def choice(count: int) -> Check:
    test = test_light.test_lights_are_chosen_exactly_as_often_as_they_say
    return Check(test, count=count, storage="texture")


def points_on_area(kind: str) -> Check:
    return Check(test_light.test_points_are_uniform_over_the_area, kind=kind)


def under_many_lights(light_samples: int) -> Check:
    test = test_direct_light.test_floor_under_many_lights
    return Check(test, light_samples=light_samples, estimator="nee")


PLASTIC, GOLD = (values("cook-torrance SMITH", material) for material in ("plastic", "gold"))
STUDIO = Check(comparison_with_mitsuba)
FURNACE = Check(test_furnace.test_closed_furnace, albedo=test_furnace.ALBEDOS[0], estimator="bsdf", kind="rectangles")
FURNACE_WITHOUT_NOISE = Check(
    test_furnace.test_furnace_has_no_noise_without_light_sampling, bounces=4, kind="rectangles", most_listed=64
)
SPHERE_LIGHT = Check(test_sphere_light.test_directions_fill_the_cone, distance=1.5, way="up")
SHADOWS = Check(test_direct_light.test_lights_that_no_ray_meets_cast_shadows, estimator="nee")
SHEETS = Check(test_textured.test_shadows_of_sheets, sheets=4)
SPOT = Check(test_light.test_spot, spot=test_light.SPOTS[0], level=Level.NOTHING)
DENSITY_OF_HIT = Check(test_light.test_density_of_a_sample_is_that_of_its_hit, most_listed=10**6, level=Level.NOTHING)
TRAVERSAL = Check(test_intersect.test_traversal_finds_what_trying_every_shape_finds, scale=1.0, count=30, culled=False)


@dataclass(frozen=True)
class Mutation:
    name: str
    file: str
    text: str
    replacement: str
    check: Check


MUTATIONS = [
    Mutation(
        "cosine forgotten",
        "bsdf/cook_torrance.glsl",
        "b.diffuse * (wi.z * INVERSE_PI)",
        "b.diffuse * INVERSE_PI",
        STUDIO,
    ),
    Mutation(
        "cosine pdf 2 % too large", "core/warp.glsl", "max(0.0, v.z) * INVERSE_PI", "max(0.0, v.z) * 0.32468", STUDIO
    ),
    Mutation(
        "light counted twice",
        "integrator/direct.glsl",
        "return certain ? 1.0 : power_heuristic(",
        "return 1.0 + 0.0 * power_heuristic(",
        STUDIO,
    ),
    Mutation(
        "MIS weight squared",
        "core/math.glsl",
        "return 1.0 / (1.0 + ratio * ratio);",
        "return 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));",
        Check(test_math.test_power_heuristic),
    ),
    Mutation(
        "probability of the light's choice left out",
        "light/light.glsl",
        "    s.pdf *= choice.probability;\n",
        "",
        under_many_lights(1),
    ),
    Mutation(
        "Fresnel of the wrong cosine",
        "bsdf/cook_torrance.glsl",
        "fresnel_schlick(b.f0, b.f90, dot(wo, wh))",
        "fresnel_schlick(b.f0, b.f90, wi.z)",
        GOLD,
    ),
    Mutation(
        "light scattered between facets lost",
        "bsdf/cook_torrance.glsl",
        "        fresnel *= ggx_compensation(b.f0, b.alpha, wo.z);\n",
        "",
        Check(test_bsdf_values.test_white_metal_with_multiple_scattering_reflects_everything),
    ),
    Mutation(
        "alpha for alpha squared in D",
        "bsdf/ggx.glsl",
        "float a2 = alpha * alpha;\n    float t",
        "float a2 = alpha;\n    float t",
        Check(test_ggx.test_distribution_integrates_to_one, alpha=0.5),
    ),
    Mutation(
        "G without the side of the light",
        "bsdf/ggx.glsl",
        "return ggx_g1(alpha, wo.z) * ggx_g1(alpha, wi.z);",
        "return ggx_g1(alpha, wo.z);",
        Check(test_ggx.test_geometry_term, term="SMITH"),
    ),
    Mutation(
        "Russian roulette without its division",
        "integrator/path.glsl",
        "    path.throughput /= survival;\n",
        "",
        FURNACE,
    ),
    Mutation(
        "throughput multiplied by the radiance",
        "integrator/path.glsl",
        "path.radiance += path.throughput * direct_light(vertex, path.depth, pixel, index, u.zw);",
        "path.radiance += path.throughput * direct_light(vertex, path.depth, pixel, index, u.zw);\n"
        "            path.throughput *= direct_light(vertex, path.depth, pixel, index, u.zw);",
        Check(test_furnace.test_furnace_after_few_bounces, bounces=2, estimator="nee"),
    ),
    Mutation(
        "light radius 1 % too large",
        "light/sphere.glsl",
        "float sin2 = radius * radius / dot(to_center, to_center);",
        "float sin2 = 1.0201 * radius * radius / dot(to_center, to_center);",
        SPHERE_LIGHT,
    ),
    Mutation(
        "whole light sphere sampled without its measure",
        "light/sphere.glsl",
        "    float center_distance = length(to_center);\n",
        "    vec3 point = to_center + light.radius * square_to_uniform_sphere(u);\n"
        "    float density = square_to_uniform_cone_pdf(one_minus_cos_max);\n"
        "    if (light.radius > 0.0) return LightSample(\n"
        "        normalize(point), length(point), light.radiance, density, false, light.primitive);\n"
        "    float center_distance = length(to_center);\n",
        SPHERE_LIGHT,
    ),
    Mutation(
        "last bounce dropped",
        "integrator/path.glsl",
        "path.depth < u_bounces && path.rr_sample",
        "path.depth < u_bounces - 1 && path.rr_sample",
        FURNACE_WITHOUT_NOISE,
    ),
    Mutation(
        "NaN swallowed",
        "film/film.glsl",
        "        film.non_finite += 1.0;\n",
        "",
        Check(samples_that_are_not_finite_are_counted),
    ),
    Mutation(
        "no jitter in the pixel",
        "film/pixel_filter.glsl",
        "return u - 0.5;",
        "return vec2(0.0);",
        Check(test_pixel_filter.test_offsets_have_the_density_of_the_filter, name="BOX"),
    ),
    Mutation(
        "emission from the back",
        "integrator/path.glsl",
        "surface.light >= 0 && cos_theta > 0.0",
        "surface.light >= 0",
        Check(test_furnace.test_black_where_there_is_nothing, name="the back of a rectangle", estimator="bsdf"),
    ),
    Mutation(
        "shadow ray too short",
        "material/visibility.glsl",
        "scene_intersect(ray, distance, ignored, true)",
        "scene_intersect(ray, 0.5 * distance, ignored, true)",
        SHADOWS,
    ),
    Mutation(
        "mirror without Fresnel",
        "bsdf/cook_torrance.glsl",
        "vec3 reflectance = fresnel_schlick(b.f0, b.f90, wo.z) * ggx_g",
        "vec3 reflectance = b.f0 * ggx_g",
        Check(test_furnace.test_mirror_scales_the_emitter_it_shows, kind="metal", estimator="mis", degrees=80.0),
    ),
    Mutation(
        "mirror not divided by its probability",
        "bsdf/cook_torrance.glsl",
        "reflectance / specular_probability, specular_probability",
        "reflectance, specular_probability",
        Check(test_bsdf_sample.test_weight_is_value_over_density, name="cook-torrance SMITH", material="faint plastic"),
    ),
    Mutation(
        "all vertices share their random numbers", "sampler/sampler.glsl", "return 1 + vertex; ", "return 1; ", STUDIO
    ),
    Mutation(
        "number not stretched after its first use",
        "core/math.glsl",
        "    u = first ? u / probability : (u - probability) / (1.0 - probability);\n",
        "",
        Check(test_math.test_choose_first_stretches_what_is_left, probability=1 / 3),
    ),
    Mutation(
        "light samples summed, not averaged",
        "integrator/direct.glsl",
        "        direct /= float(u_light_samples);\n",
        "",
        under_many_lights(5),
    ),
    Mutation(
        "visible normals sampled without the stretch",
        "bsdf/ggx.glsl",
        "normalize(vec3(wo.xy * alpha, wo.z))",
        "normalize(vec3(wo.xy, wo.z))",
        Check(test_bsdf_sample.test_mean_weight_is_the_albedo, name="cook-torrance SMITH", material="gold"),
    ),
    Mutation(
        "inverse square forgotten",
        "light/point.glsl",
        "light.intensity / square(distance)",
        "light.intensity",
        Check(test_direct_light.test_floor_under_a_point_light, position=(0.0, 30.0, 0.0), estimator="nee"),
    ),
    Mutation(
        "emitting triangle without its cosine",
        "light/mesh.glsl",
        "density * square(distance) / cos_theta : 0.0",
        "density * square(distance) : 0.0",
        Check(test_mesh_light.test_the_density_integrates_to_one),
    ),
    Mutation(
        "second triangle of a place never drawn",
        "light/mesh.glsl",
        "< entry.threshold ? entry.record : entry.other",
        "< 2.0 ? entry.record : entry.other",
        Check(test_mesh_light.test_triangles_are_drawn_by_density, count=200),
    ),
    Mutation(
        "interpolated normal not made unit",
        "shape/surface.glsl",
        "return size > 1e-6 ? v / size :",
        "return size > 1e-6 ? v :",
        Check(test_mesh.test_surface, most_repeated=10**6),
    ),
    Mutation(
        "area light without its cosine", "light/area.glsl", "(cos_theta * area)", "area", points_on_area("rectangle")
    ),
    Mutation(
        "triangle sampled with a folded corner",
        "core/warp.glsl",
        "vec2(0.5 * u.x, u.y - 0.5 * u.x)",
        "vec2(0.5 * u.x, u.y * u.y)",
        points_on_area("triangle"),
    ),
    Mutation(
        "interface passed once, not twice",
        "bsdf/cook_torrance.glsl",
        "diffuse *= cook_torrance_transmittance(b, wo.z) *",
        "diffuse *=",
        PLASTIC,
    ),
    Mutation(
        "rays leave from the wrong side",
        "shape/ray.glsl",
        "return position + normal",
        "return position - normal",
        FURNACE_WITHOUT_NOISE,
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
        "    local.xy *= maps.normal_scale;\n",
        "",
        Check(test_material.test_mapped_normal, scale=0.5, sign=1.0),
    ),
    Mutation(
        "shadow of what is there in part as of what is there",
        "material/visibility.glsl",
        "alpha_intersect(ray, distance, ignored, seed).primitive",
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
        "cosine of the diffuse model forgotten",
        "bsdf/diffuse.glsl",
        "b.diffuse * (wi.z * INVERSE_PI)",
        "b.diffuse * INVERSE_PI",
        values("diffuse", "grey"),
    ),
    Mutation(
        "probability of the light's choice left out where it is met",
        "light/light.glsl",
        "return pdf * choice.probability;",
        "return pdf;",
        DENSITY_OF_HIT,
    ),
    Mutation(
        "guide table off by one",
        "light/light.glsl",
        "min(int(u * float(u_light_count)), u_light_count - 1)",
        "min(int(u * float(u_light_count)) + 1, u_light_count - 1)",
        choice(1000),
    ),
    Mutation(
        "bisection stops too soon",
        "light/light.glsl",
        "while (number < last) {",
        "while (number + 1 < last) {",
        choice(1000),
    ),
    Mutation(
        "few lights looked through but for the last",
        "light/light.glsl",
        "for (int i = 1; i < u_light_count; i++)",
        "for (int i = 1; i < u_light_count - 1; i++)",
        choice(8),
    ),
    Mutation(
        "number not stretched over the light's part",
        "light/light.glsl",
        "u = clamp((u - choice.cumulative) / choice.probability, 0.0, ONE_MINUS_EPSILON);",
        "",
        choice(8),
    ),
    Mutation("falloff of a spot not squared", "light/spot.glsl", "return square(clamp(", "return (clamp(", SPOT),
    Mutation(
        "spot shines backwards",
        "light/spot.glsl",
        "spot_light_falloff(light, -wi)",
        "spot_light_falloff(light, wi)",
        SPOT,
    ),
    Mutation("spot without its inverse square", "light/spot.glsl", "intensity / square(distance)", "intensity", SPOT),
    Mutation("directional light at a distance", "light/directional.glsl", "INFINITE_DISTANCE", "1.0", SHADOWS),
    Mutation(
        "disk sampled as the square around it",
        "shape/flat.glsl",
        "kind == KIND_DISK ? square_to_disk(u)",
        "kind == KIND_DISK ? 2.0 * u - 1.0",
        points_on_area("disk"),
    ),
    Mutation(
        "disk sampled with the area of that square",
        "light/area.glsl",
        "area_light_pdf(light.area, distance, -dot",
        "area_light_pdf(light.kind == KIND_DISK ? light.area * 4.0 / PI : light.area, distance, -dot",
        DENSITY_OF_HIT,
    ),
    Mutation(
        "disk met as a square",
        "shape/flat.glsl",
        "dot(uv, uv) - 1.0",
        "max(abs(uv.x), abs(uv.y)) - 1.0",
        Check(test_shapes.test_flat_shape, kind="disk", way="bvh"),
    ),
    Mutation(
        "front of a sphere inverted",
        "shape/sphere.glsl",
        "is_front = near > 0.0",
        "is_front = near <= 0.0",
        Check(test_shapes.test_sphere, name="outside"),
    ),
    Mutation(
        "culling of listed spheres inverted",
        "shape/shape.glsl",
        "if (is_front || (sphere.kind & SHAPE_CULLED)",
        "if (!is_front || (sphere.kind & SHAPE_CULLED)",
        closest_hit("listed", culled=True),
    ),
    Mutation(
        "culling in the BVH inverted",
        "shape/bvh.glsl",
        "(is_front || (flags & SHAPE_CULLED) == 0u)",
        "(!is_front || (flags & SHAPE_CULLED) == 0u)",
        closest_hit("bvh", culled=True),
    ),
    Mutation(
        "inside of a sphere not met",
        "shape/sphere.glsl",
        "is_front ? near : far",
        "near",
        Check(test_shapes.test_sphere, name="inside"),
    ),
    Mutation(
        "BVH ignores rectangles",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || kind > KIND_RECTANGLE",
        closest_hit("bvh"),
    ),
    Mutation(
        "BVH ignores disks",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || kind == KIND_RECTANGLE || kind > KIND_DISK",
        closest_hit("bvh"),
    ),
    Mutation(
        "BVH ignores triangles of no mesh",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || (kind >= KIND_RECTANGLE && kind != KIND_SINGLE_TRIANGLE)",
        closest_hit("bvh"),
    ),
    Mutation(
        "BVH ignores spheres",
        "shape/shape.glsl",
        "BVH_SPHERES) != 0 && kind == KIND_SPHERE",
        "BVH_SPHERES) != 0 && kind == KIND_PLANE",
        closest_hit("bvh"),
    ),
    Mutation(
        "fourth child ignored",
        "shape/bvh.glsl",
        "near.w <= far.w && node.count > 3u",
        "false",
        closest_hit("bvh, many"),
    ),
    Mutation(
        "shadow rays stop at the short list",
        "shape/bvh.glsl",
        "(any && hit.primitive != NO_PRIMITIVE)) return;",
        "any) return;",
        TRAVERSAL,
    ),
    Mutation(
        "flat shape in the BVH taken for a triangle",
        "shape/shape.glsl",
        "if ((u_bvh_shapes & BVH_FLATS) != 0 && kind != KIND_TRIANGLE) inside",
        "if ((u_bvh_shapes & BVH_FLATS) == 0 && kind != KIND_TRIANGLE) inside",
        closest_hit("bvh"),
    ),
    Mutation("light does not ignore itself", "shape/bvh.glsl", " && record != ignored", "", closest_hit("bvh")),
]
