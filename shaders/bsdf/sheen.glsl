// SPDX-License-Identifier: MIT
// The sheen of cloth over Cook-Torrance: facets whose normals gather about the horizon, as those of fibres that stand
// upright (Estevez and Kulla 2017, Production Friendly Microfacet Sheen BRDF; Khronos Group 2020, KHR_materials_sheen).
//   sheen  color D V / max(1, e)
//   base   as without sheen, times 1 - m min(1, e), where m is the greatest component of color
// e is the larger of E(cos_o) and E(cos_i), E being what D V reflects of light from all around. That is more than 1 at
// grazing angles of a roughness below 0.25; so the two are divided by it there, which is reciprocal and gains no energy.
#include "bsdf/cook_torrance.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/model.glsl"
#include "core/math.glsl"
#include "core/warp.glsl"

uniform int u_without_sheen;  // 1: no material has any, which then needs no code

// What is less counts as these: the exponent of D, 1 / alpha, would lose the digits of a float32, and V has no bound at the
// horizon. E is fitted from these up.
const float SHEEN_LEAST_ROUGHNESS = 0.1;
const float SHEEN_LEAST_COSINE = 0.001;

bool sheen_is_there(Bsdf b) {
    return HAS_EXACT_FRESNEL == 1 && u_without_sheen == 0 && max_component(b.sheen_color) > 0.0;
}

// The density of facets D in 1/sr, an exponentiated sine, which they call "Charlie".
float sheen_d(float alpha, vec3 wh) {
    return (2.0 + 1.0 / alpha) * (0.5 * INVERSE_PI) * pow(min(1.0, dot(wh.xy, wh.xy)), 0.5 / alpha);
}

// Their fit of the logarithm of Lambda, for cosines up to 1/2.
vec2 sheen_log_lambda(float alpha, vec2 x) {
    float t = square(1.0 - alpha);
    float a = mix(21.5473, 25.3245, t), b = mix(3.82987, 3.32435, t), c = mix(0.19823, 0.16801, t);
    float d = mix(-1.97760, -1.27393, t), e = mix(-4.32054, -4.85967, t);
    return a / (1.0 + b * pow(x, vec2(c))) + d * x + e;
}

// Lambda of two directions by their cosines; 1 / (1 + Lambda + Lambda) is masking and shadowing.
vec2 sheen_lambda(float alpha, vec2 cosines) {
    vec2 low = sheen_log_lambda(alpha, min(cosines, 1.0 - cosines));
    return exp(mix(2.0 * sheen_log_lambda(alpha, vec2(0.5)) - low, low, lessThan(cosines, vec2(0.5))));
}

// E at two cosines with their Lambda, by a fit of our own: nowhere less than the integral, and at most 0.0073 max(1, E)
// more (docs/material.md).
vec2 sheen_albedo(float roughness, vec2 cosines, vec2 lambda) {
    vec4 r = vec4(1.0, log(roughness), roughness, 1.0 / roughness);
    vec2 s = sqrt(cosines);
    vec2 x = s * dot(r, vec4(3.3552, 15.1436, -7.1205, 2.3312)) + dot(r, vec4(1.8672, -16.8722, 4.0374, -3.5829));
    x = x * s + dot(r, vec4(-3.5838, 4.8836, 1.4523, 0.3529));
    x = x * s + dot(r, vec4(0.9044, 0.0743, -1.1209, -0.2244));
    x = x * s + dot(r, vec4(0.1183, -1.1427, 0.8352, -0.002));
    return exp(x) / (4.0 * cosines * (1.0 + lambda));
}

// Of sheen that is there: D V cos_i / max(1, e), and the factor of the base.
vec2 sheen_and_base(Bsdf b, vec3 wo, vec3 wi) {
    float alpha = square(b.sheen_roughness);
    vec2 cosines = clamp(vec2(wo.z, wi.z), SHEEN_LEAST_COSINE, 1.0);
    vec2 lambda = sheen_lambda(alpha, cosines);
    vec2 albedo = sheen_albedo(b.sheen_roughness, cosines, lambda);
    float most = max(albedo.x, albedo.y);
    float masked = 1.0 / ((1.0 + lambda.x + lambda.y) * 4.0 * cosines.x * cosines.y);
    float value = sheen_d(alpha, normalize(wo + wi)) * masked * wi.z / max(1.0, most);
    return vec2(value, 1.0 - max_component(b.sheen_color) * min(1.0, most));
}

// About what white sheen reflects towards wo, of light from all around.
float sheen_reflectance(Bsdf b, vec3 wo) {
    vec2 cosines = vec2(clamp(wo.z, SHEEN_LEAST_COSINE, 1.0));
    return min(1.0, sheen_albedo(b.sheen_roughness, cosines, sheen_lambda(square(b.sheen_roughness), cosines)).x);
}

// About what the specular lobe reflects, and what the diffuse base and the sheen do.
vec2 sheen_reflected(Bsdf b, vec3 wo) {
    vec2 base = cook_torrance_reflected(b, wo);
    if (!sheen_is_there(b)) return base;
    float sheen = sheen_reflectance(b, wo);
    return (1.0 - max_component(b.sheen_color) * sheen) * base + vec2(0.0, luminance(b.sheen_color) * sheen);
}

// Probability of choosing the sheen: its share of the energy reflected towards wo.
float sheen_probability(Bsdf b, vec3 wo) {
    vec2 reflected = sheen_reflected(b, wo);
    return luminance(b.sheen_color) * sheen_reflectance(b, wo) / max(reflected.x + reflected.y, 1e-30);
}

// f |cos_i| in rgb and the density in a, both without the delta lobe.
vec4 sheen_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    vec4 base = cook_torrance_eval_pdf(b, wo, wi);
    if (!sheen_is_there(b) || wo.z <= 0.0 || wi.z <= 0.0) return base;
    vec2 factors = sheen_and_base(b, wo, wi);
    float pdf = mix(base.a, square_to_uniform_cone_pdf(1.0), sheen_probability(b, wo));
    return vec4(factors.x * b.sheen_color + factors.y * base.rgb, pdf);
}

// What is diffuse: the sheen, and what the base scatters diffusely.
vec3 sheen_diffuse(Bsdf b, vec3 wo, vec3 wi) {
    vec3 base = cook_torrance_diffuse(b, wo, wi);
    if (!sheen_is_there(b)) return base;
    vec2 factors = sheen_and_base(b, wo, wi);
    return factors.x * b.sheen_color + factors.y * base;
}

// The lobe of the sheen is sampled uniformly: by the cosine, weights vary more at every angle and roughness.
BsdfSample sheen_sample(Bsdf b, vec3 wo, vec2 u) {
    if (!sheen_is_there(b) || wo.z <= 0.0) return cook_torrance_sample(b, wo, u);
    float probability = sheen_probability(b, wo);
    BsdfSample s = bsdf_no_sample();
    if (choose_first(probability, u.x)) {
        s.wi = square_to_uniform_cone(u, 1.0);
    } else {
        s = cook_torrance_sample(b, wo, u);
        if (s.pdf <= 0.0) return s;
        if (bsdf_is_delta(s)) {
            s.weight *= sheen_and_base(b, wo, s.wi).y / (1.0 - probability);
            s.pdf *= 1.0 - probability;
            return s;
        }
    }
    bsdf_weigh(s, sheen_eval_pdf(b, wo, s.wi));
    return s;
}
