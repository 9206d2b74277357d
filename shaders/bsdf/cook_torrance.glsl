// SPDX-License-Identifier: MIT
// The material: a Cook-Torrance specular lobe over a Lambert base, on both sides of a surface.
//   specular  D F G / (4 cos_o cos_i), F = Schlick at the half vector (Cook and Torrance 1982)
//   diffuse   albedo / pi (1 - R(cos_o)) (1 - R(cos_i)), light that passes the interface twice, R being
//             what the rough interface reflects at the mean normal (fresnel_schlick_rough)
// The second form is reciprocal and never reflects more than it receives; the common factor
// 1 - F(wo . wh) reflects up to 1.9 times the light at grazing angles (docs/material.md).
// Directions are local and unit with z = normal; wo.z > 0.

struct Bsdf {
    vec3 diffuse;  // albedo of the Lambert base, (1 - metallic) included
    float alpha;   // GGX width; below ALPHA_DELTA the specular lobe is a perfect mirror
    vec3 f0;       // specular reflectance at normal incidence; f0 = 0 and f90 = 0: no specular lobe
    vec3 f90;      // specular reflectance at grazing incidence
};

struct BsdfSample {
    vec3 wi;
    vec3 weight;  // f |cos_i| / pdf
    float pdf;    // 1/sr; 0 means "no sample"; for a delta lobe, the chance of having chosen it
    bool delta;
};

// A wider lobe than this is resolved by float32; a narrower one cannot be told from a mirror.
const float ALPHA_DELTA = 1e-4;

bool bsdf_has_delta(Bsdf b) { return b.alpha < ALPHA_DELTA; }

// What the interface lets through to the base, or back out, at an angle to the normal.
vec3 bsdf_transmittance(Bsdf b, float cos_theta) {
    return 1.0 - fresnel_schlick_rough(b.f0, b.f90, b.alpha, cos_theta);
}

// Probability of choosing the specular lobe: its share of the energy reflected towards wo.
float bsdf_specular_probability(Bsdf b, vec3 wo) {
#if HAS_SPECULAR && HAS_DIFFUSE
    float specular = luminance(1.0 - bsdf_transmittance(b, wo.z));
    float diffuse = luminance(b.diffuse * bsdf_transmittance(b, wo.z) * (1.0 - b.f0));
    float total = specular + diffuse;
    return total > 0.0 ? specular / total : 0.0;
#else
    return float(HAS_SPECULAR);
#endif
}

// f |cos_i| in rgb and the density in a, both without the delta lobe.
vec4 bsdf_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
    vec4 result = vec4(0.0);
    if (wo.z <= 0.0 || wi.z <= 0.0) return result;
    float specular_probability = bsdf_specular_probability(b, wo);
#if HAS_DIFFUSE
    vec3 diffuse = b.diffuse * (wi.z * INVERSE_PI);
#if HAS_SPECULAR
    diffuse *= bsdf_transmittance(b, wo.z) * bsdf_transmittance(b, wi.z);
#endif
    result += vec4(diffuse, (1.0 - specular_probability) * square_to_cosine_hemisphere_pdf(wi));
#endif
#if HAS_GLOSSY
    if (!bsdf_has_delta(b)) {
        vec3 wh = normalize(wo + wi);
        float d = ggx_d(b.alpha, wh) / (4.0 * wo.z);
        vec3 fresnel = fresnel_schlick(b.f0, b.f90, dot(wo, wh));
#if MULTIPLE_SCATTERING
        fresnel *= ggx_compensation(b.f0, b.alpha, wo.z);
#endif
        result += vec4(fresnel * (d * ggx_g(b.alpha, wo, wi)), specular_probability * d * ggx_g1_smith(b.alpha, wo.z));
    }
#endif
    return result;
}

vec3 bsdf_eval(Bsdf b, vec3 wo, vec3 wi) { return bsdf_eval_pdf(b, wo, wi).rgb; }

float bsdf_pdf(Bsdf b, vec3 wo, vec3 wi) { return bsdf_eval_pdf(b, wo, wi).a; }

// u chooses the lobe and the direction within it.
BsdfSample bsdf_sample(Bsdf b, vec3 wo, vec2 u) {
    BsdfSample s = BsdfSample(vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0, false);
    if (wo.z <= 0.0) return s;
    float specular_probability = bsdf_specular_probability(b, wo);
#if HAS_SPECULAR
    bool specular = choose_first(specular_probability, u.x);
#if HAS_DELTA
    if (specular && bsdf_has_delta(b)) {
        vec3 wi = vec3(-wo.xy, wo.z);
        vec3 reflectance = fresnel_schlick(b.f0, b.f90, wo.z) * ggx_g(b.alpha, wo, wi);
        return BsdfSample(wi, reflectance / specular_probability, specular_probability, true);
    }
#endif
#endif
#if HAS_DIFFUSE
    s.wi = square_to_cosine_hemisphere(u);
#endif
#if HAS_GLOSSY
    if (specular) s.wi = reflect(-wo, ggx_sample_vndf(b.alpha, wo, u));
#endif
    vec4 eval_pdf = bsdf_eval_pdf(b, wo, s.wi);
    if (eval_pdf.a > 0.0) {
#if HAS_SPECULAR
        s.weight = eval_pdf.rgb / eval_pdf.a;
#else
        s.weight = b.diffuse;
#endif
        s.pdf = eval_pdf.a;
    }
    return s;
}
