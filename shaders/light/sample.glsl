// SPDX-License-Identifier: MIT
// What sampling a light gives.
#include "core/constants.glsl"
#include "shape/ray.glsl"

struct LightSample {
    vec3 wi;         // unit, towards the light
    float distance;  // to the light along wi
    vec3 radiance;   // from wi if nothing is in between; of a delta light, irradiance at normal incidence
    float pdf;       // 1/sr; 0 means "no sample"
    bool delta;
    int primitive;   // the light's own, NO_PRIMITIVE, or PRIMITIVE_AROUND of the environment
};

const int PRIMITIVE_AROUND = -2;

LightSample light_no_sample() {
    return LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0, false, NO_PRIMITIVE);
}
