// SPDX-License-Identifier: MIT
// A sphere that emits outwards, sampled uniformly over the cone it subtends (Shirley et al. 1996,
// Monte Carlo Techniques for Direct Lighting Calculations, section 3.2.2).
#include "core/frame.glsl"
#include "core/math.glsl"
#include "core/warp.glsl"
#include "light/sample.glsl"
#include "scene/storage.glsl"

#ifndef HAS_SPHERE_LIGHT
#define HAS_SPHERE_LIGHT 0
#endif

uniform int u_first_sphere_light;  // texel of u_scene where the table begins

struct SphereLight {
    vec3 center;
    float radius;
    vec3 radiance;
    int primitive;  // the record of its shape
};
SphereLight sphere_light_of(uvec4 t0, uvec4 t1) {
    return SphereLight(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), int(t1.w));
}
SphereLight sphere_light_load(int index) {
    int first = u_first_sphere_light + 2 * index;
    return sphere_light_of(scene_texel(first), scene_texel(first + 1));
}

// 1 - cos of the half angle under which the sphere is seen; 0 from inside, where nothing is emitted.
// Written as sin^2 / (1 + cos) to stay precise for distant lights.
float sphere_light_one_minus_cos(vec3 center, float radius, vec3 origin) {
    vec3 to_center = center - origin;
    float sin2 = radius * radius / dot(to_center, to_center);
    return sin2 < 1.0 ? sin2 / (1.0 + sqrt(1.0 - sin2)) : 0.0;
}

// The density is that of every direction that meets the sphere.
float sphere_light_pdf(SphereLight light, vec3 origin) {
    float one_minus_cos = sphere_light_one_minus_cos(light.center, light.radius, origin);
    return one_minus_cos > 0.0 ? square_to_uniform_cone_pdf(one_minus_cos) : 0.0;
}

LightSample sphere_light_sample(SphereLight light, vec3 origin, vec2 u) {
    LightSample s = light_no_sample();
    float one_minus_cos_max = sphere_light_one_minus_cos(light.center, light.radius, origin);
    if (one_minus_cos_max <= 0.0) return s;
    vec3 to_center = light.center - origin;
    float center_distance = length(to_center);
    vec3 local = square_to_uniform_cone(u, one_minus_cos_max);
    float half_chord = sqrt(max(0.0, square(light.radius) - square(center_distance) * dot(local.xy, local.xy)));
    s.wi = frame_to_world(frame_from_normal(to_center / center_distance), local);
    s.distance = center_distance * local.z - half_chord;
    s.radiance = light.radiance;
    s.pdf = square_to_uniform_cone_pdf(one_minus_cos_max);
    s.primitive = light.primitive;
    return s;
}

LightSample sphere_light_punctual(SphereLight light, vec3 origin) {
    vec3 to_center = light.center - origin;
    float distance = length(to_center);
    vec3 irradiance = light.radiance * (PI * square(light.radius) / square(distance));
    return LightSample(to_center / distance, distance, irradiance, 1.0, true, light.primitive);
}
