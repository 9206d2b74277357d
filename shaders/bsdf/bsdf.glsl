// SPDX-License-Identifier: MIT
// The contract of a BSDF, and its dispatch to one file for each model. Directions are local and unit with z along the
// shading normal, on the side of wo: wo.z > 0, and a direction with wi.z < 0 is transmitted.
//
//   bsdf_eval    f |cos_i|, without delta lobes
//   bsdf_pdf     1/sr, of bsdf_sample(), without delta lobes
//   bsdf_sample  a direction with its weight and density
//   bsdf_diffuse what of bsdf_eval is scattered by a diffuse part, for layers
//
// Radiance is what is transported: a transmitted weight carries the factor 1 / eta^2, which is taken out of the Russian
// roulette (integrator/path.glsl). Where nothing is scattered, weight and density are 0.
#include "bsdf/model.glsl"
#include "bsdf/coated.glsl"
#include "bsdf/conductor.glsl"
#include "bsdf/cook_torrance.glsl"
#include "bsdf/dielectric.glsl"
#include "bsdf/diffuse.glsl"
#include "bsdf/eon.glsl"
#include "bsdf/plastic.glsl"
#include "bsdf/rough_plastic.glsl"
#include "bsdf/sheen.glsl"
#include "bsdf/thin_dielectric.glsl"
#include "bsdf/translucent.glsl"

const int BSDF_NONE = -1;  // scatters nothing
const int BSDF_DIFFUSE = 0;
const int BSDF_COOK_TORRANCE = 1;
const int BSDF_EON = 2;
const int BSDF_DIELECTRIC = 3;
const int BSDF_THIN_DIELECTRIC = 4;
const int BSDF_CONDUCTOR = 5;
const int BSDF_PLASTIC = 6;
const int BSDF_ROUGH_PLASTIC = 7;
const int BSDF_COATED = 8;
const int BSDF_SHEEN = 9;
const int BSDF_TRANSLUCENT = 10;

uniform int u_absent_models;  // bit m: no material is of model m, which needs no code

// Whether some material is of a model.
bool bsdf_is_present(int model) { return (u_absent_models >> model & 1) == 0; }

bool bsdf_is(Bsdf b, int model) { return bsdf_is_present(model) && b.model == model; }

// f |cos_i| in rgb and the density in a, both without delta lobes.
vec4 bsdf_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    vec4 result = vec4(0.0);
#if HAS_DIFFUSE
    if (bsdf_is(b, BSDF_DIFFUSE)) result = diffuse_eval_pdf(b, wo, wi);
#endif
#if HAS_COOK_TORRANCE
    if (bsdf_is(b, BSDF_COOK_TORRANCE)) result = cook_torrance_eval_pdf(b, wo, wi);
#endif
#if HAS_EON
    if (bsdf_is(b, BSDF_EON)) result = eon_eval_pdf(b, wo, wi);
#endif
#if HAS_EXACT_FRESNEL
    if (bsdf_is(b, BSDF_DIELECTRIC)) result = dielectric_eval_pdf(b, wo, wi);
    if (bsdf_is(b, BSDF_THIN_DIELECTRIC) && u_dielectrics_are_smooth == 0) result = thin_dielectric_eval_pdf(b, wo, wi);
    if (bsdf_is(b, BSDF_CONDUCTOR)) result = conductor_eval_pdf(b, wo, wi);
    if (bsdf_is(b, BSDF_PLASTIC)) result = plastic_eval_pdf(b, wo, wi);
    if (bsdf_is(b, BSDF_ROUGH_PLASTIC)) result = rough_plastic_eval_pdf(b, wo, wi);
    if (bsdf_is(b, BSDF_COATED)) result = coated_eval_pdf(b, wo, wi);
    if (bsdf_is(b, BSDF_SHEEN)) result = sheen_eval_pdf(b, wo, wi);
    if (bsdf_is(b, BSDF_TRANSLUCENT)) result = translucent_eval_pdf(b, wo, wi);
#endif
    return result;
}

