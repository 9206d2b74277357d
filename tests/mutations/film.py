# SPDX-License-Identifier: MIT
"""Errors in the film, in layers and on the screen."""

from typing import Any

import numpy as np
import test_adaptive_sampling
import test_aov
import test_gradient_domain
import test_photon_sums
from apps.viewer import test_display, test_lit_film

from mutations.mutation import Check, Mutation
from shaders import test_film, test_pixel_filter


def samples_that_are_not_finite_are_counted(ctx: Any) -> None:
    radiance = np.random.default_rng(1).random((4, test_film.SAMPLES, 3), np.float32)
    test_film.test_samples_that_are_not_finite_are_counted_apart(ctx, radiance)


def differences_lower_the_error(ctx: Any) -> None:
    """Of small pictures less than the test of that name says of larger ones: it is 0.83 of what it was."""
    _, on, off = test_gradient_domain.boxes(ctx, 64, 4)
    assert on < 0.95 * off


WINDOW = Check(test_display.test_window_and_files_show_the_same, size=(33, 70), look=1)
LIT = Check(test_lit_film.test_a_film_is_shown_with_the_light_of_photons, software=True)
ITEMS = Check(test_adaptive_sampling.test_items_are_samples_of_their_pixels)

MUTATIONS = [
    Mutation(
        "NaN swallowed",
        "film/film.glsl",
        "film.non_finite += adds && !counts ? 1.0 : 0.0;",
        "",
        Check(samples_that_are_not_finite_are_counted),
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
        Check(differences_lower_the_error),
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
    Mutation("sRGB a little too bright", "display/tone.glsl", "1.055 * pow(", "1.06 * pow(", WINDOW),
    Mutation(
        "exposure of the window forgotten",
        "display/picture.glsl",
        "max(radiance, 0.0) * exposure",
        "max(radiance, 0.0)",
        WINDOW,
    ),
    Mutation(
        "a matte of other samples than the picture",
        "layers.frag",
        "layers_hit(ray, seed);\n    film_add",
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
