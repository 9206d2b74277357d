// SPDX-License-Identifier: MIT
// Rays, and where they start: a secondary ray leaves from a point moved off its surface by a few
// dozen units in the last place of the coordinates involved, so no constant depends on scene scale.

struct Ray { vec3 origin; vec3 direction; };

const float RAY_OFFSET = 4e-6;

// `extent` is the largest coordinate that took part in computing `position`.
vec3 ray_offset_origin(vec3 position, vec3 normal, float extent) {
    return position + normal * (RAY_OFFSET * extent);
}