// Whether a sample goes on in the direction of the path, as if there was no surface.
bool bsdf_is_null(BsdfSample s) { return HAS_EXACT_FRESNEL == 1 && (s.event & EVENT_NULL) != 0; }

// What of light that arrives at |cos_theta| passes the surface as if there was none.
vec3 bsdf_null_transmittance(Bsdf b, float cos_theta) {
#if HAS_EXACT_FRESNEL
    if (bsdf_is(b, BSDF_THIN_DIELECTRIC)) return thin_dielectric_null_transmittance(b, cos_theta);
#endif
    return vec3(0.0);
}

// Whether bsdf_eval() may be above 0 where wi.z < 0.
bool bsdf_transmits(Bsdf b) {
    bool refracts = bsdf_is(b, BSDF_DIELECTRIC) || bsdf_is(b, BSDF_THIN_DIELECTRIC);
    return HAS_EXACT_FRESNEL == 1 && (refracts || bsdf_is(b, BSDF_TRANSLUCENT));
}

vec3 bsdf_eval(Bsdf b, vec3 wo, vec3 wi) { return bsdf_eval_pdf(b, wo, wi).rgb; }

float bsdf_pdf(Bsdf b, vec3 wo, vec3 wi) { return bsdf_eval_pdf(b, wo, wi).a; }

// What of the `value` of bsdf_eval() is scattered by a diffuse part; towards a direction in which nothing is scattered,
// anything.
vec3 bsdf_diffuse(Bsdf b, vec3 wo, vec3 wi, vec3 value) {
    vec3 diffuse = vec3(0.0);
#if HAS_DIFFUSE
    if (bsdf_is(b, BSDF_DIFFUSE)) diffuse = value;
#endif
#if HAS_COOK_TORRANCE
    if (bsdf_is(b, BSDF_COOK_TORRANCE)) diffuse = cook_torrance_diffuse(b, wo, wi);
#endif
#if HAS_EON
    if (bsdf_is(b, BSDF_EON)) diffuse = value;
#endif
#if HAS_EXACT_FRESNEL
    if (bsdf_is(b, BSDF_PLASTIC)) diffuse = value;  // the coat is a mirror
    if (bsdf_is(b, BSDF_ROUGH_PLASTIC)) diffuse = rough_plastic_diffuse(b, wo, wi);
    if (bsdf_is(b, BSDF_COATED)) diffuse = coated_diffuse(b, wo, wi);
    if (bsdf_is(b, BSDF_SHEEN)) diffuse = sheen_diffuse(b, wo, wi);
    if (bsdf_is(b, BSDF_TRANSLUCENT)) diffuse = translucent_diffuse(b, wo, wi);
#endif
    return diffuse;
}

// u chooses the lobe and the direction within it.
BsdfSample bsdf_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
#if HAS_DIFFUSE
    if (bsdf_is(b, BSDF_DIFFUSE)) s = diffuse_sample(b, wo, u);
#endif
#if HAS_COOK_TORRANCE
    if (bsdf_is(b, BSDF_COOK_TORRANCE)) s = cook_torrance_sample(b, wo, u);
#endif
#if HAS_EON
    if (bsdf_is(b, BSDF_EON)) s = eon_sample(b, wo, u);
#endif
#if HAS_EXACT_FRESNEL
    if (bsdf_is(b, BSDF_DIELECTRIC)) s = dielectric_sample(b, wo, u);
    if (bsdf_is(b, BSDF_THIN_DIELECTRIC)) s = thin_dielectric_sample(b, wo, u);
    if (bsdf_is(b, BSDF_CONDUCTOR)) s = conductor_sample(b, wo, u);
    if (bsdf_is(b, BSDF_PLASTIC)) s = plastic_sample(b, wo, u);
    if (bsdf_is(b, BSDF_ROUGH_PLASTIC)) s = rough_plastic_sample(b, wo, u);
    if (bsdf_is(b, BSDF_COATED)) s = coated_sample(b, wo, u);
    if (bsdf_is(b, BSDF_SHEEN)) s = sheen_sample(b, wo, u);
    if (bsdf_is(b, BSDF_TRANSLUCENT)) s = translucent_sample(b, wo, u);
#endif
    return s;
}
