// SPDX-License-Identifier: MIT
#include "core/constants.glsl"
#include "core/math.glsl"
#include "scene/shape.glsl"
#include "shape/surface.glsl"

const uint KIND_SPHERE = 4u;
const int BVH_SPHERES = 1;   // flag of u_bvh_shapes
uniform int u_sphere_count;     // of the short list
uniform int u_has_sphere_grid;  // 1: spheres are in a grid (shape/sphere_grid.glsl)

struct Sphere {
    vec3 center;
    uint kind;
    float radius;
    uint material;  // its number, stored larger by SHAPE_STORED
    uint light;     // so is the number of the light that it is, plus one, or 0 if it is none
};
Sphere sphere_of(uvec4 t0, uvec4 t1) {
    return Sphere(uintBitsToFloat(t0.xyz), t0.w, uintBitsToFloat(t1.x), t1.y, t1.z);
}
Sphere sphere_load(int record) {
    return sphere_of(shape_texel(record, 0), shape_texel(record, 1));
}

// Whether the scene has any.
bool sphere_is_used() { return u_sphere_count > 0 || u_has_sphere_grid != 0 || (u_bvh_shapes & BVH_SPHERES) != 0; }

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

void sphere_set_surface(inout Surface surface, Sphere sphere) {
    surface.normal = normalize(surface.position - sphere.center);
    surface.position = sphere.center + sphere.radius * surface.normal;
    surface.extent = max_component(abs(sphere.center)) + sphere.radius;
    surface.material = int(sphere.material - SHAPE_STORED);
    surface.light = int(sphere.light - SHAPE_STORED) - 1;
}
