// SPDX-License-Identifier: MIT
// Rays, and where they start: a secondary ray leaves from a point moved off its surface by a few
// units in the last place of the coordinates involved, so no constant depends on scene scale.

#include "core/frame.glsl"

struct Ray { vec3 origin; vec3 direction; };

// What a ray meets.
struct Hit {
    float distance;
    int primitive;      // record of the shape, or NO_PRIMITIVE
    vec2 barycentrics;  // of the second and third vertex, on shapes of the BVH that are no spheres
    int instance;       // record of the instance that the shape was met in, or -1
};

const int NO_PRIMITIVE = -1;
const float RAY_OFFSET = 1e-6;

// `extent` is the largest coordinate that took part in computing `position`.
vec3 ray_offset_origin(vec3 position, vec3 normal, float extent) {
    return position + normal * (RAY_OFFSET * extent);
}

// Whether the ray comes through a ball nearer than max_distance. Long lists of shapes that are compiled in stand below such
// conditions (gpu/specialise.py).
bool ray_meets_ball(Ray ray, float max_distance, vec3 center, float radius) {
    vec3 to_center = center - ray.origin;
    float middle = dot(to_center, ray.direction);
    vec3 perpendicular = to_center - middle * ray.direction;
    return dot(perpendicular, perpendicular) <= radius * radius && middle > -radius && middle < max_distance + radius;
}

// Of a direction; finite and not 0 for all: a ray within the plane of a side must not make NaN.
vec3 ray_inverse(vec3 direction) {
    return 1.0 / mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
}

// A ray as nodes and triangles want it. Distances are in units of `direction`, which need not be a unit.
struct BvhRay {
    vec3 origin;
    vec3 direction;
    vec3 inverse;       // of the direction
    vec3 across, down;  // with the direction, axes of a space in which the ray runs along z
    vec3 along;         // direction / direction^2: dot(along, p) is the distance of p
};

BvhRay bvh_ray(vec3 origin, vec3 direction) {
    Frame frame = frame_from_normal(normalize(direction));
    return BvhRay(origin, direction, ray_inverse(direction), frame.tangent, frame.bitangent, direction / dot(direction, direction));
}
