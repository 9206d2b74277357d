// SPDX-License-Identifier: MIT
// The dispatch to one file for each shape: the short list, a leaf of the BVH, and the surface that a hit is on.
#include "scene/shape.glsl"
#include "shape/flat.glsl"
#include "shape/plane.glsl"
#include "shape/ray.glsl"
#include "shape/sphere.glsl"
#include "shape/surface.glsl"
#include "shape/triangle.glsl"

void hit_update(inout Hit hit, float distance, int primitive, int ignored) {
    if (distance < hit.distance && primitive != ignored) hit = Hit(distance, primitive, vec2(0.0), -1);
}

void hit_plane(inout Hit hit, Ray ray, Plane plane, int primitive, int ignored) {
    bool is_culled = (plane.kind & SHAPE_CULLED) != 0u && dot(plane.normal, ray.direction) >= 0.0;
    if (!is_culled) hit_update(hit, plane_intersect(plane.normal, plane.offset, ray), primitive, ignored);
}

void hit_sphere(inout Hit hit, Ray ray, Sphere sphere, int primitive, int ignored) {
    bool is_front;
    float distance = sphere_distance(sphere, ray.origin, ray.direction, is_front);
    if (is_front || (sphere.kind & SHAPE_CULLED) == 0u) hit_update(hit, distance, primitive, ignored);
}

void hit_flat(inout Hit hit, Ray ray, Flat shape, int primitive, int ignored) {
    hit_update(hit, flat_intersect(shape, ray), primitive, ignored);
}

// Updates `hit` by the shapes of the short list but `ignored`.
void shape_list_intersect(inout Hit hit, Ray ray, int ignored) {
    int first = 0;
    for (int i = 0; i < u_plane_count; i++) hit_plane(hit, ray, plane_load(first + i), first + i, ignored);
    first += u_plane_count;
    for (int i = 0; i < u_sphere_count; i++) hit_sphere(hit, ray, sphere_load(first + i), first + i, ignored);
    first += u_sphere_count;
    for (int i = 0; i < u_flat_count; i++) hit_flat(hit, ray, flat_load(first + i), first + i, ignored);
}

// Distance along the ray to a leaf of the BVH whose first texels these are, INFINITE_DISTANCE where it is missed or the
// record is no leaf; `is_front` says whether its front is met.
float shape_intersect(uvec4 t0, uvec4 t1, uvec4 t2, BvhRay ray, out vec2 barycentrics, out bool is_front) {
    uint kind = t0.w >> 24u;
    float distance = INFINITE_DISTANCE;
    barycentrics = vec2(0.0);
    is_front = true;
#if !HAS_MESHES
    if ((u_bvh_shapes & BVH_FLATS) != 0)
#endif
    if (kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE) {
        bool inside;
        vec4 found = triangle_intersect(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.xyz), uintBitsToFloat(t2.xyz), ray, inside);
        if ((u_bvh_shapes & BVH_FLATS) != 0 && kind != KIND_TRIANGLE) inside = flat_contains(t0.w, found.yz);
        distance = inside ? found.x : INFINITE_DISTANCE;
        barycentrics = found.yz;
        is_front = found.w > 0.0;
    }
    if ((u_bvh_shapes & BVH_SPHERES) != 0 && kind == KIND_SPHERE) {
        distance = sphere_distance(sphere_of(t0, t1, t2), ray.origin, ray.direction, is_front);
    }
    return distance;
}

Surface surface_at(Ray ray, Hit hit) {
    uvec4 t0 = shape_texel(hit.primitive, 0);
    uvec4 t1 = shape_texel(hit.primitive, 1);
    uvec4 t2 = shape_texel(hit.primitive, 2);
    uvec4 t3 = shape_texel(hit.primitive, 3);
    uint kind = t0.w >> 24u;
    Surface surface;
    surface.position = ray.origin + hit.distance * ray.direction;
    surface.uv = vec4(0.0);
    surface.tangent = vec4(0.0);
    surface.color = vec4(1.0);
    surface.light_density = 0.0;
    surface.primitive = hit.primitive;
    surface.material = 0;
    surface.light = -1;
    if (u_plane_count > 0 && kind == KIND_PLANE) plane_set_surface(surface, plane_of(t0, t1));
    if (sphere_is_used() && kind == KIND_SPHERE) sphere_set_surface(surface, sphere_of(t0, t1, t2));
    if (flat_is_used() && kind >= KIND_RECTANGLE) flat_set_surface(surface, flat_of(t0, t1, t2, t3));
    surface.shading_normal = surface.normal;
#if HAS_MESHES
    if (kind == KIND_TRIANGLE) triangle_set_surface(surface, hit, triangle_of(t0, t1, t2, t3));
    // A normal that is at odds with the triangle is of no use.
    float side = dot(surface.shading_normal, surface.normal);
    surface.shading_normal = side > 0.0 ? surface.shading_normal : (side < 0.0 ? -surface.shading_normal : surface.normal);
#endif
    surface.mapped_normal = surface.shading_normal;
    return surface;
}
