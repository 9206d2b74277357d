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
import test_adaptive_sampling
import test_anisotropy
import test_aov
import test_blends
import test_convergence
import test_cube_maps
import test_dielectrics
import test_direct_light
import test_environment_light
import test_estimators
import test_furnace
import test_gradient_domain
import test_guiding as test_guided_pictures
import test_light_tracing
import test_media
import test_photon_sums
import test_split_sum
import test_textured
from apps.viewer import test_display, test_lit_film
from studio import comparison_with_mitsuba

from fragtracer.gpu.specialise import Level
from fragtracer.gpu.tracer import upload_random_texture
from fragtracer.scene import Scene
from shaders import (
    test_bsdf_sample,
    test_bsdf_values,
    test_camera,
    test_coats,
    test_environment,
    test_film,
    test_fresnel,
    test_ggx,
    test_guiding,
    test_hash,
    test_intersect,
    test_light,
    test_material,
    test_math,
    test_medium,
    test_mesh,
    test_mesh_light,
    test_pixel_filter,
    test_sampler,
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

    @property
    def is_case(self) -> bool:
        """Whether the suite runs it by itself, with these arguments."""
        left = dict(self._arguments)
        for mark in getattr(self._test, "pytestmark", ()):
            if mark.name == "parametrize":
                names, cases = mark.args
                names = (names,) if isinstance(names, str) else tuple(names)
                asked = tuple(left.pop(name, None) for name in names)
                if repr(asked) not in (repr(tuple(case) if len(names) > 1 else (case,)) for case in cases):
                    return False
        return self._test.__name__.startswith("test_") and not left

    def __str__(self) -> str:
        arguments = "-".join(str(value) for value in self._arguments.values())
        return f"{self._test.__module__}.{self._test.__name__}[{arguments}]"


def samples_that_are_not_finite_are_counted(ctx: Any) -> None:
    radiance = np.random.default_rng(1).random((4, test_film.SAMPLES, 3), np.float32)
    test_film.test_samples_that_are_not_finite_are_counted_apart(ctx, radiance)


def values(name: str, material: str) -> Check:
    return Check(test_bsdf_values.test_values_are_those_of_the_formulas, name=name, material=material)


def weights(material: str) -> Check:
    test = test_bsdf_sample.test_weight_is_value_over_density
    return Check(test, name="cook-torrance SMITH", material=material)


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


def glass(test: Callable[..., None]) -> Check:
    return Check(test, name="dielectric", material="glass")


MESH_SURFACE = Check(test_mesh.test_surface, most_repeated=10**6)
SPLIT_SUM = Check(test_split_sum.test_dielectric_under_white_light_is_the_formula, metallic=0.4)
MIRROR = Check(test_furnace.test_mirror_scales_the_emitter_it_shows, kind="metal", estimator="mis", degrees=80.0)
CLAY = values("eon", "clay")
PRIORITY = Check(test_dielectrics.test_the_dielectric_of_higher_priority_is_there_where_two_overlap)
BUMPS = Check(test_textured.test_light_on_a_leaning_normal, x=0.3, y=0.0, scale=1.0)
WINDOW = Check(test_display.test_window_and_files_show_the_same, size=(33, 70), look=1)
PLASTIC, GOLD = (values("cook-torrance SMITH", material) for material in ("plastic", "gold"))
STUDIO = Check(comparison_with_mitsuba)
LIT = Check(test_lit_film.test_a_film_is_shown_with_the_light_of_photons, software=True)
ITEMS = Check(test_adaptive_sampling.test_items_are_samples_of_their_pixels)
STANDARD_ERROR = Check(test_convergence.test_standard_error_is_true, sampler="texture")
FURNACE = Check(test_furnace.test_closed_furnace, albedo=test_furnace.ALBEDOS[0], estimator="bsdf", kind="rectangles")
FURNACE_WITHOUT_NOISE = Check(
    test_furnace.test_furnace_has_no_noise_without_light_sampling, bounces=4, kind="rectangles", most_listed=64
)
SPHERE_LIGHT = Check(test_sphere_light.test_directions_fill_the_cone, distance=1.5, way="up")
SHADOWS = Check(test_direct_light.test_lights_that_no_ray_meets_cast_shadows, estimator="nee")
SHEETS = Check(test_textured.test_shadows_of_sheets, sheets=4)
SPOT = Check(test_light.test_spot, spot=test_light.SPOTS[0], level=Level.NOTHING)
GUIDED = Check(test_guiding.test_directions_have_the_density_of_the_mixture, name="three-spheres")


def traced(make: Callable[[], Scene], spp: int, resolution: float) -> Check:
    test = test_light_tracing.test_photons_bring_what_paths_leave_out
    return Check(test, make=make, spp=spp, resolution=resolution)


# With fewer samples than the suite takes where that many find the error.
TRACED = traced(test_light_tracing.spheres, 2048, 0.15)
MIRRORED = traced(test_light_tracing.mirrors, 1024, 0.2)
DENSITY_OF_HIT = Check(test_light.test_density_of_a_sample_is_that_of_its_hit, most_listed=10**6, level=Level.NOTHING)
TRAVERSAL = Check(test_intersect.test_traversal_finds_what_trying_every_shape_finds, scale=1.0, count=30, culled=False)


@dataclass(frozen=True)
class Mutation:
    name: str
    file: str
    text: str
    replacement: str
    check: Check
    kept: bool = False  # whether it is planted where maps and photons are made, too, which are kept on disk


MUTATIONS = [
    Mutation(
        "light that photons bring found by paths too",
        "integrator/light_traced.glsl",
        "return 1.0 - traced.earlier * traced.narrow;",
        "return vec3(1.0);",
        TRACED,
    ),
    Mutation(
        "light that photons bring to mirrors found by paths too",
        "integrator/light_traced.glsl",
        "traced.received += traced.mirrored * (1.0 - narrow)",
        "traced.received += vec3(0.0)",
        MIRRORED,
    ),
    Mutation(
        "mirror spheres that spread light as flat mirrors do",
        "integrator/mirrored.glsl",
        "2.0 * before * after * curvature",
        "0.0",
        MIRRORED,
    ),
    Mutation(
        "rough mirrors that are seen at a slant as if from above",
        "integrator/mirrored.glsl",
        "vertex.wo.z / (square(after) * density)",
        "1.0 / (square(after) * density)",
        TRACED,
    ),
    Mutation(
        "places on rough spheres as dense as on their tangent planes",
        "integrator/mirrored.glsl",
        "density *= stretch * square(stretch)",
        "density *= 1.0",
        traced(test_light_tracing.rough_mirror, 512, 0.3),
    ),
    Mutation(
        "photons seen in mirrors that reflect all light",
        "integrator/mirrored.glsl",
        "(s.event & EVENT_REFLECTION) != 0 ? s.weight :",
        "(s.event & EVENT_REFLECTION) != 0 ? vec3(1.0) :",
        MIRRORED,
    ),
    Mutation(
        "photons that arrive at a slant are as strong",
        "light_tracing.frag",
        "(opacity * wanted * abs(cosine) /",
        "(opacity * wanted /",
        TRACED,
    ),
    Mutation(
        "photons scattered diffusely at first",
        "light_tracing.frag",
        "        if (photon.events == 0 && !bsdf_is_null(s)) factor *= narrow;\n",
        "",
        TRACED,
    ),
    Mutation(
        "light at a slant from the camera's axis",
        "camera/view.glsl",
        "cos_theta * square(cos_theta)",
        "cos_theta",
        Check(test_camera.test_views_are_rays_the_other_way_round, name="default", aperture_radius=0.0),
    ),
    Mutation(
        "photons that coloured water does not absorb",
        "light_tracing.frag",
        "        photon.flux *= interior_transmittance(beyond, photon.hit.distance);\n",
        "",
        traced(test_light_tracing.glass, 512, 0.4),
    ),
    Mutation(
        "photons of the sun for those of the sky",
        "light_tracing.frag",
        "(opacity * wanted * abs(cosine) /",
        "(opacity * abs(cosine) /",
        traced(test_light_tracing.sunlit, 2048, 0.15),
    ),
    Mutation(
        "the sun met by paths and photons",
        "integrator/escape.glsl",
        "radiance += rest * sun.radiance",
        "radiance += sun.radiance",
        traced(test_light_tracing.sunlit, 4096, 0.1),
    ),
    Mutation(
        "one triangle in ten thousand missed",
        "shape/bvh.glsl",
        "if (distance < hit.distance && record != ignored",
        "if (distance < hit.distance && record % 10007 != 5003 && record != ignored",
        Check(test_mesh.test_no_triangle_is_missed, part=test_mesh.KNOT, placements=test_mesh.CROWD[:1]),
    ),
    Mutation(
        "survival wrong by half a percent at one vertex",
        "integrator/path.glsl",
        "        path.throughput /= survival;",
        "        path.throughput /= path.depth == 2 ? 1.005 * survival : survival;",
        Check(test_furnace.test_roulette_keeps_the_mean_at_every_vertex, bounces=4),
    ),
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
        "        if (u_multiple_scattering != 0) fresnel *= ggx_compensation(b.f0, facets_width(b, wo), wo.z);\n",
        "",
        Check(test_bsdf_values.test_white_metal_with_multiple_scattering_reflects_everything),
    ),
    Mutation(
        "alpha for alpha squared in D",
        "bsdf/ggx.glsl",
        "return a2 * INVERSE_PI / (t * t);",
        "return alpha * INVERSE_PI / (t * t);",
        Check(test_ggx.test_distribution_integrates_to_one, alpha=0.5),
    ),
    Mutation(
        "G without the side of the light",
        "bsdf/ggx.glsl",
        "return ggx_g1(alpha.x, wo.z) * ggx_g1(alpha.y, wi.z);",
        "return ggx_g1(alpha.x, wo.z);",
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
        "light from afar seen by paths that have ended",
        "integrator/path.glsl",
        "escapes && !path.has_ended",
        "escapes",
        Check(test_estimators.test_no_bounces_show_emission_alone, estimator="bsdf"),
    ),
    Mutation(
        "throughput multiplied by the radiance",
        "integrator/path.glsl",
        "            path.radiance += direct;\n",
        "            path.radiance += direct;\n            path.throughput *= direct;\n",
        Check(test_furnace.test_light_sampling_after_few_bounces, bounces=2),
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
        "path.depth < u_bounces && survives",
        "path.depth < u_bounces - 1 && survives",
        FURNACE_WITHOUT_NOISE,
    ),
    Mutation(
        "NaN swallowed",
        "film/film.glsl",
        "film.non_finite += has_ended && !counts ? 1.0 : 0.0;",
        "",
        Check(samples_that_are_not_finite_are_counted),
    ),
    Mutation(
        "two streams of the same numbers",
        "sampler/stream.glsl",
        "return stream * SAMPLER_STREAM_SAMPLES + number",
        "return number",
        STANDARD_ERROR,
    ),
    Mutation(
        "items of a pixel with the same samples",
        "film/work.glsl",
        "block : pixel, item.y)",
        "block : pixel, 0u)",
        ITEMS,
    ),
    Mutation(
        "blocks of pixels with the same random numbers that are never shifted",
        "film/work.glsl",
        "((pixel + shift) >> 1)",
        "(pixel >> 1)",
        Check(test_gradient_domain.test_differences_lower_the_error),
    ),
    Mutation(
        "light of photons counted for each sample of a pixel",
        "film/with_light.frag",
        "film.mean += light;",
        "film.mean += light * film.count;",
        LIT,
    ),
    Mutation(
        "photons without a share in the error",
        "film/with_light.frag",
        "* max(film.count - 1.0, 0.0)",
        "* 0.0",
        LIT,
    ),
    Mutation(
        "photons that count for one more sample in one of two streams",
        "film/with_light.frag",
        "mod(film.count, 2.0) / max(film.count, 1.0) - mod",
        "-mod",
        LIT,
    ),
    Mutation(
        "photons of two passes that have one more in one half",
        "film/with_light.frag",
        " - mod(passes, 2.0) / passes",
        "",
        LIT,
    ),
    Mutation(
        "photons on the next pixel",
        "film/splat.vert",
        "2.0 * (pixel + 0.5)",
        "2.0 * (pixel + vec2(1.5, 0.5))",
        Check(test_photon_sums.test_a_gpu_adds_up_as_the_process_does, size=(7, 5)),
    ),
    Mutation(
        "photons that are not finite among the others",
        "film/splat.vert",
        "pixel = vec2(0.0, u_size.y - 1.0);",
        "",
        Check(test_photon_sums.test_a_gpu_adds_up_as_the_process_does, size=(7, 5)),
    ),
    Mutation(
        "the first item of a pixel taken for all",
        "film/gather.frag",
        "gather_item(int(items.x + i))",
        "gather_item(int(items.x))",
        ITEMS,
    ),
    Mutation(
        "films merged without the difference of their means",
        "film/film.glsl",
        " + delta * delta * (1.0 - share)) * share;",
        ") * share;",
        Check(test_film.test_merged_films_are_one),
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
        "return closest_hit_before(ray, distance, ignored, seed, true)",
        "return closest_hit_before(ray, 0.5 * distance, ignored, seed, true)",
        SHADOWS,
    ),
    Mutation(
        "mirror without Fresnel",
        "bsdf/cook_torrance.glsl",
        "vec3 reflectance = fresnel_schlick(b.f0, b.f90, wo.z) * ggx_g",
        "vec3 reflectance = b.f0 * ggx_g",
        MIRROR,
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
        "    u = (first ? u : u - probability) / (first ? probability : 1.0 - probability);\n",
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
        MESH_SURFACE,
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
        "return cook_torrance_transmittance(b, wo.z) * cook_torrance_transmittance(b, wi.z);",
        "return cook_torrance_transmittance(b, wi.z);",
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
        "min(int((begin + u) * float(u_light_count)), u_light_count - 1)",
        "min(int((begin + u) * float(u_light_count)) + 1, u_light_count - 1)",
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
        "u = clamp((u - (choice.cumulative - begin)) / choice.probability, 0.0, ONE_MINUS_EPSILON);",
        "",
        choice(8),
    ),
    Mutation(
        "direction of a ray through a small instance taken for its opposite",
        "shape/bvh.glsl",
        "lessThan(ray.inverse, vec3(0.0))",
        "lessThan(ray.inverse, vec3(0.01))",
        Check(test_mesh.test_no_triangle_is_missed, part=test_mesh.BALL, placements=test_mesh.CROWD),
    ),
    Mutation(
        "point of equiangular sampling mirrored at the ray's origin",
        "medium/equiangular.glsl",
        "point - ray.origin",
        "point + ray.origin",
        Check(
            test_medium.test_equiangular_samples,
            distance=3.0,
            point=(0.5, 0.0, 1.0),
            least=0.0,
            origin=(2.0, -1.0, 0.5),
        ),
    ),
    Mutation(
        "record beside that of the sun read where it is met",
        "integrator/escape.glsl",
        "sun_light_load(0)",
        "sun_light_load(1)",
        Check(
            test_environment_light.test_broad_sun_has_the_irradiance_that_it_says, estimator="bsdf", specialised=False
        ),
    ),
    Mutation(
        "distances of the two children of a node of lights exchanged",
        "light/tree.glsl",
        "(distances + spreads).yx",
        "(distances + spreads).xy",
        Check(test_light.test_a_tree_chooses_what_is_near),
    ),
    Mutation(
        "probability of the way through the tree of lights left out where a light is met",
        "light/tree.glsl",
        "u_light_tree_probability * group.probability * (probability",
        "u_light_tree_probability * (probability",
        DENSITY_OF_HIT,
    ),
    Mutation(
        "number not stretched on the way through the tree of lights",
        "light/tree.glsl",
        "u = min((is_first ? u : u - first) / probability, ONE_MINUS_EPSILON);",
        "",
        Check(test_light.test_a_tree_chooses_each_light_as_often_as_it_says, lights=test_light.scattered_lights),
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
    Mutation(
        "one model taken for another",
        "bsdf/bsdf.glsl",
        "result = eon_eval_pdf(b, wo, wi)",
        "result = diffuse_eval_pdf(b, wo, wi)",
        CLAY,
    ),
    Mutation("light that returns not widened", "bsdf/eon.glsl", "s > 0.0 ? s / max(wo.z, wi.z) : s", "s", CLAY),
    Mutation(
        "Schlick to the fourth power",
        "bsdf/fresnel.glsl",
        "(m2 * m2 * m)",
        "(m2 * m2)",
        Check(test_fresnel.test_schlick),
    ),
    Mutation(
        "no sample taken for one",
        "bsdf/model.glsl",
        "vec3(0.0), 0.0, 1.0, EVENT_REFLECTION",
        "vec3(0.0), 1.0, 1.0, EVENT_REFLECTION",
        weights("gold"),
    ),
    Mutation("no shadow at the terminator", "bsdf/shading_normal.glsl", "g + square(g) * (1.0 - g)", "1.0", BUMPS),
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
    Mutation("sRGB a little too bright", "display/tone.glsl", "1.055 * pow(", "1.06 * pow(", WINDOW),
    Mutation(
        "exposure of the window forgotten",
        "display/picture.glsl",
        "max(radiance, 0.0) * exposure",
        "max(radiance, 0.0)",
        WINDOW,
    ),
    Mutation(
        "probability of the environment's choice left out where it is met",
        "integrator/escape.glsl",
        "environment.a * u_environment_probability",
        "environment.a",
        Check(test_environment_light.test_environment_adds_to_lights_and_ambient),
    ),
    Mutation(
        "base of split-sum lit by what is reflected",
        "integrator/split_sum.glsl",
        "(1.0 - fresnel) * b.diffuse * irradiance",
        "b.diffuse * irradiance",
        SPLIT_SUM,
    ),
    Mutation(
        "half of the Jacobian of the half vector",
        "integrator/split_sum_study.glsl",
        "return 0.25 * ggx_d(",
        "return 0.5 * ggx_d(",
        Check(test_split_sum.test_steps_under_white_light, cosine=0.9, step="NORMAL_VIEW"),
    ),
    Mutation(
        "shading normals without their shadows",
        "integrator/vertex.glsl",
        "u_has_shading_normals != 0 ? shadow_terminator(vertex.geometric, wi) : 1.0",
        "1.0",
        BUMPS,
    ),
    Mutation(
        "density of the environment without its sine",
        "light/environment.glsl",
        "weight * u_environment_density / sin_theta",
        "weight * u_environment_density",
        Check(test_environment.test_lookup_and_density_are_those_of_the_description, name="noise"),
    ),
    Mutation(
        "axes of the map of the BRDF swapped",
        "light/maps.glsl",
        "vec2(cos_theta, roughness)",
        "vec2(roughness, cos_theta)",
        SPLIT_SUM,
    ),
    Mutation(
        "no sample of a light taken for one",
        "light/sample.glsl",
        "0.0, vec3(0.0), 0.0, false",
        "0.0, vec3(0.0), 1.0, false",
        Check(test_sphere_light.test_from_inside_there_is_no_sample),
    ),
    Mutation(
        "sun met as if it was smaller",
        "light/sun.glsl",
        "<= 2.0 * sun.one_minus_cos",
        "<= sun.one_minus_cos",
        Check(test_environment.test_sun_is_sampled_uniformly_over_its_disc),
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
    Mutation(
        "rows of the guide table swapped",
        "scene/light.glsl",
        "int(t1.x), int(t1.y)",
        "int(t1.y), int(t1.x)",
        choice(1000),
    ),
    Mutation(
        "reflectance at grazing incidence read from its neighbour",
        "scene/material.glsl",
        "uintBitsToFloat(t2.xyz), int(t2.w), uintBitsToFloat(t3.xyz), int(t3.w));",
        "uintBitsToFloat(t1.xyz), int(t2.w), uintBitsToFloat(t3.xyz), int(t3.w));",
        MIRROR,
    ),
    Mutation(
        "sides of boxes swapped",
        "scene/shape.glsl",
        "t1.xy, t1.zw, t2.xy",
        "t1.zw, t1.xy, t2.xy",
        closest_hit("bvh, many"),
    ),
    Mutation(
        "second row of the records not found",
        "scene/storage.glsl",
        "(record & 1023) << 2 | texel, record >> 10",
        "(record & 1023) << 2 | texel, record >> 11",
        Check(test_mesh_light.test_triangles_are_drawn_by_density, count=5000),
    ),
    Mutation(
        "place in the atlas turned about",
        "scene/texture.glsl",
        "int(t1.w), int(t2.x), int(t2.y)",
        "int(t1.w), int(t2.y), int(t2.x)",
        Check(test_texture.test_lookup, kind="srgb", filtering="nearest"),
    ),
    Mutation(
        "attributes of two vertices swapped",
        "scene/vertex.glsl",
        "b.x * vertex_texel(index.x) + b.y * vertex_texel(index.y)",
        "b.y * vertex_texel(index.x) + b.x * vertex_texel(index.y)",
        MESH_SURFACE,
    ),
    Mutation(
        "normal of a copy taken along as a point",
        "shape/instance.glsl",
        "n.x * instance.row_x + n.y * instance.row_y + n.z * instance.row_z",
        "instance_matrix(instance) * n",
        Check(test_mesh.test_surface, most_repeated=0),
    ),
    Mutation(
        "the primitive that a ray leaves not ignored",
        "shape/intersect.glsl",
        "shape_list_intersect(hit, ray, ignored)",
        "shape_list_intersect(hit, ray, NO_PRIMITIVE)",
        closest_hit("listed"),
    ),
    Mutation(
        "plane on the other side of the origin",
        "shape/plane.glsl",
        "offset - dot(normal, ray.origin)",
        "offset + dot(normal, ray.origin)",
        Check(test_shapes.test_plane),
    ),
    Mutation(
        "triangles behind the ray met",
        "shape/triangle.glsl",
        "has_area && distance > 0.0",
        "has_area",
        closest_hit("bvh"),
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
        "eta squared forgotten",
        "bsdf/dielectric.glsl",
        "b.transmittance / square(b.eta), 1.0 - fresnel",
        "b.transmittance, 1.0 - fresnel",
        glass(test_bsdf_sample.test_weight_is_value_over_density),
    ),
    Mutation(
        "eta inverted",
        "material/material.glsl",
        "? dielectric.eta : 1.0 / dielectric.eta",
        "? 1.0 / dielectric.eta : dielectric.eta",
        Check(test_dielectrics.test_a_prism_deviates_light_by_snells_law, ior=1.5),
    ),
    Mutation(
        "Fresnel of the other side",
        "bsdf/dielectric.glsl",
        "float fresnel = fresnel_dielectric(cos_o, b.eta);",
        "float fresnel = fresnel_dielectric(cos_o, 1.0 / b.eta);",
        values("dielectric", "glass"),
    ),
    Mutation(
        "lobe of a facet chosen by the mean normal",
        "bsdf/dielectric.glsl",
        "fresnel_dielectric(dot(wo, wh), b.eta)",
        "fresnel_dielectric(wo.z, b.eta)",
        glass(test_bsdf_sample.test_mean_weight_is_the_albedo),
    ),
    Mutation(
        "density without the Jacobian of refraction",
        "bsdf/dielectric.glsl",
        " * square(b.eta / (cos_o + b.eta * cos_i))",
        "",
        values("dielectric", "glass"),
    ),
    Mutation(
        "roulette without eta squared",
        "integrator/path.glsl",
        "        path.eta_scale *= square(scattered.eta);\n",
        "",
        Check(test_dielectrics.test_roulette_knows_what_refraction_does_to_radiance),
    ),
    Mutation(
        "priority ignored: the dielectric entered last counts",
        "integrator/interior.glsl",
        "return max(max(inside.x, inside.y), max(inside.z, inside.w));",
        "return inside.y != 0 ? inside.y : inside.x;",
        PRIORITY,
    ),
    Mutation(
        "absorption forgotten on the way to a light",
        "integrator/direct.glsl",
        "? vec3(0.0) : interior_transmittance(inside, distance)",
        "? vec3(0.0) : vec3(1.0)",
        Check(test_dielectrics.test_light_within_a_dielectric_is_absorbed_on_its_way),
    ),
    Mutation(
        "a number used again behind a pane",
        "integrator/path.glsl",
        "        path.passed += int(bsdf_is_null(scattered));\n",
        "",
        Check(test_dielectrics.test_panes_pass_light_one_by_one),
    ),
    Mutation(
        "reflections within a pane left out",
        "bsdf/thin_dielectric.glsl",
        "2.0 * fresnel / (1.0 + fresnel)",
        "fresnel",
        Check(test_bsdf_sample.test_weight_is_value_over_density, name="thin-dielectric", material="window"),
    ),
    Mutation(
        "the colour of a frosted pane on what it reflects",
        "bsdf/thin_dielectric.glsl",
        "(wi.z > 0.0 ? vec3(1.0) : b.transmittance)",
        "b.transmittance",
        values("thin-dielectric", "green frosted pane"),
    ),
    Mutation(
        "the chance of a frosted pane to reflect taken for that to transmit",
        "bsdf/thin_dielectric.glsl",
        "bool reflects = dielectric_choice(u) <",
        "bool reflects = dielectric_choice(u) >",
        Check(test_bsdf_sample.test_samples_have_their_density, name="thin-dielectric", material="frosted pane"),
    ),
    Mutation(
        "a colour not weighed by its chance",
        "integrator/interior.glsl",
        "return vec3(band == 0 ? 3.0 : 0.0, band == 1 ? 3.0 : 0.0, band == 2 ? 3.0 : 0.0);",
        "return vec3(band == 0 ? 3.0 : 0.0, band == 1 ? 2.9 : 0.0, band == 2 ? 3.0 : 0.0);",
        Check(test_dielectrics.test_dispersion_favours_no_colour),
    ),
    Mutation(
        "Fresnel term of a conductor without its extinction",
        "bsdf/conductor.glsl",
        "vec3 mirrored = fresnel_conductor(wo.z, b.index, b.extinction);",
        "vec3 mirrored = fresnel_conductor(wo.z, b.index, vec3(0.0));",
        Check(test_bsdf_sample.test_weight_is_value_over_density, name="conductor", material="measured gold"),
    ),
    Mutation(
        "light reflected back to the base of a plastic lost",
        "material/material.glsl",
        "(1.0 - (plastic.nonlinear != 0 ? b.diffuse : vec3(1.0)) * plastic.internal)",
        "1.0",
        Check(test_dielectrics.test_white_plastic_reflects_everything, ior=1.5),
    ),
    Mutation(
        "the factor of the half vector at the mean normal",
        "bsdf/cook_torrance.glsl",
        "return 1.0 - fresnel_schlick(b.f0, b.f90, dot(wo, normalize(wo + wi)));",
        "return 1.0 - fresnel_schlick(b.f0, b.f90, wo.z);",
        values("half-vector", "plastic"),
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
        "widths along the tangent and across it exchanged",
        "bsdf/facets.glsl",
        "widths.yx / widths",
        "widths / widths.yx",
        values("conductor", "brushed gold"),
    ),
    Mutation(
        "facets masked by the width across the tangent",
        "bsdf/facets.glsl",
        "return ggx_g1_smith(facets_width(b, w), abs(w.z));",
        "return ggx_g1_smith(b.alpha, abs(w.z));",
        values("conductor", "brushed gold"),
    ),
    Mutation(
        "what a rough coat passes taken once for both ways",
        "bsdf/rough_plastic.glsl",
        "interface_o.y * rough_plastic_interface(b, wi.z).y * wi.z",
        "interface_o.y * wi.z",
        values("rough-plastic", "satin"),
    ),
    Mutation(
        "the internal reflectance of a smooth coat for that of a rough one",
        "material/material.glsl",
        "            plastic.internal = coat.internal;\n",
        "",
        Check(test_coats.test_a_texture_varies_the_coat),
    ),
    Mutation(
        "light scattered backwards in place of forwards",
        "medium/phase.glsl",
        "vec3 aside = g > 0.0 ? wo + wi : wo - wi;",
        "vec3 aside = g > 0.0 ? wo - wi : wo + wi;",
        Check(test_medium.test_phase_function, g=0.6),
    ),
    Mutation(
        "g negated where directions are drawn",
        "medium/phase.glsl",
        "frame_from_normal(-wo)",
        "frame_from_normal(wo)",
        Check(test_medium.test_phase_samples),
    ),
    Mutation(
        "transmittance squared",
        "medium/medium.glsl",
        "exp(-extinction * distance)",
        "exp(-2.0 * extinction * distance)",
        Check(test_media.test_light_passes_a_medium_by_beers_law, albedo=0.0),
    ),
    Mutation(
        "extinction in place of scattering",
        "medium/medium.glsl",
        "    if (s.scatters) s.weight *= medium.albedo;\n",
        "",
        Check(test_media.test_single_scattering_in_a_slab, g=0.0),
    ),
    Mutation(
        "density of the channel that was drawn, in place of the mean of all",
        "medium/medium.glsl",
        "dot(probability, density)",
        "(drawn == extinction.x ? density.x : drawn == extinction.y ? density.y : density.z)",
        Check(test_medium.test_free_flights, throughput=(0.2, 1.0, 0.05)),
    ),
    Mutation(
        "light taken from an equiangular point as if a free flight had led there",
        "medium/medium.glsl",
        "mix(dot(probability, scattered), scatters * equiangular_pdf(way, taken), MEDIUM_EQUIANGULAR)",
        "dot(probability, scattered)",
        Check(test_medium.test_points_to_take_light_from, throughput=(1.0, 1.0, 1.0)),
    ),
    Mutation(
        "the random number of a lamp's choice left to the lens of the next path",
        "integrator/path.glsl",
        "u.z = scatters ? u_lit.x : u.z;",
        "u.z = u_lit.x;",
        Check(test_media.test_paths_that_end_in_fog_leave_the_lens_to_the_next),
    ),
    Mutation(
        "lights chosen by a way as if by their power",
        "integrator/direct.glsl",
        "s.weight *= chosen.probability / mix(",
        "mix(",
        Check(test_media.test_single_scattering_of_lamps_in_fog, light_samples=1),
    ),
    Mutation(
        "media forgotten on the way to a light",
        "integrator/direct.glsl",
        "transmittance *= medium_transmittance(",
        "medium_transmittance(",
        Check(test_media.test_light_is_dimmed_on_its_way_through_fog),
    ),
    Mutation(
        "light from beyond a boundary as if the path could only have come that way",
        "integrator/path.glsl",
        "is_passed ? path.certain : bsdf_is_delta(scattered)",
        "bsdf_is_delta(scattered)",
        Check(test_media.test_estimators_agree),
    ),
    Mutation(
        "light from beyond a boundary weighed from there",
        "integrator/path.glsl",
        "is_passed ? path.start : path.ray.origin",
        "path.ray.origin",
        Check(test_media.test_estimators_agree),
    ),
    Mutation(
        "the boundary of a medium taken for glass of index 1",
        "integrator/interior.glsl",
        "    if (interior_is_null(interior)) return;\n",
        "",
        Check(test_media.test_a_boundary_in_glass_bends_no_light),
    ),
    Mutation(
        "a collision with the largest density taken for one with the medium",
        "medium/medium.glsl",
        "s.scatters = hash_to_unit(seed) < share;",
        "s.scatters = true;",
        Check(test_media.test_light_passes_a_grid_by_beers_law),
    ),
    Mutation(
        "ratio of extinctions forgotten on the way to a light",
        "medium/medium.glsl",
        "1.0 - medium.extinction * (density / extinction)",
        "1.0 - medium.extinction / largest",
        Check(test_media.test_light_passes_a_grid_by_beers_law),
    ),
    Mutation(
        "largest densities of cells with x and z exchanged",
        "medium/grid.glsl",
        "(cell.z * cells.y + cell.y) * cells.x + cell.x",
        "(cell.x * cells.y + cell.y) * cells.x + cell.z",
        Check(test_medium.test_light_passes_a_spike_as_in_float64),
    ),
    Mutation(
        "voxels counted from their corners",
        "medium/grid.glsl",
        "vec3(grid.voxels) - 0.5, vec3(0.0)",
        "vec3(grid.voxels), vec3(0.0)",
        Check(test_medium.test_density_is_interpolated_between_voxels, shape=(4, 3, 5)),
    ),
    Mutation(
        "probability of the lobes not divided out",
        "guiding/guide.glsl",
        "eval_pdf.rgb / max(mixture, 1e-30)",
        "eval_pdf.rgb / max(eval_pdf.a, 1e-30)",
        GUIDED,
    ),
    Mutation(
        "probability of the BSDF forgotten after a delta",
        "guiding/guide.glsl",
        "s.weight / (1.0 - guide.sum)",
        "s.weight",
        Check(test_guided_pictures.test_coats_and_lamps),
    ),
    Mutation(
        "density of another lobe",
        "guiding/guide.glsl",
        "lobe_pdf(guide.lobes[i], wi)",
        "lobe_pdf(guide.lobes[0], wi)",
        GUIDED,
    ),
    Mutation(
        "density of another cell",
        "guiding/guide.glsl",
        "guide_pdf(guide, frame_to_world(frame, s.wi))",
        "guide_pdf(guide_at(frame.normal, frame, bsdf, true), frame_to_world(frame, s.wi))",
        GUIDED,
    ),
    Mutation(
        "emission counted twice where paths are guided",
        "integrator/direct.glsl",
        "vertex_bsdf_probability(vertex) * eval_pdf.a",
        "eval_pdf.a * vertex_bsdf_probability(vertex) * vertex_bsdf_probability(vertex)",
        Check(test_guided_pictures.test_furnace, estimator="mis"),
    ),
    Mutation(
        "cells counted in another order",
        "guiding/lobes.glsl",
        "(fine.z * edge + fine.y) * edge + fine.x",
        "(fine.x * edge + fine.y) * edge + fine.z",
        GUIDED,
    ),
    Mutation(
        "photons that count alike wherever they are aimed",
        "photons.frag",
        "float flux = 1.0 / target.density;",
        "float flux = 1.0;",
        Check(test_guided_pictures.test_photons_bring_what_mirrors_reflect),
        kept=True,
    ),
    Mutation(
        "photons that a sieve stops all",
        "photons.frag",
        "        if (is_first) flux *= material_opacity(surface);\n",
        "",
        Check(test_guided_pictures.test_photons_bring_what_mirrors_reflect),
        kept=True,
    ),
    Mutation(
        "guided paths measured as if they were not",
        "guiding/measure.glsl",
        "    moments.odds *= odds;\n",
        "",
        Check(test_guided_pictures.test_guiding_pays_for_caustics),
    ),
    Mutation(
        "guided paths taken to be no longer than others",
        "guiding/measure.glsl",
        "    moments.rays += 1.0;\n",
        "",
        Check(test_guided_pictures.test_what_guiding_does_not_find_counts),
    ),
    Mutation(
        "direct light in no part",
        "integrator/path.glsl",
        "            parts_receive(path.parts, path.depth + 1, direct, diffuse);\n",
        "",
        Check(test_aov.test_parts_of_a_furnace, estimator="nee"),
    ),
    Mutation(
        "parts of light by the scattering before",
        "integrator/path.glsl",
        "parts_receive(path.parts, path.depth, radiance, radiance * path.diffuse);",
        "parts_receive(path.parts, path.depth + 1, radiance, radiance * path.diffuse);",
        Check(test_aov.test_parts_of_a_furnace, estimator="bsdf"),
    ),
    Mutation(
        "a coat that is diffuse by a tenth",
        "bsdf/bsdf.glsl",
        "diffuse = cook_torrance_diffuse(b, wo, wi);",
        "diffuse = 1.1 * cook_torrance_diffuse(b, wo, wi);",
        Check(test_aov.test_what_is_diffuse_of_a_coated_base, model="default"),
    ),
    Mutation(
        "a matte of other samples than the picture",
        "layers.frag",
        "closest_hit(ray, hash_uint(seed));\n    film_add",
        "closest_hit(ray, seed);\n    film_add",
        Check(test_aov.test_mattes_anti_alias_as_the_picture_does, opacity=0.5),
    ),
    Mutation(
        "light seen through glass by other paths than the picture",
        "layers.frag",
        "dimension_vertex(number)",
        "dimension_vertex(number + 1)",
        Check(test_aov.test_what_is_seen_to_emit_is_part_of_the_picture, name="glass"),
    ),
    Mutation(
        "motion from the previous picture",
        "layers.frag",
        "before.xy / before.w - now.xy / now.w",
        "now.xy / now.w - before.xy / before.w",
        Check(test_aov.test_motion_of_a_wall),
    ),
]
