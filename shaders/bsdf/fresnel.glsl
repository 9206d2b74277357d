// SPDX-License-Identifier: MIT
#include "core/math.glsl"

#ifndef HAS_EXACT_FRESNEL
#define HAS_EXACT_FRESNEL 1  // the models with the exact terms, dielectrics, conductors and plastic, and clear coats
#endif

// Schlick 1994, An Inexpensive BRDF Model for Physically-Based Rendering, eq. 15, with the
// reflectance at grazing incidence f90 (1 for every bare surface).
vec3 fresnel_schlick(vec3 f0, vec3 f90, float cos_theta) {
    float m = clamp(1.0 - cos_theta, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (f90 - f0) * (m2 * m2 * m);
}

// What a smooth interface of two dielectrics reflects of unpolarised light, 1 where it reflects all; `eta` is the index of
// refraction beyond the interface over that before it (Pharr, Jakob and Humphreys 2023, equations 9.3 and 9.4).
float fresnel_dielectric(float cos_i, float eta) {
    float cos2_t = 1.0 - (1.0 - cos_i * cos_i) / (eta * eta);
    float cos_t = sqrt(max(0.0, cos2_t));
    float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    float perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    return cos2_t > 0.0 ? 0.5 * (square(parallel) + square(perpendicular)) : 1.0;
}

// Its fourth power is a float32, and it reflects all but 4e-9 / cos_i.
const float CONDUCTOR_LARGEST = 1e9;

// What a smooth conductor of complex index eta + i k in air reflects of unpolarised light (Pharr, Jakob and Humphreys 2023,
// section 9.3.6, in real numbers).
vec3 fresnel_conductor(float cos_i, vec3 eta, vec3 k) {
    float cos2 = cos_i * cos_i;
    float sin2 = 1.0 - cos2;
    eta = min(eta, vec3(CONDUCTOR_LARGEST));
    k = min(k, vec3(CONDUCTOR_LARGEST));
    vec3 difference = eta * eta - k * k - sin2;
    vec3 twice = 2.0 * eta * k;
    vec3 a2_b2 = sqrt(difference * difference + twice * twice);
    vec3 root = sqrt(max(0.5 * (a2_b2 + abs(difference)), vec3(1e-20)));  // of the larger of a^2 and b^2, without cancellation
    vec3 a = mix(root, 0.5 * twice / root, lessThan(difference, vec3(0.0)));
    vec3 perpendicular = (a2_b2 + cos2 - 2.0 * cos_i * a) / max(a2_b2 + cos2 + 2.0 * cos_i * a, vec3(1e-20));
    vec3 sum = cos2 * a2_b2 + sin2 * sin2;
    vec3 product = 2.0 * cos_i * sin2 * a;
    return 0.5 * perpendicular * (1.0 + (sum - product) / (sum + product));
}

// An estimate of what a rough surface reflects at the angle to its mean normal: at grazing angles less than
// a smooth one, since its facets tilt. The form of Lagarde 2011, Adopting a Physically Based Shading Model,
// with alpha in the place of roughness, which is enough for a base that passes the rest twice never to
// reflect more, together with a GGX lobe of that width, than both receive.
vec3 fresnel_schlick_rough(vec3 f0, vec3 f90, float alpha, float cos_theta) {
    return fresnel_schlick(f0, max((1.0 - alpha) * f90, f0), cos_theta);
}
