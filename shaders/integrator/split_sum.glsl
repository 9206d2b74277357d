// SPDX-License-Identifier: MIT
// Shading by the split-sum approximation: lookups for the environment, and the lights as points without shadows.
#include "integrator/escape.glsl"
#include "light/maps.glsl"

// How far split_sum.frag goes from direct light to the approximation, one error after the other.
#define SPLIT_SUM_OCCLUDED 1
#define SPLIT_SUM_UNOCCLUDED 2
#define SPLIT_SUM_MASKING 3
#define SPLIT_SUM_DIFFUSE 4
#define SPLIT_SUM_FACTORS 5
#define SPLIT_SUM_NORMAL_VIEW 6
#define SPLIT_SUM_FRESNEL 7
#define SPLIT_SUM_LOOKUPS 8
#define SPLIT_SUM_OCCLUSION_MAP 9
#ifndef SPLIT_SUM_STEP
#define SPLIT_SUM_STEP SPLIT_SUM_OCCLUSION_MAP
#endif

// Fresnel of a rough surface for light from all around (Lagarde 2011).
vec3 split_sum_fresnel(Bsdf b, float cos_theta) {
    return fresnel_schlick(b.f0, max((1.0 - sqrt(b.alpha)) * b.f90, b.f0), cos_theta);
}

// Of the environment; the irradiance is over pi.
vec3 split_sum_shade(Vertex vertex, vec3 irradiance, vec3 prefiltered) {
    Bsdf b = vertex.bsdf;
    vec3 fresnel = split_sum_fresnel(b, vertex.wo.z);
    vec3 map = maps_brdf(vertex.wo.z, sqrt(b.alpha));
    return (1.0 - fresnel) * b.diffuse * irradiance + (fresnel * map.x + b.f90 * map.y) * prefiltered;
}

// `occlusion` is what an occlusion map leaves of it.
vec3 split_sum_environment(Vertex vertex, float occlusion) {
    vec3 irradiance = maps_irradiance(vertex.frame.normal);
    vec3 mirrored = frame_to_world(vertex.frame, vec3(-vertex.wo.xy, vertex.wo.z));
    vec3 prefiltered = maps_prefiltered(mirrored, sqrt(vertex.bsdf.alpha));
    irradiance += u_ambient_radiance;
    prefiltered += u_ambient_radiance;
#if SPLIT_SUM_STEP == SPLIT_SUM_OCCLUSION_MAP
    irradiance *= occlusion;
    prefiltered *= occlusion;
#endif
    return split_sum_shade(vertex, irradiance, prefiltered);
}

// Cook-Torrance with the k of a lamp, and what Fresnel leaves at the half vector for the base.
vec3 split_sum_light(Vertex vertex, LightChoice choice) {
    LightSample light = light_punctual(choice, vertex.origin);
    vec3 wo = vertex.wo;
    vec3 wi = frame_to_local(vertex.frame, light.wi);
    if (wi.z <= 0.0 || wo.z <= 0.0) return vec3(0.0);
    Bsdf b = vertex.bsdf;
    vec3 wh = normalize(wo + wi);
    vec3 fresnel = fresnel_schlick(b.f0, b.f90, dot(wo, wh));
    vec3 reflected = (1.0 - fresnel) * b.diffuse * (INVERSE_PI * wi.z);
    if (!cook_torrance_is_mirror(b)) {
        float k = ggx_k_direct(b.alpha);
        float masking = ggx_g1_schlick(k, wo.z) * ggx_g1_schlick(k, wi.z);
        reflected += fresnel * (ggx_d(b.alpha, wh) * masking / (4.0 * wo.z));
    }
    return reflected * light.radiance;
}

#if HAS_EXACT_FRESNEL
// The coat of a vertex, as a surface of its own.
Vertex split_sum_coat(Vertex vertex) {
    Bsdf b = vertex.bsdf;
    vertex.bsdf = bsdf_of(BSDF_COOK_TORRANCE, vec3(0.0), b.coat_alpha, vec3(b.coat_f0), vec3(coated_f90(b)));
    return vertex;
}

// And what lies below.
Vertex split_sum_base(Vertex vertex) {
    Frame base = coated_base_frame(vertex.bsdf);
    vec3 normal = frame_to_world(vertex.frame, base.normal), tangent = frame_to_world(vertex.frame, base.tangent);
    vertex.frame = Frame(tangent, cross(normal, tangent), normal);
    vertex.wo = frame_to_local(base, vertex.wo);
    vertex.bsdf.model = BSDF_COOK_TORRANCE;
    return vertex;
}
#endif

vec3 split_sum_lights(Vertex vertex) {
    vec3 radiance = vec3(0.0);
    for (int i = 0; i < u_light_count; i++) radiance += split_sum_light(vertex, light_choice_load(i));
    return radiance;
}
