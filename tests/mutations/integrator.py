# SPDX-License-Identifier: MIT
"""Errors in the integrators, but for what they leave to photons."""

import test_aov
import test_dielectrics
import test_environment_light
import test_estimators
import test_furnace
import test_guiding as test_guided_pictures
import test_light_tracing
import test_media
import test_split_sum

from mutations.checks import BUMPS, FURNACE_WITHOUT_NOISE, SPLIT_SUM, STUDIO, traced, under_many_lights
from mutations.mutation import Check, Mutation

PRIORITY = Check(test_dielectrics.test_the_dielectric_of_higher_priority_is_there_where_two_overlap)
FURNACE = Check(test_furnace.test_closed_furnace, albedo=test_furnace.ALBEDOS[0], estimator="bsdf", kind="rectangles")

MUTATIONS = [
    Mutation(
        "the sun met by paths and photons",
        "integrator/escape.glsl",
        "radiance += rest * sun.radiance",
        "radiance += sun.radiance",
        traced(test_light_tracing.sunlit, 1280, 0.1),
    ),
    Mutation(
        "survival wrong by half a percent at one vertex",
        "integrator/path.glsl",
        "        path.throughput /= survival;",
        "        path.throughput /= path.depth == 2 ? 1.005 * survival : survival;",
        Check(test_furnace.test_roulette_keeps_the_mean_at_every_vertex, bounces=4),
    ),
    Mutation(
        "light counted twice",
        "integrator/direct.glsl",
        "return certain ? 1.0 : power_heuristic(",
        "return 1.0 + 0.0 * power_heuristic(",
        STUDIO,
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
        "last bounce dropped",
        "integrator/path.glsl",
        "path.depth < u_bounces && survives",
        "path.depth < u_bounces - 1 && survives",
        FURNACE_WITHOUT_NOISE,
    ),
    Mutation(
        "emission from the back",
        "integrator/path.glsl",
        "surface.light >= 0 && cos_theta > 0.0",
        "surface.light >= 0",
        Check(test_furnace.test_black_where_there_is_nothing, name="the back of a rectangle", estimator="bsdf"),
    ),
    Mutation(
        "light samples summed, not averaged",
        "integrator/direct.glsl",
        "        direct /= float(u_light_samples);\n",
        "",
        under_many_lights(5),
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
        "bsdf/shading_normal.glsl",
        "u_has_shading_normals != 0 ? shadow_terminator(geometric, wi) : 1.0",
        "1.0",
        BUMPS,
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
        "light behind a pane not weighed against the rays to it",
        "integrator/direct.glsl",
        "return u_has_panes != 0 && vertex.bsdf.model == BSDF_THIN_DIELECTRIC && bsdf_is_null(s);",
        "return false;",
        Check(test_dielectrics.test_lights_of_extent_shine_through_panes, kind="disk"),
    ),
    Mutation(
        "light traced from a pane though no photon begins there",
        "integrator/direct.glsl",
        "direct_is_traced && light_traced_from(hit)",
        "direct_is_traced",
        traced(test_light_tracing.windows, 768, 0.2),
    ),
    Mutation(
        "a colour not weighed by its chance",
        "integrator/interior.glsl",
        "return vec3(band == 0 ? 3.0 : 0.0, band == 1 ? 3.0 : 0.0, band == 2 ? 3.0 : 0.0);",
        "return vec3(band == 0 ? 3.0 : 0.0, band == 1 ? 2.9 : 0.0, band == 2 ? 3.0 : 0.0);",
        Check(test_dielectrics.test_dispersion_favours_no_colour),
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
        "    if (interior_is_null(interior)) {",
        "    if (false) {",
        Check(test_media.test_a_boundary_in_glass_bends_no_light),
    ),
    Mutation(
        "emission counted twice where paths are guided",
        "integrator/direct.glsl",
        "vertex_bsdf_probability(vertex) * eval_pdf.a",
        "eval_pdf.a * vertex_bsdf_probability(vertex) * vertex_bsdf_probability(vertex)",
        Check(test_guided_pictures.test_furnace, estimator="mis"),
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
]
