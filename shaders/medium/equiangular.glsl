// SPDX-License-Identifier: MIT
// A distance along a ray whose density falls with the inverse square of that to a point, as light from there does (Kulla
// and Fajardo 2012, Importance Sampling Techniques for Path Tracing in Participating Media, section 4): from the point, all
// angles under which the way is seen are alike.
#include "core/constants.glsl"
#include "core/math.glsl"
#include "shape/ray.glsl"

struct Equiangular {
    float nearest;  // distance along the ray at which it is nearest to the point
    float aside;    // what it then is away
    float angle;    // under which the point sees the way
};

// Over `distance` of a ray that is taken to be at least `least` away from the point.
Equiangular equiangular_over(Ray ray, float distance, vec3 point, float least) {
    vec3 to_point = point - ray.origin;
    float nearest = dot(to_point, ray.direction);
    float aside = length(to_point - nearest * ray.direction);
    aside = max(max(aside, least), 1e-4 * length(to_point) + 1e-12);
    vec2 end = vec2(square(aside) + square(nearest) - nearest * distance, aside * distance);
    return Equiangular(nearest, aside, 2.0 * PI * turns_of(end));
}

// By the law of sines, in which nothing cancels where the point is far behind.
float equiangular_sample(Equiangular way, float u) {
    float half_turns = u * way.angle * (0.25 / PI);
    float half_sine = sin_quarter(half_turns);
    float sine = 2.0 * half_sine * sin_quarter(0.25 - half_turns);
    float rest = way.aside * (1.0 - 2.0 * square(half_sine)) + way.nearest * sine;
    return min((square(way.aside) + square(way.nearest)) * sine / max(rest, 1e-30), INFINITE_DISTANCE);
}

// 1/m
float equiangular_pdf(Equiangular way, float distance) {
    return way.aside / (way.angle * (square(way.aside) + square(distance - way.nearest)));
}
