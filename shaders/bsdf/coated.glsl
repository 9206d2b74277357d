// SPDX-License-Identifier: MIT
// A clear coat over Cook-Torrance, with sheen or without: GGX facets of a dielectric, and below them the base, which gets
// and gives what they pass. Of light from an angle that is all but c R(cos), R being what cook_torrance.glsl takes a rough
// interface to reflect. Directions are local to the coat, whose normal is that of the surface or of a normal map of its
// own, whatever another one makes of that of the base (Khronos Group 2020, KHR_materials_clearcoat, with factors that are
// reciprocal). Values count what shading normals take from each of the two.
#include "bsdf/cook_torrance.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/ggx.glsl"
#include "bsdf/model.glsl"
#include "bsdf/shading_normal.glsl"
#include "bsdf/sheen.glsl"
#include "core/frame.glsl"
#include "core/math.glsl"

// At grazing incidence (scene/reflectance.py).
float coated_f90(Bsdf b) { return min(1.0, 50.0 * b.coat_f0); }

// What the coat lets through to the base, or back out.
float coated_transmittance(Bsdf b, vec3 w) {
    float cos_theta = max(0.0, w.z);
    return 1.0 - b.coat_weight * (1.0 - cook_torrance_interface(vec3(b.coat_f0), vec3(coated_f90(b)), b.coat_alpha, cos_theta).x);
}

float coated_transmittance(Bsdf b, vec3 wo, vec3 wi) { return coated_transmittance(b, wo) * coated_transmittance(b, wi); }

Frame coated_base_frame(Bsdf b) { return Frame(b.base_tangent, cross(b.base_normal, b.base_tangent), b.base_normal); }

// What reaches the base and leaves it, of what it scatters to wi, which is local to it.
float coated_base_share(Bsdf b, vec3 wo, vec3 wi) {
    Frame base = coated_base_frame(b);
    vec3 outside = frame_to_world(base, wi);
    if (wo.z <= 0.0 || outside.z <= 0.0) return 0.0;
    return coated_transmittance(b, wo, outside) * shading_normal_factor(frame_to_local(base, b.geometric), wi);
}

// Of the coat, f |cos_i| in x and the density in y.
vec2 coated_facets(Bsdf b, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0 || wi.z <= 0.0) return vec2(0.0);
    vec3 wh = normalize(wo + wi);
    float pdf = 0.25 * ggx_visible_d(b.coat_alpha, wo.z, wh);
    float fresnel = fresnel_schlick(vec3(b.coat_f0), vec3(coated_f90(b)), dot(wo, wh)).x;
    float value = b.coat_weight * fresnel * ggx_shadowing(vec2(b.coat_alpha), wo, wi);
    return pdf * vec2(value * shading_normal_factor(b.geometric, wi), 1.0);
}

// Probability of choosing the coat: about its share of the energy reflected towards wo.
float coated_probability(Bsdf b, vec3 wo) {
    float passed = coated_transmittance(b, wo);
    vec2 base = passed * passed * sheen_reflected(b, frame_to_local(coated_base_frame(b), wo));
    return (1.0 - passed) / max(1.0 - passed + base.x + base.y, 1e-30);
}

vec4 coated_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    vec3 sum = wo + wi;  // along the horizon they may be opposite
    if (wo.z <= 0.0 || wi.z <= 0.0 || dot(sum, sum) <= 0.0) return vec4(0.0);
    Frame frame = coated_base_frame(b);
    vec3 base_wo = frame_to_local(frame, wo), base_wi = frame_to_local(frame, wi);
    vec4 base = sheen_eval_pdf(b, base_wo, base_wi);
    vec2 facets = coated_facets(b, wo, wi);
    return vec4(base.rgb * coated_base_share(b, wo, base_wi) + facets.x, mix(base.a, facets.y, coated_probability(b, wo)));
}

vec3 coated_diffuse(Bsdf b, vec3 wo, vec3 wi) {
    Frame frame = coated_base_frame(b);
    vec3 base_wo = frame_to_local(frame, wo), base_wi = frame_to_local(frame, wi);
    if (base_wo.z <= 0.0 || base_wi.z <= 0.0) return vec3(0.0);
    return sheen_diffuse(b, base_wo, base_wi) * coated_base_share(b, wo, base_wi);
}

// What is scattered by lobes that are wider than `width`, without delta lobes.
vec3 coated_wide(Bsdf b, vec3 wo, vec3 wi, float width) {
    vec3 wide = vec3(b.coat_alpha > width ? coated_facets(b, wo, wi).x : 0.0);
    if (b.alpha <= width) return wide + coated_diffuse(b, wo, wi);
    Frame frame = coated_base_frame(b);
    vec3 base_wi = frame_to_local(frame, wi);
    vec3 base = sheen_eval_pdf(b, frame_to_local(frame, wo), base_wi).rgb;
    return wide + base * coated_base_share(b, wo, base_wi);
}

BsdfSample coated_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    if (wo.z <= 0.0) return s;
    float probability = coated_probability(b, wo);
    if (choose_first(probability, u.x)) {
        s.wi = reflect(-wo, ggx_sample_vndf(b.coat_alpha, wo, u));
    } else {
        Frame frame = coated_base_frame(b);
        s = sheen_sample(b, frame_to_local(frame, wo), u);
        if (s.pdf <= 0.0) return s;
        float share = coated_base_share(b, wo, s.wi);
        s.wi = frame_to_world(frame, s.wi);
        if (bsdf_is_delta(s)) {
            s.weight *= share / (1.0 - probability);
            s.pdf *= 1.0 - probability;
            return s;
        }
    }
    bsdf_weigh(s, coated_eval_pdf(b, wo, s.wi));
    return s;
}
