// SPDX-License-Identifier: MIT
// A point that emits into a cone, its intensity falling off between two angles from the axis (Khronos Group,
// KHR_lights_punctual, "Inner and Outer Cone Angles").
#include "core/math.glsl"
#include "light/sample.glsl"
#include "scene/storage.glsl"

#ifndef HAS_SPOT_LIGHT
#define HAS_SPOT_LIGHT 0
#endif

uniform int u_first_spot_light;  // texel of u_scene where the table begins

struct SpotLight {
    vec3 position;
    float one_minus_cos;  // of the outer angle
    vec3 direction;  // unit, of the axis, away from the light
    float scale;  // 1 over the difference of the cosines of the two angles
    vec3 intensity;  // on the axis
};
SpotLight spot_light_of(uvec4 t0, uvec4 t1, uvec4 t2) {
    return SpotLight(
        uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), uintBitsToFloat(t1.w),
        uintBitsToFloat(t2.xyz));
}
SpotLight spot_light_load(int index) {
    int first = u_first_spot_light + 3 * index;
    return spot_light_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2));
}

// What is left of the intensity in a direction from the light; 1 - cos as in light/sun.glsl.
float spot_light_falloff(SpotLight light, vec3 direction) {
    vec3 off = direction - light.direction;
    return square(clamp((light.one_minus_cos - 0.5 * dot(off, off)) * light.scale, 0.0, 1.0));
}

LightSample spot_light_sample(SpotLight light, vec3 origin) {
    vec3 to_light = light.position - origin;
    float distance = length(to_light);
    vec3 wi = to_light / distance;
    vec3 intensity = light.intensity * spot_light_falloff(light, -wi);
    return LightSample(wi, distance, intensity / square(distance), 1.0, true, NO_PRIMITIVE);
}
