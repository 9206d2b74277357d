// SPDX-License-Identifier: MIT
// The GGX (Trowbridge-Reitz) microfacet distribution in the local frame, its geometry terms and the
// sampling of its visible normals. alpha is the width; wo and wi lie in the upper hemisphere.
#include "core/math.glsl"

#define GEOMETRY_SMITH 0
#define GEOMETRY_SMITH_HEIGHT_CORRELATED 1
#define GEOMETRY_SCHLICK_BECKMANN 2
#define GEOMETRY_KARIS 3
#define GEOMETRY_KARIS_ENVIRONMENT 4
#ifndef GEOMETRY_TERM
#define GEOMETRY_TERM GEOMETRY_SMITH
#endif

// A wider lobe than this is resolved by float32; a narrower one cannot be told from a mirror.
const float ALPHA_DELTA = 1e-4;

// Normal distribution D in 1/sr (Walter et al. 2007, Microfacet Models for Refraction, eq. 33),
// written with sin^2 from wh.xy so that it keeps its precision down to alpha = 1e-4.
float ggx_d(float alpha, vec3 wh) {
    if (wh.z <= 0.0) return 0.0;
    float a2 = alpha * alpha;
    float t = a2 * wh.z * wh.z + dot(wh.xy, wh.xy);
    return a2 * INVERSE_PI / (t * t);
}

// Smith's masking of GGX (Walter et al. 2007, eq. 34). The root is not below cos_theta, but its square may be too small
// for a float32.
float ggx_g1_smith(float alpha, float cos_theta) {
    float a2 = alpha * alpha;
    return 2.0 * cos_theta / (cos_theta + max(cos_theta, sqrt(a2 + (1.0 - a2) * cos_theta * cos_theta)));
}

// Smith's Lambda of GGX: the same G1 is 1 / (1 + Lambda).
float ggx_lambda(float alpha, float cos_theta) {
    float a2 = alpha * alpha;
    return 0.5 * max(cos_theta, sqrt(a2 + (1.0 - a2) * cos_theta * cos_theta)) / cos_theta - 0.5;
}

// Masking with a width k (Schlick 1994, eq. 19).
float ggx_g1_schlick(float k, float cos_theta) { return cos_theta / (cos_theta * (1.0 - k) + k); }

// k of a light that shines from one direction (Karis 2013, Real Shading in Unreal Engine 4, eq. 4).
float ggx_k_direct(float alpha) { return square(sqrt(alpha) + 1.0) / 8.0; }

// The chosen masking term G1: Smith's, or Schlick's with k = sqrt(2 alpha^2 / pi), with Karis's k, or with his
// k = roughness^2 / 2 for light from all around.
float ggx_g1(float alpha, float cos_theta) {
#if GEOMETRY_TERM == GEOMETRY_SMITH || GEOMETRY_TERM == GEOMETRY_SMITH_HEIGHT_CORRELATED
    return ggx_g1_smith(alpha, cos_theta);
#elif GEOMETRY_TERM == GEOMETRY_SCHLICK_BECKMANN
    return ggx_g1_schlick(alpha * sqrt(2.0 * INVERSE_PI), cos_theta);
#elif GEOMETRY_TERM == GEOMETRY_KARIS
    return ggx_g1_schlick(ggx_k_direct(alpha), cos_theta);
#else
    return ggx_g1_schlick(0.5 * alpha, cos_theta);
#endif
}

// Masking and shadowing together: uncorrelated, that is, the product of the two; or, of Smith's, correlated by the
// height of the facet (Heitz 2014, Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs, eq. 99).
// alpha is the width along wo and that along wi.
float ggx_g(vec2 alpha, vec3 wo, vec3 wi) {
#if GEOMETRY_TERM == GEOMETRY_SMITH_HEIGHT_CORRELATED
    return 1.0 / (1.0 + ggx_lambda(alpha.x, wo.z) + ggx_lambda(alpha.y, wi.z));
#else
    return ggx_g1(alpha.x, wo.z) * ggx_g1(alpha.y, wi.z);
#endif
}

float ggx_g(float alpha, vec3 wo, vec3 wi) { return ggx_g(vec2(alpha), wo, wi); }

// What of the facets visible from wo is lit from wi: that G over Smith's G1 of wo, by which normals are sampled.
float ggx_shadowing(vec2 alpha, vec3 wo, vec3 wi) {
#if GEOMETRY_TERM == GEOMETRY_SMITH
    return ggx_g1_smith(alpha.y, wi.z);
#else
    return ggx_g(alpha, wo, wi) / ggx_g1_smith(alpha.x, wo.z);
#endif
}

// What a white metal reflects at an angle, of all light, by single scattering: the directional albedo
// of D and Smith's uncorrelated G with F = 1. A fit of our own, within 0.35 % of the integral (docs/material.md).
float ggx_albedo(float alpha, float cos_theta) {
    const mat4 fit = mat4(
        0.0611, 0.0268, 0.5768, -0.2798,
        0.3890, -0.0495, 1.2835, 0.1905,
        -0.5535, -1.4913, 5.7916, -7.4814,
        0.1462, 2.3215, -8.4859, 11.9088);
    float a2 = alpha * alpha;
    float rest = 9.0 * a2 / (cos_theta * cos_theta + 9.0 * a2);
    float t = sqrt(1.0 - rest);
    float t2 = t * t;
    return 1.0 - rest * dot(vec4(1.0, alpha, a2, a2 * alpha), fit * vec4(1.0, t, t2, t2 * t));
}

// What the light scattered more than once between facets makes of a lobe of reflectance f0: Turquin 2019,
// Practical Multiple Scattering Compensation for Microfacet Models.
vec3 ggx_compensation(vec3 f0, float alpha, float cos_o) {
    float albedo = ggx_albedo(alpha, cos_o);
    return 1.0 + f0 * ((1.0 - albedo) / albedo);
}

// A microfacet normal with the density of the normals visible from wo (Dupuy and Benyoub 2023,
// Sampling Visible GGX Normals with Spherical Caps, listing 3), of widths alpha along x and y.
vec3 ggx_sample_vndf(vec2 alpha, vec3 wo, vec2 u) {
    vec3 stretched = normalize(vec3(wo.xy * alpha, wo.z));
    float z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    float r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    vec3 cap = vec3(r * cos_sin_turns(u.x), z) + stretched;
    return normalize(vec3(cap.xy * alpha, max(0.0, cap.z)));
}

vec3 ggx_sample_vndf(float alpha, vec3 wo, vec2 u) { return ggx_sample_vndf(vec2(alpha), wo, u); }

// D G1(wo) / cos(wo) with Smith's G1, in one division.
float ggx_visible_d(float alpha, float cos_o, vec3 wh) {
    if (wh.z <= 0.0) return 0.0;
    float a2 = alpha * alpha;
    float t = a2 * wh.z * wh.z + dot(wh.xy, wh.xy);
    return 2.0 * INVERSE_PI * a2 / (t * t * (cos_o + max(cos_o, sqrt(a2 + (1.0 - a2) * cos_o * cos_o))));
}

// Its density over the solid angle of wh (Heitz 2018, Sampling the GGX Distribution of Visible
// Normals, eq. 1). It belongs to the sampler, so it uses Smith's G1 whichever term shades.
float ggx_sample_vndf_pdf(float alpha, vec3 wo, vec3 wh) {
    return max(0.0, dot(wo, wh)) * ggx_visible_d(alpha, wo.z, wh);
}
