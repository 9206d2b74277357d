# SPDX-License-Identifier: MIT
"""Checks that errors of several files name."""

from collections.abc import Callable

import test_direct_light
import test_furnace
import test_light_tracing
import test_split_sum
import test_textured
from studio import comparison_with_mitsuba

from fragtracer.scene import Scene
from mutations.mutation import Check
from shaders import test_bsdf_values, test_light, test_light_choice


def values(name: str, material: str) -> Check:
    return Check(test_bsdf_values.test_values_are_those_of_the_formulas, name=name, material=material)


def choice(count: int) -> Check:
    test = test_light_choice.test_lights_are_chosen_exactly_as_often_as_they_say
    return Check(test, count=count, storage="texture")


def points_on_area(kind: str) -> Check:
    return Check(test_light.test_points_are_uniform_over_the_area, kind=kind)


def under_many_lights(light_samples: int) -> Check:
    test = test_direct_light.test_floor_under_many_lights
    return Check(test, light_samples=light_samples, estimator="nee")


SPLIT_SUM = Check(test_split_sum.test_dielectric_under_white_light_is_the_formula, metallic=0.4)
MIRROR = Check(test_furnace.test_mirror_scales_the_emitter_it_shows, kind="metal", estimator="mis", degrees=80.0)
BUMPS = Check(test_textured.test_light_on_a_leaning_normal, x=0.3, y=0.0, scale=1.0)
STUDIO = Check(comparison_with_mitsuba)
FURNACE_WITHOUT_NOISE = Check(
    test_furnace.test_furnace_has_no_noise_without_light_sampling, bounces=4, kind="rectangles", most_listed=64
)
SHADOWS = Check(test_direct_light.test_lights_that_no_ray_meets_cast_shadows, estimator="nee")


def traced(make: Callable[[], Scene], spp: int, resolution: float) -> Check:
    test = test_light_tracing.test_photons_bring_what_paths_leave_out
    return Check(test, make=make, spp=spp, resolution=resolution)
