// SPDX-License-Identifier: MIT
// A metal of measured index of refraction and extinction coefficient, smooth or of GGX facets with Smith's uncorrelated
// masking and shadowing.
#include "bsdf/facets.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/model.glsl"

vec4 conductor_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    if (b.alpha < ALPHA_DELTA || wo.z <= 0.0 || wi.z <= 0.0) return vec4(0.0);
    vec3 wh = normalize(wo + wi);
    float pdf = 0.25 * facets_visible_d(b, wo, wh);
    vec3 fresnel = fresnel_conductor(dot(wo, wh), b.index, b.extinction);
    return vec4(fresnel * (pdf * facets_g1_smith(b, wi)), pdf);
}

BsdfSample conductor_sample(Bsdf b, vec3 wo, vec2 u) {
    if (wo.z <= 0.0) return bsdf_no_sample();
    if (b.alpha < ALPHA_DELTA) {
        vec3 mirrored = fresnel_conductor(wo.z, b.index, b.extinction);
        return BsdfSample(vec3(-wo.xy, wo.z), mirrored, 1.0, 1.0, EVENT_REFLECTION | EVENT_DELTA);
    }
    vec3 wh = facets_sample_vndf(b, wo, u);
    vec3 wi = reflect(-wo, wh);
    float pdf = conductor_eval_pdf(b, wo, wi).a;
    if (pdf <= 0.0) return bsdf_no_sample();
    vec3 fresnel = fresnel_conductor(dot(wo, wh), b.index, b.extinction);
    return BsdfSample(wi, fresnel * facets_g1_smith(b, wi), pdf, 1.0, EVENT_REFLECTION);
}
