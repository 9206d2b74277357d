// SPDX-License-Identifier: MIT
// All triangles of meshes that emit, as one light: one of them drawn in constant time from an alias table (Walker
// 1977, An Efficient Method for Generating Discrete Random Variables with General Distributions), then a point on it.
#include "core/constants.glsl"
#include "core/hash.glsl"
#include "core/warp.glsl"
#include "light/area.glsl"
#include "light/sample.glsl"
#include "material/visibility.glsl"
#include "scene/storage.glsl"
#include "shape/triangle.glsl"

#ifndef HAS_MESH_LIGHT
#define HAS_MESH_LIGHT 0
#endif

uniform int u_mesh_light_count;  // triangles of meshes that emit
UTEXELS(12) u_mesh_lights;

// A row of the alias table over all triangles of meshes that emit.
struct MeshLight {
    float threshold;
    int record;  // of the triangle that is chosen below the threshold
    int other;  // of the one chosen above it
};
MeshLight mesh_light_of(uvec4 t0) {
    return MeshLight(uintBitsToFloat(t0.x), int(t0.y), int(t0.z));
}
MeshLight mesh_light_load(int index) {
    return mesh_light_of(texel_read(u_mesh_lights, storage_place(index)));
}

#if HAS_MESH_LIGHT

// Density over solid angle at `distance` under the angle `cos_theta` to the normal, where it is `density` over area;
// 0 from behind.
float mesh_light_pdf(float density, float distance, float cos_theta) {
    return cos_theta > 0.0 ? density * square(distance) / cos_theta : 0.0;
}

// Emission of a point of a triangle times its opacity; the density knows only the mean of a texture.
vec3 mesh_light_radiance(int record, Triangle t, vec2 barycentrics) {
    Surface surface;
    surface.uv = vec4(0.0);
    surface.tangent = vec4(0.0);
    surface.color = vec4(1.0);
    triangle_set_surface(surface, Hit(0.0, record, barycentrics, -1), t);  // what emits is no instance
#if HAS_ALPHA
    return material_opacity(surface) * material_at(surface).emission;
#else
    return material_at(surface).emission;
#endif
}

// u.x has chosen the light before, with that probability, which is left of its 2^23 values. They choose the place in the
// table, and what is left then goes to the point on the triangle; so that many triangles neither outnumber these values nor
// use up all of them, bits of a hash come after them, both times.
LightSample mesh_light_sample(vec3 origin, vec2 u, float probability) {
    uint bits = hash_uint(floatBitsToUint(u.x) ^ hash_uint(floatBitsToUint(u.y)));
    uint more = hash_uint(bits);
    u.x = min(u.x + hash_to_unit(hash_uint(more)) * (1.1920929e-7 / probability), ONE_MINUS_EPSILON);
    float place = u.x * float(u_mesh_light_count);
    int index = min(int(place), u_mesh_light_count - 1);
    MeshLight entry = mesh_light_load(index);
    int record = hash_to_unit(bits) < entry.threshold ? entry.record : entry.other;
    u.x = fract(place - float(index) + hash_to_unit(more) * (1.1920929e-7 * float(u_mesh_light_count)));

    Triangle t = triangle_load(record);
    vec2 b = square_to_triangle(u);
    vec3 to_light = (1.0 - b.x - b.y) * t.a + b.x * t.b + b.y * t.c - origin;
    float distance = length(to_light);
    vec3 wi = to_light / distance;
    float pdf = mesh_light_pdf(t.density, distance, -dot(wi, triangle_normal(t.a, t.b, t.c)));
    return LightSample(wi, distance, mesh_light_radiance(record, t, b), pdf, false, record);
}

#endif
