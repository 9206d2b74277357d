// SPDX-License-Identifier: MIT
// The interface of two dielectrics, such as glass in air: smooth, or of GGX facets (Walter et al. 2007, Microfacet Models
// for Refraction through Rough Surfaces; Smith's uncorrelated masking and shadowing).
#include "bsdf/facets.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/model.glsl"
#include "core/hash.glsl"
#include "core/math.glsl"

uniform int u_dielectrics_are_smooth;  // 1: all are, and facets need no code

// Indices nearer to each other than this are the same to float32: half vectors have no direction left.
const float ETA_MATCHED = 1e-4;

bool dielectric_is_matched(Bsdf b) { return abs(b.eta - 1.0) < ETA_MATCHED; }

// Whether both lobes are deltas.
bool dielectric_is_smooth(Bsdf b) {
    return u_dielectrics_are_smooth != 0 || b.alpha < ALPHA_DELTA || dielectric_is_matched(b);
}

// The direction beyond a facet of normal wh (Snell's law), 0 where all is reflected.
vec3 dielectric_refract(vec3 wo, vec3 wh, float eta) {
    float cos_o = dot(wo, wh);
    float cos2_i = 1.0 - (1.0 - cos_o * cos_o) / (eta * eta);
    return cos2_i > 0.0 ? (cos_o / eta - sqrt(cos2_i)) * wh - wo / eta : vec3(0.0);
}

// f |cos_i| in rgb and the density in a (Walter et al. 2007, equations 20, 21 and 17), without delta lobes. Of radiance,
// which is 1 / eta^2 of theirs where it is transmitted.
vec4 dielectric_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    bool reflects = wi.z > 0.0;
    vec3 wh = normalize(wo + (reflects ? 1.0 : b.eta) * wi);
    wh = wh.z < 0.0 ? -wh : wh;
    float cos_o = dot(wo, wh);
    float cos_i = dot(wi, wh);
    if (dielectric_is_smooth(b) || wo.z <= 0.0 || wi.z == 0.0 || cos_o <= 0.0 || (cos_i > 0.0) != reflects) return vec4(0.0);
    float fresnel = fresnel_dielectric(cos_o, b.eta);
    float visible = facets_visible_d(b, wo, wh);
    float shadowing = facets_g1_smith(b, wi);
    float pdf = 0.25 * fresnel * visible;
    if (reflects) return vec4(vec3(pdf * shadowing), pdf);
    pdf = (1.0 - fresnel) * visible * cos_o * abs(cos_i) * square(b.eta / (cos_o + b.eta * cos_i));
    return vec4(b.transmittance * (pdf * shadowing / square(b.eta)), pdf);
}

BsdfSample dielectric_scatter_smooth(Bsdf b, vec3 wo, vec2 u) {
    if (dielectric_is_matched(b)) {
        return BsdfSample(-wo, b.transmittance, 1.0, 1.0, EVENT_TRANSMISSION | EVENT_DELTA | EVENT_NULL);
    }
    float fresnel = fresnel_dielectric(wo.z, b.eta);
    vec3 wi = vec3(-wo.xy / b.eta, -sqrt(max(0.0, 1.0 - dot(wo.xy, wo.xy) / square(b.eta))));
    if (choose_first(fresnel, u.x)) {
        return BsdfSample(vec3(-wo.xy, wo.z), vec3(1.0), fresnel, 1.0, EVENT_REFLECTION | EVENT_DELTA);
    }
    return BsdfSample(wi, b.transmittance / square(b.eta), 1.0 - fresnel, b.eta, EVENT_TRANSMISSION | EVENT_DELTA);
}

// A number for what a facet does, which u has chosen: reflect or transmit.
float dielectric_choice(vec2 u) { return hash_to_unit(hash_uint(floatBitsToUint(u.x) ^ hash_uint(floatBitsToUint(u.y)))); }

// The facet is drawn first, then by its Fresnel term what it does.
BsdfSample dielectric_scatter_rough(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    vec3 wh = facets_sample_vndf(b, wo, u);
    bool reflects = dielectric_choice(u) < fresnel_dielectric(dot(wo, wh), b.eta);
    s.wi = reflects ? reflect(-wo, wh) : dielectric_refract(wo, wh, b.eta);
    if (wo.z <= 0.0 || s.wi.z == 0.0 || (s.wi.z > 0.0) != reflects) return bsdf_no_sample();
    s.pdf = dielectric_eval_pdf(b, wo, s.wi).a;
    if (s.pdf <= 0.0) return s;
    float shadowing = facets_g1_smith(b, s.wi);
    s.weight = reflects ? vec3(shadowing) : b.transmittance * (shadowing / square(b.eta));
    s.eta = reflects ? 1.0 : b.eta;
    s.event = reflects ? EVENT_REFLECTION : EVENT_TRANSMISSION;
    return s;
}

BsdfSample dielectric_sample(Bsdf b, vec3 wo, vec2 u) {
    if (wo.z <= 0.0) return bsdf_no_sample();
    if (dielectric_is_smooth(b)) return dielectric_scatter_smooth(b, wo, u);
    return dielectric_scatter_rough(b, wo, u);
}
