// SPDX-License-Identifier: MIT
// Rectangles, disks and triangles of no mesh. Constant shapes are folded by the compiler to a plane and two rows.
#include "core/math.glsl"
#include "core/warp.glsl"
#include "scene/shape.glsl"
#include "shape/plane.glsl"
#include "shape/ray.glsl"
#include "shape/surface.glsl"

// Flat shapes are all kinds from 16 on.
const uint KIND_RECTANGLE = 16u;
const uint KIND_DISK = 17u;
const uint KIND_SINGLE_TRIANGLE = 18u;
const int BVH_FLATS = 2;   // flag of u_bvh_shapes
uniform int u_flat_count;  // of the short list

// A rectangle, disk or triangle: the points a + u (b - a) + v (c - a) with u and v in [0, 1], on the unit disk, or with
// u, v and 1 - u - v not negative.
struct Flat {
    vec3 a;
    uint kind;
    vec3 b;
    uint material;
    vec3 c;
    uint light;  // the number of the light that it is, plus one; 0: it is none
    vec3 normal;  // unit, on the front
};
Flat flat_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3) {
    return Flat(
        uintBitsToFloat(t0.xyz), t0.w, uintBitsToFloat(t1.xyz), t1.w, uintBitsToFloat(t2.xyz), t2.w,
        uintBitsToFloat(t3.xyz));
}
Flat flat_load(int record) {
    return flat_of(shape_texel(record, 0), shape_texel(record, 1), shape_texel(record, 2), shape_texel(record, 3));
}

// Whether the scene has any.
bool flat_is_used() { return u_flat_count > 0 || (u_bvh_shapes & BVH_FLATS) != 0; }

// Whether the point a + u (b - a) + v (c - a) is one of a shape of this kind.
bool flat_contains(uint kind, vec2 uv) {
    uint shape = kind >> 24u;
    float beyond_rectangle = max(abs(uv.x - 0.5), abs(uv.y - 0.5)) - 0.5;
    float beyond_triangle = -min(min(uv.x, uv.y), 1.0 - uv.x - uv.y);
    float beyond_disk = dot(uv, uv) - 1.0;
    return (shape == KIND_RECTANGLE ? beyond_rectangle : shape == KIND_DISK ? beyond_disk : beyond_triangle) <= 0.0;
}

// Distance along the ray, INFINITE_DISTANCE where it misses (Baldwin and Weber 2016, Fast Ray-Triangle Intersections by
// Coordinate Transformation).
float flat_intersect(Flat f, Ray ray) {
    vec3 edge_u = f.b - f.a;
    vec3 edge_v = f.c - f.a;
    vec3 across = cross(edge_v, f.normal);
    vec3 down = cross(f.normal, edge_u);
    vec3 u_row = across / dot(across, edge_u);
    vec3 v_row = down / dot(down, edge_v);
    vec3 from_a = ray.origin - f.a;
    float distance = -dot(f.normal, from_a) / dot(f.normal, ray.direction);
    vec3 p = from_a + distance * ray.direction;
    vec2 uv = vec2(dot(u_row, p), dot(v_row, p));
    bool is_met = flat_contains(f.kind, uv) && ((f.kind & SHAPE_CULLED) == 0u || dot(f.normal, ray.direction) < 0.0);
    return is_met && distance > 0.0 ? distance : INFINITE_DISTANCE;
}

// Coordinates of a point on a shape of this kind, uniform over its area.
vec2 flat_sample(uint kind, vec2 u) {
    return kind == KIND_RECTANGLE ? u : kind == KIND_DISK ? square_to_disk(u) : square_to_triangle(u);
}

vec2 flat_centroid(uint kind) {
    return vec2(kind == KIND_RECTANGLE ? 0.5 : kind == KIND_DISK ? 0.0 : 1.0 / 3.0);
}

void flat_set_surface(inout Surface surface, Flat shape) {
    surface_set_plane(surface, shape.normal, dot(shape.normal, surface.position - shape.a));
    // In a BVH rays meet it as triangles are met, whose distance all coordinates take part in.
    vec3 bounds = max(abs(shape.a), max(abs(shape.b), abs(shape.c)));
    bool is_in_bvh = (u_bvh_shapes & BVH_FLATS) != 0;
    float extent = is_in_bvh ? max_component(bounds) : dot(abs(shape.normal), abs(shape.a));
    surface.extent = max(surface.extent, extent);
    surface.material = int(shape.material);
    surface.light = int(shape.light) - 1;
}
