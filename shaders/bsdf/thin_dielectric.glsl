// SPDX-License-Identifier: MIT
// A pane of a dielectric, so thin that its two interfaces are one surface: smooth, or of GGX facets. It is there where
// HAS_EXACT_FRESNEL is.
#include "bsdf/dielectric.glsl"
#include "bsdf/facets.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/model.glsl"
#include "core/hash.glsl"
#include "core/math.glsl"

// All orders of reflection between the two interfaces: 2 F / (1 + F), the rest being transmitted (Pharr, Jakob and Humphreys
// 2023, section 9.5.1).
float thin_dielectric_reflectance(Bsdf b, float cos_theta) {
    float fresnel = fresnel_dielectric(cos_theta, b.eta);
    return 2.0 * fresnel / (1.0 + fresnel);
}

// What goes straight on.
vec3 thin_dielectric_null_transmittance(Bsdf b, float cos_theta) {
    return dielectric_is_smooth(b) ? (1.0 - thin_dielectric_reflectance(b, cos_theta)) * b.transmittance : vec3(0.0);
}

// f |cos_i| in rgb and the density in a, without delta lobes: facets reflect, and what they transmit has the directions of
// the reflected lobe, mirrored in the surface (Khronos Group 2021, KHR_materials_transmission).
vec4 thin_dielectric_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    if (dielectric_is_smooth(b) || wo.z <= 0.0 || wi.z == 0.0) return vec4(0.0);
    vec3 above = vec3(wi.xy, abs(wi.z));
    vec3 wh = normalize(wo + above);
    float reflectance = thin_dielectric_reflectance(b, dot(wo, wh));
    float pdf = 0.25 * facets_visible_d(b, wo, wh) * (wi.z > 0.0 ? reflectance : 1.0 - reflectance);
    return vec4((wi.z > 0.0 ? vec3(1.0) : b.transmittance) * (pdf * facets_g1_smith(b, wi)), pdf);
}

BsdfSample thin_dielectric_scatter_smooth(Bsdf b, vec3 wo, vec2 u) {
    float reflectance = thin_dielectric_reflectance(b, wo.z);
    if (choose_first(reflectance, u.x)) {
        return BsdfSample(vec3(-wo.xy, wo.z), vec3(1.0), reflectance, 1.0, EVENT_REFLECTION | EVENT_DELTA);
    }
    return BsdfSample(-wo, b.transmittance, 1.0 - reflectance, 1.0, EVENT_TRANSMISSION | EVENT_DELTA | EVENT_NULL);
}

BsdfSample thin_dielectric_scatter_rough(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    vec3 wh = facets_sample_vndf(b, wo, u);
    s.wi = reflect(-wo, wh);
    if (s.wi.z <= 0.0) return s;
    bool reflects = dielectric_choice(u) < thin_dielectric_reflectance(b, dot(wo, wh));
    s.wi.z = reflects ? s.wi.z : -s.wi.z;
    s.pdf = thin_dielectric_eval_pdf(b, wo, s.wi).a;
    s.weight = (reflects ? vec3(1.0) : b.transmittance) * facets_g1_smith(b, s.wi);
    s.event = reflects ? EVENT_REFLECTION : EVENT_TRANSMISSION;
    return s;
}

BsdfSample thin_dielectric_sample(Bsdf b, vec3 wo, vec2 u) {
    if (wo.z <= 0.0) return bsdf_no_sample();
    if (dielectric_is_smooth(b)) return thin_dielectric_scatter_smooth(b, wo, u);
    return thin_dielectric_scatter_rough(b, wo, u);
}
