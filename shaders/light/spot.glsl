// SPDX-License-Identifier: MIT
// A point that emits into a cone, its intensity falling off between two angles from the axis (Khronos Group,
// KHR_lights_punctual, "Inner and Outer Cone Angles").
#include "core/math.glsl"
#include "light/sample.glsl"
#include "scene/light.glsl"

#ifndef HAS_SPOT_LIGHT
#define HAS_SPOT_LIGHT 0
#endif

// What is left of the intensity in a direction from the light.
float spot_light_falloff(SpotLight light, vec3 direction) {
    return square(clamp(dot(light.direction, direction) * light.cos_scale + light.cos_offset, 0.0, 1.0));
}

LightSample spot_light_sample(SpotLight light, vec3 origin) {
    vec3 to_light = light.position - origin;
    float distance = length(to_light);
    vec3 wi = to_light / distance;
    vec3 intensity = light.intensity * spot_light_falloff(light, -wi);
    return LightSample(wi, distance, intensity / square(distance), 1.0, true, NO_PRIMITIVE);
}
