// SPDX-License-Identifier: MIT
#include "core/constants.glsl"
#include "shape/ray.glsl"

// Distance to the plane dot(normal, p) = offset, INFINITE_DISTANCE where it lies behind the ray.
float plane_intersect(vec3 normal, float offset, Ray ray) {
    float distance = (offset - dot(normal, ray.origin)) / dot(normal, ray.direction);
    return distance > 0.0 ? distance : INFINITE_DISTANCE;
}
