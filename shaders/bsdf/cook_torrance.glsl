// SPDX-License-Identifier: MIT
// A Cook-Torrance specular lobe over a Lambert base.
//   specular  D F G / (4 cos_o cos_i), F = Schlick at the half vector (Cook and Torrance 1982), perhaps with a thin film
//   diffuse   albedo / pi (1 - R(cos_o)) (1 - R(cos_i)), light that passes the interface twice, R being
//             what the rough interface reflects at the mean normal (fresnel_schlick_rough); after Kelemen and
//             Szirmay-Kalos 2001, A Microfacet Based Coupled Specular-Matte BRDF Model, not normalised as theirs
// The second form is reciprocal and never reflects more than it receives; the common factor
// 1 - F(wo . wh), which a material may ask for, reflects up to 1.9 times the light at grazing angles (docs/material.md).
#include "bsdf/facets.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/iridescence.glsl"
#include "bsdf/model.glsl"
#include "core/math.glsl"
#include "core/warp.glsl"

#ifndef HAS_COOK_TORRANCE
#define HAS_COOK_TORRANCE 1
#endif
#ifndef HAS_DELTA
#define HAS_DELTA 1  // some specular lobe may be a perfect mirror
#endif

uniform int u_multiple_scattering;  // 1: the specular lobe has its part, for Smith's uncorrelated geometry term
uniform int u_without_half_vector;  // 1: no base has the factor of the half vector, which then needs no code

bool cook_torrance_is_mirror(Bsdf b) { return HAS_DELTA == 1 && b.alpha < ALPHA_DELTA; }

// What an interface lets through to the base, or back out, at an angle to the normal. The height-correlated term lets
// the facets reflect more at grazing angles: less of the rise towards them is lost to their tilt (docs/material.md).
vec3 cook_torrance_interface(vec3 f0, vec3 f90, float alpha, float cos_theta) {
#if GEOMETRY_TERM == GEOMETRY_SMITH_HEIGHT_CORRELATED
    alpha *= 0.95;
#endif
    return 1.0 - fresnel_schlick_rough(f0, f90, alpha, cos_theta);
}

vec3 cook_torrance_transmittance(Bsdf b, float cos_theta) {
    vec3 passed = cook_torrance_interface(b.f0, b.f90, b.alpha, cos_theta);
    if (!iridescence_is_there(b)) return passed;
    return clamp(passed - iridescence_rough_change(b, cos_theta), 0.0, 1.0);
}

// The part of light from wi that the base scatters to wo, but for its albedo.
vec3 cook_torrance_diffuse_factor(Bsdf b, vec3 wo, vec3 wi) {
    if (u_without_half_vector == 0 && b.half_vector != 0) {
        return 1.0 - iridescence_fresnel(b, dot(wo, normalize(wo + wi)));
    }
    return cook_torrance_transmittance(b, wo.z) * cook_torrance_transmittance(b, wi.z);
}

vec3 cook_torrance_diffuse(Bsdf b, vec3 wo, vec3 wi) {
    return b.diffuse * (wi.z * INVERSE_PI) * cook_torrance_diffuse_factor(b, wo, wi);
}

// About what the specular lobe and the base reflect towards wo, of light from all around.
vec2 cook_torrance_reflected(Bsdf b, vec3 wo) {
    vec3 passed = cook_torrance_transmittance(b, wo.z);
    return vec2(luminance(1.0 - passed), luminance(b.diffuse * passed * (1.0 - b.f0)));
}

// Probability of choosing the specular lobe: its share of the energy reflected towards wo.
float cook_torrance_specular_probability(Bsdf b, vec3 wo) {
    vec2 reflected = cook_torrance_reflected(b, wo);
    float total = reflected.x + reflected.y;
    return total > 0.0 ? reflected.x / total : 0.0;
}

// f |cos_i| in rgb and the density in a, both without the delta lobe.
vec4 cook_torrance_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0 || wi.z <= 0.0) return vec4(0.0);
    float specular_probability = cook_torrance_specular_probability(b, wo);
    vec3 diffuse = cook_torrance_diffuse(b, wo, wi);
    vec4 result = vec4(diffuse, (1.0 - specular_probability) * square_to_cosine_hemisphere_pdf(wi));
    if (!cook_torrance_is_mirror(b)) {
        vec3 wh = normalize(wo + wi);
        float pdf = 0.25 * facets_visible_d(b, wo, wh);
        vec3 fresnel = iridescence_fresnel(b, dot(wo, wh));
        if (u_multiple_scattering != 0) fresnel *= ggx_compensation(iridescence_f0(b), facets_mean_width(b), wo.z);
        result += vec4(fresnel * (pdf * facets_shadowing(b, wo, wi)), specular_probability * pdf);
    }
    return result;
}

BsdfSample cook_torrance_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    if (wo.z <= 0.0) return s;
    float specular_probability = cook_torrance_specular_probability(b, wo);
    bool specular = choose_first(specular_probability, u.x);
#if HAS_DELTA
    if (specular && cook_torrance_is_mirror(b)) {
        vec3 wi = vec3(-wo.xy, wo.z);
        vec3 reflectance = iridescence_fresnel(b, wo.z) * ggx_g(b.alpha, wo, wi);
        return BsdfSample(wi, reflectance / specular_probability, specular_probability, 1.0, EVENT_REFLECTION | EVENT_DELTA);
    }
#endif
    s.wi = square_to_cosine_hemisphere(u);
    if (specular) s.wi = reflect(-wo, facets_sample_vndf(b, wo, u));
    bsdf_weigh(s, cook_torrance_eval_pdf(b, wo, s.wi));
    return s;
}
