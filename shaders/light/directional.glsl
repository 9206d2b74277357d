// SPDX-License-Identifier: MIT
// Parallel light from infinitely far away.
#include "light/sample.glsl"
#include "scene/storage.glsl"

#ifndef HAS_DIRECTIONAL_LIGHT
#define HAS_DIRECTIONAL_LIGHT 0
#endif

uniform int u_first_directional_light;  // texel of u_scene where the table begins

struct DirectionalLight {
    vec3 wi;  // unit, to the light
    vec3 irradiance;  // at normal incidence
};
DirectionalLight directional_light_of(uvec4 t0, uvec4 t1) {
    return DirectionalLight(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.xyz));
}
DirectionalLight directional_light_load(int index) {
    int first = u_first_directional_light + 2 * index;
    return directional_light_of(scene_texel(first), scene_texel(first + 1));
}

LightSample directional_light_sample(DirectionalLight light) {
    return LightSample(light.wi, INFINITE_DISTANCE, light.irradiance, 1.0, true, NO_PRIMITIVE);
}
