// SPDX-License-Identifier: MIT
// A disk infinitely far away, the same radiance all over, sampled uniformly over the cone it subtends.
#include "core/frame.glsl"
#include "core/warp.glsl"
#include "light/sample.glsl"
#include "scene/storage.glsl"

#ifndef HAS_SUN
#define HAS_SUN 0
#endif

uniform int u_first_sun_light;  // texel of u_scene where the table begins

struct SunLight {
    vec3 direction;  // unit, to its centre
    float one_minus_cos;  // of its angular radius
    vec3 radiance;
};
SunLight sun_light_of(uvec4 t0, uvec4 t1) {
    return SunLight(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz));
}
SunLight sun_light_load(int index) {
    int first = u_first_sun_light + 2 * index;
    return sun_light_of(scene_texel(first), scene_texel(first + 1));
}

// Density over solid angle, 0 beside the disk. |a - b|^2 = 2 (1 - cos) keeps the precision that 1 - dot(a, b) loses.
float sun_light_pdf(SunLight sun, vec3 wi) {
    vec3 off = wi - sun.direction;
    return dot(off, off) <= 2.0 * sun.one_minus_cos ? square_to_uniform_cone_pdf(sun.one_minus_cos) : 0.0;
}

LightSample sun_light_sample(SunLight sun, vec2 u) {
    vec3 wi = frame_to_world(frame_from_normal(sun.direction), square_to_uniform_cone(u, sun.one_minus_cos));
    float pdf = square_to_uniform_cone_pdf(sun.one_minus_cos);
    return LightSample(wi, INFINITE_DISTANCE, sun.radiance, pdf, false, NO_PRIMITIVE);
}

LightSample sun_light_punctual(SunLight sun) {
    vec3 irradiance = sun.radiance * (2.0 * PI * sun.one_minus_cos);
    return LightSample(sun.direction, INFINITE_DISTANCE, irradiance, 1.0, true, NO_PRIMITIVE);
}
