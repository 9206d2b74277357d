// SPDX-License-Identifier: MIT
#include "core/constants.glsl"

// Distance to the sphere along a unit direction, INFINITE_DISTANCE where it misses; `is_front` says whether the
// nearest point is met from outside. The discriminant comes from the perpendicular distance to the centre, which survives
// small and distant spheres (Haines et al. 2019, Precision Improvements for Ray/Sphere Intersection, Ray Tracing
// Gems, ch. 7).
float sphere_intersect(vec3 center, float radius, vec3 origin, vec3 direction, out bool is_front) {
    vec3 to_center = center - origin;
    float b = dot(to_center, direction);
    vec3 perpendicular = to_center - b * direction;
    float discriminant = radius * radius - dot(perpendicular, perpendicular);
    float half_chord = sqrt(max(discriminant, 0.0));
    float near = b - half_chord;
    float far = b + half_chord;
    is_front = near > 0.0;
    float distance = is_front ? near : far;
    return discriminant >= 0.0 && distance > 0.0 ? distance : INFINITE_DISTANCE;
}
