// SPDX-License-Identifier: MIT
// Rays, and where they start: a secondary ray leaves from a point moved off its surface by a few
// dozen units in the last place of the coordinates involved, so no constant depends on scene scale.

struct Ray { vec3 origin; vec3 direction; };

// What a ray meets.
struct Hit {
    float distance;
    int primitive;      // record of the shape, or NO_PRIMITIVE
    vec2 barycentrics;  // of the second and third vertex, on shapes of the BVH that are no spheres
    int instance;       // record of the instance that the shape was met in, or -1
};

const int NO_PRIMITIVE = -1;
const float RAY_OFFSET = 4e-6;

// `extent` is the largest coordinate that took part in computing `position`.
vec3 ray_offset_origin(vec3 position, vec3 normal, float extent) {
    return position + normal * (RAY_OFFSET * extent);
}
