# SPDX-License-Identifier: MIT
"""Errors in media."""

import test_media

from mutations.mutation import Check, Mutation
from shaders import test_medium

MUTATIONS = [
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
]
