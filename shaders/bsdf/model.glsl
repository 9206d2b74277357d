// SPDX-License-Identifier: MIT
// What all models of bsdf.glsl share: the parameters at a point, and the result of sampling.

struct Bsdf {
    int model;     // BSDF_... of bsdf.glsl, which says which of the parameters count
    vec3 diffuse;  // albedo of the diffuse part, (1 - metallic) included
    float alpha;   // roughness squared, the GGX width
    vec3 f0;       // specular reflectance at normal incidence; f0 = 0 and f90 = 0: no specular lobe
    vec3 f90;      // specular reflectance at grazing incidence
    float anisotropy;    // of facets: along the tangent their width is mix(alpha, 1, anisotropy^2)
    int half_vector;     // 1: the diffuse part has the factor 1 - F at the half vector
    float eta;     // of dielectrics and plastic: index of refraction beyond the surface over that on the side of wo
    vec3 transmittance;  // of dielectrics: colour of what passes
    vec3 index;          // of conductors: index of refraction
    vec3 extinction;     // of conductors: k, the imaginary part of the index
    vec4 coat_facets;    // of rough plastic: what its coat passes, as coefficients of rough_plastic_interface()
    vec3 coat_angles;
    float coat_weight;   // of a clear coat
    float coat_alpha;    // its GGX width
    float coat_f0;       // its reflectance at normal incidence
    vec3 base_normal;    // of what lies below a clear coat, local: normal maps bend the two apart
    vec3 base_tangent;   // perpendicular to it
    vec3 geometric;      // unit normal of the surface itself on the side of wo, local; of a clear coat
    vec3 sheen_color;    // of cloth, over the base; black: there is none
    float sheen_roughness;
    float iridescence;   // weight of a thin film on the facets; 0: there is none
    float iridescence_ior;        // its index of refraction
    float iridescence_thickness;  // nm
    vec3 transmitted;    // albedo of what a translucent base transmits diffusely
};

// One without parameters of dielectrics, conductors, plastic, coats, sheen, films and translucency.
Bsdf bsdf_of(int model, vec3 diffuse, float alpha, vec3 f0, vec3 f90) {
    return Bsdf(
        model, diffuse, alpha, f0, f90, 0.0, 0, 1.0, vec3(1.0), vec3(1.0), vec3(0.0), vec4(0.0), vec3(0.0), 0.0, 1.0, 0.0,
        vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), vec3(0.0), 1.0, 0.0, 1.0, 0.0, vec3(0.0));
}

// What happened at a sampled event: one of the first two, whether the lobe is a delta, and whether the direction is that
// of the path before, which is no scattering.
const int EVENT_REFLECTION = 1;
const int EVENT_TRANSMISSION = 2;
const int EVENT_DELTA = 4;
const int EVENT_NULL = 8;

struct BsdfSample {
    vec3 wi;
    vec3 weight;  // f |cos_i| / pdf
    float pdf;    // 1/sr; 0 means "no sample"; of a delta lobe, the probability of having chosen it
    float eta;    // index of refraction on the side of wi over that on the side of wo; 1 for a reflection
    int event;
};

BsdfSample bsdf_no_sample() { return BsdfSample(vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0, 1.0, EVENT_REFLECTION); }

bool bsdf_is_delta(BsdfSample s) { return (s.event & EVENT_DELTA) != 0; }

// Weight and density of a direction by f |cos_i| in rgb and the density in a; not of a delta. Of opposite directions along
// the horizon, whose half vector is none, the density is no number, and there is no sample.
void bsdf_weigh(inout BsdfSample s, vec4 eval_pdf) {
    bool is_drawn = eval_pdf.a > 0.0;
    s.pdf = is_drawn ? eval_pdf.a : 0.0;
    s.weight = is_drawn ? eval_pdf.rgb / eval_pdf.a : vec3(0.0);
}
