// SPDX-License-Identifier: MIT
#include "core/constants.glsl"
#include "core/math.glsl"
#include "scene/shape.glsl"
#include "shape/surface.glsl"

const uint KIND_SPHERE = 4u;
const int BVH_SPHERES = 1;   // flag of u_bvh_shapes
uniform int u_sphere_count;     // of the short list
uniform int u_has_sphere_grid;  // 1: spheres are in a grid (shape/sphere_grid.glsl)
uniform int u_has_globes;       // 1: some sphere is one

struct Sphere {
    vec3 center;
    uint kind;
    float radius;
    uint material;  // its number, stored larger by SHAPE_STORED
    uint light;     // so is the number of the light that it is, plus one, or 0 if it is none
    float curvature;  // of a globe: 1 / radius; 0 if it is none
    vec3 nearest;     // its point that is nearest to the origin
};
Sphere sphere_of(uvec4 t0, uvec4 t1, uvec4 t2) {
    return Sphere(
        uintBitsToFloat(t0.xyz), t0.w, uintBitsToFloat(t1.x), t1.y, t1.z, uintBitsToFloat(t1.w),
        uintBitsToFloat(t2.xyz));
}
Sphere sphere_load(int record) {
    return sphere_of(shape_texel(record, 0), shape_texel(record, 1), shape_texel(record, 2));
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

// A globe is a sphere that is far larger than what is near the origin, and passes close by there: a ground. Its centre is
// too far away for float32. With s from its nearest point there, the normal n of that and the curvature k it is where
// 2 n s + k s^2 = 0, which is a plane for k = 0.

bool sphere_is_globe(Sphere sphere) { return u_has_globes != 0 && sphere.curvature > 0.0; }

vec3 sphere_globe_axis(Sphere sphere) { return (sphere.nearest - sphere.center) * sphere.curvature; }

// As sphere_intersect().
float sphere_intersect_globe(Sphere sphere, vec3 origin, vec3 direction, out bool is_front) {
    vec3 from = origin - sphere.nearest;
    vec3 normal = sphere_globe_axis(sphere) + sphere.curvature * from;
    float b = dot(normal, direction);
    float c = dot(sphere_globe_axis(sphere) + normal, from);  // twice the height, about
    float discriminant = b * b - sphere.curvature * c;
    float q = -b - (b < 0.0 ? -1.0 : 1.0) * sqrt(max(discriminant, 0.0));
    is_front = c > 0.0;
    float distance = is_front || b >= 0.0 ? c / q : q / sphere.curvature;
    return discriminant >= 0.0 && distance > 0.0 ? distance : INFINITE_DISTANCE;
}

// That of either kind.
float sphere_distance(Sphere sphere, vec3 origin, vec3 direction, out bool is_front) {
    if (sphere_is_globe(sphere)) return sphere_intersect_globe(sphere, origin, direction, is_front);
    return sphere_intersect(sphere.center, sphere.radius, origin, direction, is_front);
}

void sphere_set_surface(inout Surface surface, Sphere sphere) {
    if (sphere_is_globe(sphere)) {
        vec3 from = surface.position - sphere.nearest;
        vec3 normal = sphere_globe_axis(sphere) + sphere.curvature * from;
        float height = 0.5 * dot(sphere_globe_axis(sphere) + normal, from);
        surface_set_plane(surface, normalize(normal), height);
    } else {
        surface.normal = normalize(surface.position - sphere.center);
        surface.position = sphere.center + sphere.radius * surface.normal;
        surface.extent = max_component(abs(sphere.center)) + sphere.radius;
    }
    surface.material = int(sphere.material - SHAPE_STORED);
    surface.light = int(sphere.light - SHAPE_STORED) - 1;
}
