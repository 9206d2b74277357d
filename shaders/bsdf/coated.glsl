// SPDX-License-Identifier: MIT
// A clear coat over Cook-Torrance: GGX facets of a dielectric, and below them the base, which gets and gives what they
// pass. Of light from an angle that is all but c R(cos), R being what cook_torrance.glsl takes a rough interface to
// reflect. The coat has the normal of the surface, whatever a normal map makes of that of the base
// (Khronos Group 2020, KHR_materials_clearcoat, with factors that are reciprocal).
#include "bsdf/cook_torrance.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/ggx.glsl"
#include "bsdf/model.glsl"
#include "core/frame.glsl"
#include "core/math.glsl"

// At grazing incidence (scene/reflectance.py).
float coated_f90(Bsdf b) { return min(1.0, 50.0 * b.coat_f0); }

// What the coat lets through to the base, or back out.
float coated_transmittance(Bsdf b, vec3 w) {
    float cos_theta = max(0.0, dot(w, b.coat_normal));
    return 1.0 - b.coat_weight * (1.0 - cook_torrance_interface(vec3(b.coat_f0), vec3(coated_f90(b)), b.coat_alpha, cos_theta).x);
}

float coated_transmittance(Bsdf b, vec3 wo, vec3 wi) { return coated_transmittance(b, wo) * coated_transmittance(b, wi); }

// Of the coat, f |cos_i| in x and the density in y.
vec2 coated_facets(Bsdf b, vec3 wo, vec3 wi) {
    Frame frame = frame_from_normal(b.coat_normal);
    wo = frame_to_local(frame, wo);
    wi = frame_to_local(frame, wi);
    if (wo.z <= 0.0 || wi.z <= 0.0) return vec2(0.0);
    vec3 wh = normalize(wo + wi);
    float pdf = 0.25 * ggx_visible_d(b.coat_alpha, wo.z, wh);
    float fresnel = fresnel_schlick(vec3(b.coat_f0), vec3(coated_f90(b)), dot(wo, wh)).x;
    return pdf * vec2(b.coat_weight * fresnel * ggx_shadowing(vec2(b.coat_alpha), wo, wi), 1.0);
}

// Probability of choosing the coat: about its share of the energy reflected towards wo.
float coated_probability(Bsdf b, vec3 wo) {
    float passed = coated_transmittance(b, wo);
    vec2 base = passed * passed * cook_torrance_reflected(b, wo);
    return (1.0 - passed) / max(1.0 - passed + base.x + base.y, 1e-30);
}

vec4 coated_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    vec3 sum = wo + wi;  // along the horizon they may be opposite
    if (wo.z <= 0.0 || wi.z <= 0.0 || dot(sum, sum) <= 0.0) return vec4(0.0);
    vec4 base = cook_torrance_eval_pdf(b, wo, wi);
    vec2 facets = coated_facets(b, wo, wi);
    return vec4(base.rgb * coated_transmittance(b, wo, wi) + facets.x, mix(base.a, facets.y, coated_probability(b, wo)));
}

vec3 coated_diffuse(Bsdf b, vec3 wo, vec3 wi) {
    return cook_torrance_diffuse(b, wo, wi) * coated_transmittance(b, wo, wi);
}

// What is scattered by lobes that are wider than `width`, without delta lobes.
vec3 coated_wide(Bsdf b, vec3 wo, vec3 wi, float width) {
    vec3 base = b.alpha > width ? cook_torrance_eval_pdf(b, wo, wi).rgb : cook_torrance_diffuse(b, wo, wi);
    return base * coated_transmittance(b, wo, wi) + (b.coat_alpha > width ? coated_facets(b, wo, wi).x : 0.0);
}

BsdfSample coated_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    if (wo.z <= 0.0) return s;
    float probability = coated_probability(b, wo);
    if (choose_first(probability, u.x)) {
        Frame frame = frame_from_normal(b.coat_normal);
        vec3 local = frame_to_local(frame, wo);
        if (local.z <= 0.0) return s;
        vec3 reflected = reflect(-local, ggx_sample_vndf(b.coat_alpha, local, u));
        if (reflected.z <= 0.0) return s;
        s.wi = frame_to_world(frame, reflected);
    } else {
        s = cook_torrance_sample(b, wo, u);
        if (bsdf_is_delta(s)) {
            s.weight *= coated_transmittance(b, wo, s.wi) / (1.0 - probability);
            s.pdf *= 1.0 - probability;
            return s;
        }
    }
    vec4 eval_pdf = coated_eval_pdf(b, wo, s.wi);
    s.pdf = eval_pdf.a;
    s.weight = eval_pdf.a > 0.0 ? eval_pdf.rgb / eval_pdf.a : vec3(0.0);
    return s;
}
