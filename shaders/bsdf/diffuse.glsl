// SPDX-License-Identifier: MIT
// Lambert's ideal diffuse reflection, albedo / pi.
#include "bsdf/model.glsl"
#include "core/constants.glsl"
#include "core/warp.glsl"

#ifndef HAS_DIFFUSE
#define HAS_DIFFUSE 1
#endif

vec4 diffuse_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0 || wi.z <= 0.0) return vec4(0.0);
    return vec4(b.diffuse * (wi.z * INVERSE_PI), square_to_cosine_hemisphere_pdf(wi));
}

BsdfSample diffuse_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = bsdf_no_sample();
    if (wo.z <= 0.0) return s;
    s.wi = square_to_cosine_hemisphere(u);
    s.pdf = square_to_cosine_hemisphere_pdf(s.wi);
    if (s.pdf > 0.0) s.weight = b.diffuse;
    return s;
}
