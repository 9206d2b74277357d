# SPDX-License-Identifier: MIT
"""Errors in lights."""

import test_direct_light

from fragtracer.gpu.specialise import Level
from mutations.checks import SHADOWS, SPLIT_SUM, choice, points_on_area, under_many_lights
from mutations.mutation import Check, Mutation
from shaders import test_environment, test_light, test_light_choice, test_mesh_light, test_sphere_light

SPHERE_LIGHT = Check(test_sphere_light.test_directions_fill_the_cone, distance=1.5, way="up")
SPOT = Check(test_light.test_spot, spot=test_light.SPOTS[0], level=Level.NOTHING)
DENSITY_OF_HIT = Check(test_light.test_density_of_a_sample_is_that_of_its_hit, most_listed=10**6, level=Level.NOTHING)

MUTATIONS = [
    Mutation(
        "probability of the light's choice left out",
        "light/light.glsl",
        "    s.pdf *= choice.probability;\n",
        "",
        under_many_lights(1),
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
        Check(test_mesh_light.test_triangles_are_drawn_by_density, count=200, probability=1.0),
    ),
    Mutation(
        "area light without its cosine", "light/area.glsl", "(cos_theta * area)", "area", points_on_area("rectangle")
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
        "distances of the two children of a node of lights exchanged",
        "light/tree.glsl",
        "(distances + spreads).yx",
        "(distances + spreads).xy",
        Check(test_light_choice.test_a_tree_chooses_what_is_near),
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
        Check(
            test_light_choice.test_a_tree_chooses_each_light_as_often_as_it_says,
            lights=test_light_choice.scattered_lights,
        ),
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
        "disk sampled with the area of that square",
        "light/area.glsl",
        "area_light_pdf(light.area, distance, -dot",
        "area_light_pdf(light.kind == KIND_DISK ? light.area * 4.0 / PI : light.area, distance, -dot",
        DENSITY_OF_HIT,
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
]
