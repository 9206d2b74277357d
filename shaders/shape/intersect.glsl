// SPDX-License-Identifier: MIT
// What a ray meets first: the short list one by one, then the BVH.
#include "shape/bvh.glsl"
#include "shape/flat.glsl"
#include "shape/plane.glsl"
#include "shape/sphere.glsl"

void hit_update(inout Hit hit, float distance, int primitive, int ignored) {
    if (distance < hit.distance && primitive != ignored) hit = Hit(distance, primitive, vec2(0.0), -1);
}

void hit_plane(inout Hit hit, Ray ray, Plane plane, int primitive, int ignored) {
    bool is_culled = (plane.kind & SHAPE_CULLED) != 0u && dot(plane.normal, ray.direction) >= 0.0;
    if (!is_culled) hit_update(hit, plane_intersect(plane.normal, plane.offset, ray), primitive, ignored);
}

void hit_sphere(inout Hit hit, Ray ray, Sphere sphere, int primitive, int ignored) {
    bool is_front;
    float distance = sphere_intersect(sphere.center, sphere.radius, ray.origin, ray.direction, is_front);
    if (is_front || (sphere.kind & SHAPE_CULLED) == 0u) hit_update(hit, distance, primitive, ignored);
}

void hit_flat(inout Hit hit, Ray ray, Flat shape, int primitive, int ignored) {
    hit_update(hit, flat_intersect(shape, ray), primitive, ignored);
}

// The closest hit nearer than max_distance, its primitive NO_PRIMITIVE where there is none; if `any` will do, some hit.
// The primitive `ignored` is passed over: a light does not occlude itself.
Hit scene_intersect(Ray ray, float max_distance, int ignored, bool any) {
    Hit hit = Hit(max_distance, NO_PRIMITIVE, vec2(0.0), -1);
    int first = 0;
    for (int i = 0; i < u_plane_count; i++) hit_plane(hit, ray, plane_load(first + i), first + i, ignored);
    first += u_plane_count;
    for (int i = 0; i < u_sphere_count; i++) hit_sphere(hit, ray, sphere_load(first + i), first + i, ignored);
    first += u_sphere_count;
    for (int i = 0; i < u_flat_count; i++) hit_flat(hit, ray, flat_load(first + i), first + i, ignored);
    bvh_intersect(hit, ray, ignored, any);
    return hit;
}
