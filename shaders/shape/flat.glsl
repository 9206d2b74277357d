// SPDX-License-Identifier: MIT
// Rectangles, disks and triangles of no mesh. Constant shapes are folded by the compiler to a plane and two rows.
#include "scene/shape.glsl"
#include "shape/plane.glsl"

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
    float distance = plane_intersect(f.normal, dot(f.normal, f.a), ray);
    vec3 p = ray.origin + distance * ray.direction;
    vec2 uv = vec2(dot(u_row, p) - dot(u_row, f.a), dot(v_row, p) - dot(v_row, f.a));
    bool is_met = flat_contains(f.kind, uv) && ((f.kind & SHAPE_CULLED) == 0u || dot(f.normal, ray.direction) < 0.0);
    return is_met ? distance : INFINITE_DISTANCE;
}
