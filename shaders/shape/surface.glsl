// SPDX-License-Identifier: MIT
// What a hit says about the surface: computed once, after the traversal.
#include "core/math.glsl"
#include "scene/shape.glsl"
#include "scene/vertex.glsl"
#include "shape/bvh.glsl"
#include "shape/flat.glsl"
#include "shape/ray.glsl"

struct Surface {
    vec3 position;        // put back onto the surface, free of the error of the distance
    vec3 normal;          // unit, geometric: out of a sphere, by the right hand on flat shapes
    vec3 shading_normal;  // unit, on the side of `normal`
    float extent;         // the largest coordinate behind `position`, for ray_offset_origin
    int material;
    int light;            // number of the light that this shape is, or -1
    float light_density;  // of the mesh light: per area, of a sample of it
    // Of meshes; elsewhere coordinates and tangent are 0, the colour 1.
    vec4 uv;              // both sets of texture coordinates
    vec4 tangent;         // unit, not perpendicular to the normal; w is the sign of the bitangent; 0: none is given
    vec4 color;
};

void surface_set_plane(inout Surface surface, vec3 normal, float height) {
    surface.normal = normal;
    surface.position -= normal * height;
    surface.extent = max_component(abs(surface.position));
}

// A vector in the direction of v, or `fallback` where v is too short to have one.
vec3 unit_or(vec3 v, vec3 fallback) {
    float size = length(v);
    return size > 1e-6 ? v / size : fallback;
}

#if HAS_MESHES
void surface_set_triangle(inout Surface surface, Hit hit, Triangle t) {
    vec3 b = vec3(1.0 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics);
    surface.position = b.x * t.a + b.y * t.b + b.z * t.c;
    surface.normal = triangle_normal(t.a, t.b, t.c);
    surface.material = int(t.material);
    surface.light = t.density > 0.0 ? u_mesh_light : -1;
    surface.light_density = t.density;
    vec3 bounds = max(abs(t.a), max(abs(t.b), abs(t.c)));
    vec3 shading_normal = vec3(0.0);
    if (vertices_have(ATTRIBUTE_NORMAL)) shading_normal = vertex_interpolate(u_first_normal, t.vertices, b).xyz;
    if (vertices_have(ATTRIBUTE_UV)) surface.uv = vertex_interpolate(u_first_uv, t.vertices, b);
    if (vertices_have(ATTRIBUTE_TANGENT)) surface.tangent = vertex_interpolate(u_first_tangent, t.vertices, b);
    if (vertices_have(ATTRIBUTE_COLOR)) surface.color = vertex_interpolate(u_first_color, t.vertices, b);
#if HAS_INSTANCES
    if (hit.instance >= 0) {
        Instance instance = instance_load(hit.instance);
        mat3 to_world = instance_matrix(instance);
        surface.position = to_world * surface.position + instance.translation;
        surface.normal = normalize(instance_normal_to_world(instance, surface.normal));
        surface.material = int(instance.material);
        bounds = abs(instance.translation) + abs(to_world[0]) * bounds.x + abs(to_world[1]) * bounds.y + abs(to_world[2]) * bounds.z;
        shading_normal = instance_normal_to_world(instance, shading_normal);
        surface.tangent = vec4(to_world * surface.tangent.xyz, determinant(to_world) < 0.0 ? -surface.tangent.w : surface.tangent.w);
    }
#endif
    surface.shading_normal = unit_or(shading_normal, surface.normal);
    surface.tangent = vec4(unit_or(surface.tangent.xyz, vec3(0.0)), surface.tangent.w < 0.0 ? -1.0 : 1.0);
    surface.extent = max_component(max(bounds, abs(surface.position)));
}
#endif

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
    surface.material = 0;
    surface.light = -1;
    if (u_plane_count > 0 && kind == KIND_PLANE) {
        Plane plane = plane_of(t0, t1);
        surface_set_plane(surface, plane.normal, dot(plane.normal, surface.position) - plane.offset);
        surface.material = int(plane.material);
    }
    if (scene_has_spheres() && kind == KIND_SPHERE) {
        Sphere sphere = sphere_of(t0, t1);
        surface.normal = normalize(surface.position - sphere.center);
        surface.position = sphere.center + sphere.radius * surface.normal;
        surface.extent = max_component(abs(sphere.center)) + sphere.radius;
        surface.material = int(sphere.material);
        surface.light = int(sphere.light) - 1;
    }
    if (scene_has_flats() && kind >= KIND_RECTANGLE) {
        Flat shape = flat_of(t0, t1, t2, t3);
        surface_set_plane(surface, shape.normal, dot(shape.normal, surface.position - shape.a));
        surface.material = int(shape.material);
        surface.light = int(shape.light) - 1;
    }
    surface.shading_normal = surface.normal;
#if HAS_MESHES
    if (kind == KIND_TRIANGLE) surface_set_triangle(surface, hit, triangle_of(t0, t1, t2, t3));
    // A normal that is at odds with the triangle is of no use.
    float side = dot(surface.shading_normal, surface.normal);
    surface.shading_normal = side > 0.0 ? surface.shading_normal : (side < 0.0 ? -surface.shading_normal : surface.normal);
#endif
    return surface;
}
