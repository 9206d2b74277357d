// SPDX-License-Identifier: MIT
// A rectangle, disk or triangle that emits from its front, sampled uniformly over its area.
#include "core/math.glsl"
#include "light/sample.glsl"
#include "scene/storage.glsl"
#include "shape/flat.glsl"

#ifndef HAS_AREA_LIGHT
#define HAS_AREA_LIGHT 0
#endif

uniform int u_first_area_light;  // texel of u_scene where the table begins

struct AreaLight {
    vec3 a;
    float area;
    vec3 edge_u;
    uint kind;  // KIND_... of its shape
    vec3 edge_v;
    int primitive;  // the record of its shape
    vec3 normal;  // unit, on the front
    vec3 radiance;
};
AreaLight area_light_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3, uvec4 t4) {
    return AreaLight(
        uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), t1.w,
        uintBitsToFloat(t2.xyz), int(t2.w), uintBitsToFloat(t3.xyz), uintBitsToFloat(t4.xyz));
}
AreaLight area_light_load(int index) {
    int first = u_first_area_light + 5 * index;
    return area_light_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2), scene_texel(first + 3), scene_texel(first + 4));
}

// Density over solid angle at `distance` under the angle `cos_theta` to the normal; 0 from behind.
float area_light_pdf(float area, float distance, float cos_theta) {
    return cos_theta > 0.0 ? square(distance) / (cos_theta * area) : 0.0;
}

LightSample area_light_sample(AreaLight light, vec3 origin, vec2 u) {
    vec2 p = flat_sample(light.kind, u);
    vec3 to_light = light.a + p.x * light.edge_u + p.y * light.edge_v - origin;
    float distance = length(to_light);
    vec3 wi = to_light / distance;
    float pdf = area_light_pdf(light.area, distance, -dot(wi, light.normal));
    return LightSample(wi, distance, light.radiance, pdf, false, light.primitive);
}

vec4 area_light_focus(AreaLight light) {
    vec2 p = flat_centroid(light.kind);
    return vec4(light.a + p.x * light.edge_u + p.y * light.edge_v, sqrt(light.area * INVERSE_PI));
}

LightSample area_light_punctual(AreaLight light, vec3 origin) {
    vec2 p = flat_centroid(light.kind);
    vec3 to_light = light.a + p.x * light.edge_u + p.y * light.edge_v - origin;
    float distance = length(to_light);
    vec3 wi = to_light / distance;
    vec3 irradiance = light.radiance * (max(0.0, -dot(wi, light.normal)) * light.area / square(distance));
    return LightSample(wi, distance, irradiance, 1.0, true, light.primitive);
}
