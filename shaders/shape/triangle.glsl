// SPDX-License-Identifier: MIT
// A triangle of a mesh: where a ray meets it, and the surface there.
#include "core/math.glsl"
#include "scene/shape.glsl"
#include "scene/vertex.glsl"
#include "shape/instance.glsl"
#include "shape/ray.glsl"
#include "shape/surface.glsl"

#ifndef HAS_MESHES
#define HAS_MESHES 0
#endif

// Distance to the triangle in x, INFINITE_DISTANCE where the ray misses its plane, the barycentric coordinates of b and c
// in yz, and in w a number that is positive where the ray meets the front; `inside` says whether it meets the triangle.
//
// Watertight, after Woop, Benthin and Wald 2013 (Watertight Ray/Triangle Intersection): the vertices are
// projected along the ray, each by itself, so that neighbours see the same points; then signs of 2D edge functions
// decide. An edge function that rounding could have given either sign counts as 0, as if the ray met the
// edge, so that neighbours agree however the driver contracts products and sums. A triangle
// seen edge-on, or without area, has no more than what rounding could have given it, and is never met.
vec4 triangle_intersect(vec3 a, vec3 b, vec3 c, BvhRay ray, out bool inside) {
    a -= ray.origin;
    b -= ray.origin;
    c -= ray.origin;
    vec3 x = vec3(dot(ray.across, a), dot(ray.across, b), dot(ray.across, c));
    vec3 y = vec3(dot(ray.down, a), dot(ray.down, b), dot(ray.down, c));
    vec3 z = vec3(dot(ray.along, a), dot(ray.along, b), dot(ray.along, c));
    vec3 first = x.zxy * y.yzx;  // across from a, b and c
    vec3 second = y.zxy * x.yzx;
    vec3 edges = first - second;
    vec3 rounding = 2.4e-7 * (abs(first) + abs(second));
    edges = mix(edges, vec3(0.0), lessThanEqual(abs(edges), rounding));
    float sum = edges.x + edges.y + edges.z;
    vec3 barycentrics = edges * (1.0 / sum);
    float distance = dot(barycentrics, z);
    inside = !any(lessThan(edges, vec3(0.0))) || !any(greaterThan(edges, vec3(0.0)));
    bool has_area = abs(sum) > rounding.x + rounding.y + rounding.z;
    return vec4(has_area && distance > 0.0 ? distance : INFINITE_DISTANCE, barycentrics.yz, sum);
}

// Unit normal on the front of the triangle a, b, c. Sides are scaled first, since the square of a tiny triangle's area
// is no float32.
vec3 triangle_normal(vec3 a, vec3 b, vec3 c) {
    vec3 u = b - a;
    vec3 v = c - a;
    vec3 n = cross(u / max_component(abs(u)), v / max_component(abs(v)));
    return n / max(length(n), 1e-18);
}

#if HAS_MESHES
// A direction between those of three vertices, which are unit vectors in the scene, with barycentric coordinates b; in w
// what lies there beside them.
vec4 triangle_direction(int first, uvec3 vertices, vec3 b, mat3 to_world) {
#if HAS_INSTANCES
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 3; i++) {
        vec4 value = vertex_texel(first + int(vertices[i]));
        sum += b[i] * vec4(unit_or(to_world * value.xyz, vec3(0.0)), value.w);
    }
    return sum;
#else
    return vertex_interpolate(first, vertices, b);
#endif
}

void triangle_set_surface(inout Surface surface, Hit hit, Triangle t) {
    vec3 b = vec3(1.0 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics);
    surface.position = b.x * t.a + b.y * t.b + b.z * t.c;
    surface.normal = triangle_normal(t.a, t.b, t.c);
    surface.material = int(t.material);
    surface.light = t.density > 0.0 ? u_mesh_light : -1;
    surface.light_density = t.density;
    vec3 bounds = max(abs(t.a), max(abs(t.b), abs(t.c)));
    if (vertices_have(ATTRIBUTE_UV)) surface.uv = vertex_interpolate(u_first_uv, t.vertices, b);
    if (vertices_have(ATTRIBUTE_COLOR)) surface.color = vertex_interpolate(u_first_color, t.vertices, b);
    mat3 to_world = mat3(1.0), normals_to_world = mat3(1.0);
#if HAS_INSTANCES
    if (hit.instance >= 0) {
        Instance instance = instance_load(hit.instance);
        to_world = instance_matrix(instance);
        normals_to_world = instance_normal_matrix(instance);
        surface.position = to_world * surface.position + instance.translation;
        surface.normal = normalize(normals_to_world * surface.normal);
        surface.material = int(instance.material);
        bounds = abs(instance.translation) + abs(to_world[0]) * bounds.x + abs(to_world[1]) * bounds.y + abs(to_world[2]) * bounds.z;
    }
#endif
    vec3 shading_normal = vec3(0.0);
    if (vertices_have(ATTRIBUTE_NORMAL)) shading_normal = triangle_direction(u_first_normal, t.vertices, b, normals_to_world).xyz;
    surface.shading_normal = unit_or(shading_normal, surface.normal);
    if (vertices_have(ATTRIBUTE_TANGENT)) {
        vec4 tangent = triangle_direction(u_first_tangent, t.vertices, b, to_world);
        bool is_left_handed = (tangent.w < 0.0) != (determinant(to_world) < 0.0);
        surface.tangent = vec4(unit_or(tangent.xyz, vec3(0.0)), is_left_handed ? -1.0 : 1.0);
    }
    surface.extent = max_component(max(bounds, abs(surface.position)));
}
#endif
