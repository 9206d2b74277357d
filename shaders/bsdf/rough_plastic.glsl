// SPDX-License-Identifier: MIT
// A Lambert base under a rough coat of a dielectric: GGX facets with Smith's uncorrelated masking and shadowing reflect as
// those of a rough dielectric do, and what they pass on its way in and out is scattered by the base (Jakob 2010, Mitsuba's
// roughplastic). The diffuse parameter is that of plastic.glsl.
#include "bsdf/fresnel.glsl"
#include "bsdf/ggx.glsl"
#include "bsdf/model.glsl"
#include "core/math.glsl"
#include "core/warp.glsl"

// Of light from an angle, what the coat passes to the base, in y: a fit of packing/coats.py; in x what a smooth coat
// reflects at about the angle to a visible facet.
vec2 rough_plastic_interface(Bsdf b, float cos_theta) {
    float a2 = b.alpha * b.alpha;
    float cos_facet = 0.5 * (cos_theta + sqrt(a2 + (1.0 - a2) * cos_theta * cos_theta));
    float x = b.alpha / cos_facet;
    float x2 = x * x;
    float sin_theta = sqrt(max(0.0, 1.0 - cos_theta * cos_theta));
    float fit = dot(b.coat_facets, vec4(1.0, x, x2, x2 * x)) + dot(b.coat_angles, vec3(x2 * x2, cos_theta, sin_theta));
    float fresnel = fresnel_dielectric(cos_facet, b.eta);
    return vec2(fresnel, (1.0 - fresnel) * fit);
}

vec3 rough_plastic_diffuse(Bsdf b, vec3 wo, vec3 wi) {
    return b.diffuse * (rough_plastic_interface(b, wo.z).y * rough_plastic_interface(b, wi.z).y * wi.z * INVERSE_PI);
}

// Probability of choosing the facets: about their share of the energy reflected towards wo.
float rough_plastic_specular_probability(Bsdf b, vec2 interface_o) {
    return interface_o.x / (interface_o.x + interface_o.y * luminance(b.diffuse));
}

vec4 rough_plastic_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0 || wi.z <= 0.0) return vec4(0.0);
    vec2 interface_o = rough_plastic_interface(b, wo.z);
    float specular_probability = rough_plastic_specular_probability(b, interface_o);
    vec3 wh = normalize(wo + wi);
    float visible = 0.25 * ggx_visible_d(b.alpha, wo.z, wh);
    float specular = fresnel_dielectric(dot(wo, wh), b.eta) * visible * ggx_g1_smith(b.alpha, wi.z);
    vec3 diffuse = b.diffuse * (interface_o.y * rough_plastic_interface(b, wi.z).y * wi.z * INVERSE_PI);
    return vec4(specular + diffuse, mix(square_to_cosine_hemisphere_pdf(wi), visible, specular_probability));
}

BsdfSample rough_plastic_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    if (wo.z <= 0.0) return s;
    bool specular = choose_first(rough_plastic_specular_probability(b, rough_plastic_interface(b, wo.z)), u.x);
    s.wi = square_to_cosine_hemisphere(u);
    if (specular) s.wi = reflect(-wo, ggx_sample_vndf(b.alpha, wo, u));
    bsdf_weigh(s, rough_plastic_eval_pdf(b, wo, s.wi));
    return s;
}
