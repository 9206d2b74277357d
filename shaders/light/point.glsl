// SPDX-License-Identifier: MIT
// A point that emits alike in all directions.
#include "core/math.glsl"
#include "light/sample.glsl"
#include "scene/light.glsl"

#ifndef HAS_POINT_LIGHT
#define HAS_POINT_LIGHT 0
#endif

LightSample point_light_sample(PointLight light, vec3 origin) {
    vec3 to_light = light.position - origin;
    float distance = length(to_light);
    return LightSample(to_light / distance, distance, light.intensity / square(distance), 1.0, true, NO_PRIMITIVE);
}
