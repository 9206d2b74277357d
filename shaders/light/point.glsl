// SPDX-License-Identifier: MIT
// A point that emits alike in all directions.
#include "core/math.glsl"
#include "light/sample.glsl"
#include "scene/storage.glsl"

#ifndef HAS_POINT_LIGHT
#define HAS_POINT_LIGHT 0
#endif

uniform int u_first_point_light;  // texel of u_scene where the table begins

struct PointLight {
    vec3 position;
    vec3 intensity;  // W/sr
};
PointLight point_light_of(uvec4 t0, uvec4 t1) {
    return PointLight(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.xyz));
}
PointLight point_light_load(int index) {
    int first = u_first_point_light + 2 * index;
    return point_light_of(scene_texel(first), scene_texel(first + 1));
}

LightSample point_light_sample(PointLight light, vec3 origin) {
    vec3 to_light = light.position - origin;
    float distance = length(to_light);
    return LightSample(to_light / distance, distance, light.intensity / square(distance), 1.0, true, NO_PRIMITIVE);
}
