// SPDX-License-Identifier: MIT
// The GGX facets of a Bsdf: of one width, or wider along the tangent x than across it (Heitz 2014, Understanding the
// Masking-Shadowing Function in Microfacet-Based BRDFs, section 5.3). In what a direction is masked by, an anisotropic
// surface is an isotropic one of the width that it has along that direction.
#include "bsdf/ggx.glsl"
#include "bsdf/model.glsl"
#include "core/math.glsl"

uniform int u_facets_are_isotropic;  // 1: all are, and widths along tangents need no code

bool facets_are_anisotropic(Bsdf b) { return u_facets_are_isotropic == 0 && b.anisotropy > 0.0; }

// Widths along x and y (Khronos Group 2023, KHR_materials_anisotropy).
vec2 facets_widths(Bsdf b) { return vec2(mix(b.alpha, 1.0, square(b.anisotropy)), b.alpha); }

// The width along a direction.
float facets_width(Bsdf b, vec3 w) {
    if (!facets_are_anisotropic(b)) return b.alpha;
    vec2 projected = facets_widths(b) * w.xy;
    return sqrt(dot(projected, projected) / max(dot(w.xy, w.xy), 1e-30));
}

// The width of an isotropic surface that reflects about as much once (0.76 to 1.10 times as much, where F is 1).
float facets_mean_width(Bsdf b) {
    return facets_are_anisotropic(b) ? length(facets_widths(b)) * sqrt(0.5) : b.alpha;
}

float facets_d(Bsdf b, vec3 wh) {
    if (!facets_are_anisotropic(b)) return ggx_d(b.alpha, wh);
    if (wh.z <= 0.0) return 0.0;
    vec2 widths = facets_widths(b);
    float a2 = widths.x * widths.y;
    float t = a2 * wh.z * wh.z + dot(wh.xy * wh.xy, widths.yx / widths);
    return a2 * INVERSE_PI / (t * t);
}

float facets_g1_smith(Bsdf b, vec3 w) { return ggx_g1_smith(facets_width(b, w), abs(w.z)); }

// D G1(wo) / cos(wo): a quarter of it is the density of directions reflected from the visible facets.
float facets_visible_d(Bsdf b, vec3 wo, vec3 wh) {
    if (!facets_are_anisotropic(b)) return ggx_visible_d(b.alpha, wo.z, wh);
    return facets_d(b, wh) * facets_g1_smith(b, wo) / wo.z;
}

// What of the facets visible from wo is lit from wi, by the chosen geometry term.
float facets_shadowing(Bsdf b, vec3 wo, vec3 wi) {
    if (!facets_are_anisotropic(b)) return ggx_shadowing(vec2(b.alpha), wo, wi);
    return ggx_shadowing(vec2(facets_width(b, wo), facets_width(b, wi)), wo, wi);
}

vec3 facets_sample_vndf(Bsdf b, vec3 wo, vec2 u) {
    return ggx_sample_vndf(facets_are_anisotropic(b) ? facets_widths(b) : vec2(b.alpha), wo, u);
}
