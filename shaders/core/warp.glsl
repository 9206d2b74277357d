// SPDX-License-Identifier: MIT
// Maps from the unit square to other domains, each with its density. u is uniform in [0, 1)^2.
#include "core/constants.glsl"
#include "core/math.glsl"

// Polar: the radius is the root of u.y, the angle u.x turns.
vec2 square_to_disk(vec2 u) { return sqrt(u.y) * cos_sin_turns(u.x); }
float square_to_disk_pdf() { return INVERSE_PI; }

// The tent of radius 1 in both directions: the inverse of its cumulative distribution on each side of 0.
vec2 square_to_tent(vec2 u) {
    vec2 rising = sqrt(2.0 * u) - 1.0;
    vec2 falling = 1.0 - sqrt(2.0 * (1.0 - u));
    return mix(falling, rising, lessThan(u, vec2(0.5)));
}
float square_to_tent_pdf(vec2 p) { return max(0.0, 1.0 - abs(p.x)) * max(0.0, 1.0 - abs(p.y)); }

// Malley's method: the disk projected up to the hemisphere (PBRT 4th ed., section A.5.3).
vec3 square_to_cosine_hemisphere(vec2 u) {
    vec2 p = square_to_disk(u);
    return vec3(p, sqrt(max(0.0, 1.0 - dot(p, p))));
}
float square_to_cosine_hemisphere_pdf(vec3 v) { return max(0.0, v.z) * INVERSE_PI; }

vec3 square_to_uniform_sphere(vec2 u) {
    float z = 1.0 - 2.0 * u.y;
    float r = sqrt(max(0.0, 1.0 - z * z));
    return vec3(r * cos_sin_turns(u.x), z);
}
float square_to_uniform_sphere_pdf() { return 0.25 * INVERSE_PI; }

// Directions uniform in the cone around +z whose half angle has 1 - cos = one_minus_cos_max; taking
// 1 - cos keeps full precision for the tiny cone of a distant light.
vec3 square_to_uniform_cone(vec2 u, float one_minus_cos_max) {
    float one_minus_cos = u.y * one_minus_cos_max;
    float r = sqrt(max(0.0, one_minus_cos * (2.0 - one_minus_cos)));
    return vec3(r * cos_sin_turns(u.x), 1.0 - one_minus_cos);
}
float square_to_uniform_cone_pdf(float one_minus_cos_max) { return 0.5 * INVERSE_PI / one_minus_cos_max; }

// Barycentric coordinates uniform over a triangle (Heitz 2019, A Low-Distortion Map Between
// Triangle and Square): those of the second and third vertex.
vec2 square_to_triangle(vec2 u) {
    return u.y > u.x ? vec2(0.5 * u.x, u.y - 0.5 * u.x) : vec2(u.x - 0.5 * u.y, 0.5 * u.y);
}
float square_to_triangle_pdf() { return 2.0; }
