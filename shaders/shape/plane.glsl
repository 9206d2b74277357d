// SPDX-License-Identifier: MIT
// An infinite plane; every ray is tested against it.
#include "core/constants.glsl"
#include "scene/shape.glsl"
#include "shape/ray.glsl"
#include "shape/surface.glsl"

const uint KIND_PLANE = 3u;
uniform int u_plane_count;  // of the short list

struct Plane {
    vec3 normal;
    uint kind;
    float offset;  // dot(normal, p) of its points
    uint material;  // as of a sphere
};
Plane plane_of(uvec4 t0, uvec4 t1) {
    return Plane(uintBitsToFloat(t0.xyz), t0.w, uintBitsToFloat(t1.x), t1.y);
}
Plane plane_load(int record) {
    return plane_of(shape_texel(record, 0), shape_texel(record, 1));
}

// Distance to the plane dot(normal, p) = offset, INFINITE_DISTANCE where it lies behind the ray.
float plane_intersect(vec3 normal, float offset, Ray ray) {
    float distance = (offset - dot(normal, ray.origin)) / dot(normal, ray.direction);
    return distance > 0.0 ? distance : INFINITE_DISTANCE;
}

void plane_set_surface(inout Surface surface, Plane plane) {
    surface_set_plane(surface, plane.normal, dot(plane.normal, surface.position) - plane.offset);
    surface.material = int(plane.material - SHAPE_STORED);
}
