// SPDX-License-Identifier: MIT
// Cook-Torrance whose base transmits a part of the light diffusely, as leaves and paper do: it is so thin that nothing is
// refracted, and has the same interface on both sides (Khronos Group 2025, KHR_materials_diffuse_transmission).
//   reflected    as without, of a base that keeps the rest
//   transmitted  albedo / pi T(cos_o) T(|cos_i|), T being what the rough interface lets through (bsdf/cook_torrance.glsl)
// T is that of the base, so that both together are reciprocal and never scatter more than they receive.
#include "bsdf/cook_torrance.glsl"
#include "bsdf/model.glsl"
#include "core/math.glsl"
#include "core/warp.glsl"

vec3 translucent_mirrored(vec3 w) { return vec3(w.xy, -w.z); }

// f |cos_i| of what comes from below.
vec3 translucent_transmitted(Bsdf b, vec3 wo, vec3 wi) {
    vec3 passed = cook_torrance_transmittance(b, wo.z) * cook_torrance_transmittance(b, -wi.z);
    return b.transmitted * (-wi.z * INVERSE_PI) * passed;
}

// Probability of choosing transmission: its share of the energy scattered towards wo.
float translucent_probability(Bsdf b, vec3 wo) {
    vec2 reflected = cook_torrance_reflected(b, wo);
    float transmitted = luminance(b.transmitted * cook_torrance_transmittance(b, wo.z) * (1.0 - b.f0));
    return transmitted / max(reflected.x + reflected.y + transmitted, 1e-30);
}

// f |cos_i| in rgb and the density in a, both without the delta lobe.
vec4 translucent_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0) return vec4(0.0);
    float probability = translucent_probability(b, wo);
    if (wi.z < 0.0) {
        float pdf = probability * square_to_cosine_hemisphere_pdf(translucent_mirrored(wi));
        return vec4(translucent_transmitted(b, wo, wi), pdf);
    }
    vec4 reflected = cook_torrance_eval_pdf(b, wo, wi);
    return vec4(reflected.rgb, (1.0 - probability) * reflected.a);
}

// What is diffuse: all that is transmitted, and what the base reflects.
vec3 translucent_diffuse(Bsdf b, vec3 wo, vec3 wi) {
    return wi.z < 0.0 ? translucent_transmitted(b, wo, wi) : cook_torrance_diffuse(b, wo, wi);
}

BsdfSample translucent_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    if (wo.z <= 0.0) return s;
    float probability = translucent_probability(b, wo);
    if (choose_first(probability, u.x)) {
        s.wi = translucent_mirrored(square_to_cosine_hemisphere(u));
        s.event = EVENT_TRANSMISSION;
    } else {
        s = cook_torrance_sample(b, wo, u);
        if (s.pdf <= 0.0) return s;
        if (bsdf_is_delta(s)) {
            s.weight /= 1.0 - probability;
            s.pdf *= 1.0 - probability;
            return s;
        }
    }
    bsdf_weigh(s, translucent_eval_pdf(b, wo, s.wi));
    return s;
}
