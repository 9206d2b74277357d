// SPDX-License-Identifier: MIT
// The energy-preserving Oren-Nayar model of rough diffuse surfaces (Portsmouth, Kutz and Hill 2025, EON: A Practical
// Energy-Preserving Rough Diffuse BRDF, JCGT 14:1): Fujii's form of Oren and Nayar's model, and a second lobe for what
// the facets reflect more than once. Its roughness is the artist's, the root of alpha; 0 is Lambert.
#include "bsdf/model.glsl"
#include "core/constants.glsl"
#include "core/math.glsl"
#include "core/warp.glsl"

#ifndef HAS_EON
#define HAS_EON 1
#endif

// Directional albedo of the first lobe for a white surface (equations 12 and 13), written so that it keeps its precision
// at grazing angles.
float eon_albedo(float roughness, float cos_theta) {
    float sin_theta = sqrt(max(0.0, 1.0 - cos_theta * cos_theta));
    float theta = 2.0 * PI * turns_of(vec2(cos_theta, sin_theta));
    float above = cos_theta * (1.0 + sin_theta + sin_theta * sin_theta) / (1.0 + sin_theta);
    float g = sin_theta * (theta - sin_theta * cos_theta + (2.0 / 3.0) * (above - 1.0));
    return (1.0 + roughness * g * INVERSE_PI) / (1.0 + (0.5 - 2.0 * INVERSE_PI / 3.0) * roughness);
}

vec3 eon_eval(Bsdf b, vec3 wo, vec3 wi) {
    float roughness = sqrt(b.alpha);
    float scale = 1.0 / (1.0 + (0.5 - 2.0 * INVERSE_PI / 3.0) * roughness);
    float s = dot(wo.xy, wi.xy);
    float retro = s > 0.0 ? s / max(wo.z, wi.z) : s;
    vec3 single = b.diffuse * (scale * (1.0 + roughness * retro));
    float mean = scale * (1.0 + (2.0 / 3.0 - 28.0 * INVERSE_PI / 15.0) * roughness);
    vec3 multiple = b.diffuse * b.diffuse * mean / (1.0 - b.diffuse * (1.0 - mean));
    float lost = (1.0 - eon_albedo(roughness, wo.z)) * (1.0 - eon_albedo(roughness, wi.z)) / max(1.0 - mean, 1e-7);
    return (single + multiple * max(0.0, lost)) * (wi.z * INVERSE_PI);
}

vec4 eon_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0 || wi.z <= 0.0) return vec4(0.0);
    return vec4(eon_eval(b, wo, wi), square_to_cosine_hemisphere_pdf(wi));
}

BsdfSample eon_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    if (wo.z <= 0.0) return s;
    s.wi = square_to_cosine_hemisphere(u);
    s.pdf = square_to_cosine_hemisphere_pdf(s.wi);
    if (s.pdf > 0.0) s.weight = eon_eval(b, wo, s.wi) / s.pdf;
    return s;
}
