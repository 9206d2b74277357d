// SPDX-License-Identifier: MIT
// Parallel light from infinitely far away.
#include "light/sample.glsl"
#include "scene/light.glsl"

#ifndef HAS_DIRECTIONAL_LIGHT
#define HAS_DIRECTIONAL_LIGHT 0
#endif

LightSample directional_light_sample(DirectionalLight light) {
    return LightSample(light.wi, INFINITE_DISTANCE, light.irradiance, 1.0, true, NO_PRIMITIVE);
}
