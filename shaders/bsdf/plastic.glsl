// SPDX-License-Identifier: MIT
// A Lambert base under a smooth coat of a dielectric: light is refracted in and out, and what the coat reflects back to the
// base is scattered again (Pharr, Jakob and Humphreys 2023, section 14.3, as one BSDF in closed form: Jakob 2010,
// Mitsuba's plastic). The diffuse parameter is what the base scatters after all of these, of radiance within the coat,
// seen from outside (material_bsdf).
#include "bsdf/fresnel.glsl"
#include "bsdf/model.glsl"
#include "core/math.glsl"
#include "core/warp.glsl"

// Probabilities of choosing the mirror lobe and the base: about their shares of the energy reflected towards wo. The second
// is no difference from 1, which would lose digits at grazing angles.
vec2 plastic_probabilities(Bsdf b, vec3 wo) {
    float fresnel = fresnel_dielectric(wo.z, b.eta);
    vec2 reflected = vec2(fresnel, (1.0 - fresnel) * luminance(b.diffuse));
    return reflected / (reflected.x + reflected.y);
}

vec4 plastic_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0 || wi.z <= 0.0) return vec4(0.0);
    float passed = (1.0 - fresnel_dielectric(wo.z, b.eta)) * (1.0 - fresnel_dielectric(wi.z, b.eta));
    float pdf = plastic_probabilities(b, wo).y * square_to_cosine_hemisphere_pdf(wi);
    return vec4(b.diffuse * (passed * wi.z * INVERSE_PI), pdf);
}

BsdfSample plastic_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    if (wo.z <= 0.0) return s;
    float specular_probability = plastic_probabilities(b, wo).x;
    if (choose_first(specular_probability, u.x)) {
        vec3 mirrored = vec3(fresnel_dielectric(wo.z, b.eta) / specular_probability);
        return BsdfSample(vec3(-wo.xy, wo.z), mirrored, specular_probability, 1.0, EVENT_REFLECTION | EVENT_DELTA);
    }
    s.wi = square_to_cosine_hemisphere(u);
    bsdf_weigh(s, plastic_eval_pdf(b, wo, s.wi));
    return s;
}
