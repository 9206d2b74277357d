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

// The light as seen from far away: direction in xyz of `towards`, and irradiance at normal incidence. Meshes that emit
// have no one place, and give no light, as in a game engine; the environment is looked up.
vec3 split_sum_light_irradiance(LightChoice choice, vec3 origin, out vec3 towards) {
    LightSample s = light_no_sample();
#if HAS_POINT_LIGHT
    if (choice.kind == LIGHT_POINT) s = point_light_sample(point_light_load(choice.record), origin);
#endif
#if HAS_SPOT_LIGHT
    if (choice.kind == LIGHT_SPOT) s = spot_light_sample(spot_light_load(choice.record), origin);
#endif
#if HAS_DIRECTIONAL_LIGHT
    if (choice.kind == LIGHT_DIRECTIONAL) s = directional_light_sample(directional_light_load(choice.record));
#endif
#if HAS_SUN
    if (choice.kind == LIGHT_SUN) {
        SunLight sun = sun_light_load(choice.record);
        s.wi = sun.direction;
        s.radiance = sun.radiance * (2.0 * PI * sun.one_minus_cos);
    }
#endif
#if HAS_SPHERE_LIGHT
    if (choice.kind == LIGHT_SPHERE) {
        SphereLight sphere = sphere_light_load(choice.record);
        vec3 to_center = sphere.center - origin;
        s.wi = normalize(to_center);
        s.radiance = sphere.radiance * (PI * square(sphere.radius) / dot(to_center, to_center));
    }
#endif
#if HAS_AREA_LIGHT
    if (choice.kind == LIGHT_AREA) {
        AreaLight area = area_light_load(choice.record);
        vec3 to_middle = area.a - origin;
        if (area.kind == KIND_RECTANGLE) to_middle += 0.5 * (area.edge_u + area.edge_v);
        if (area.kind == KIND_SINGLE_TRIANGLE) to_middle += (area.edge_u + area.edge_v) / 3.0;
        s.wi = normalize(to_middle);
        s.radiance = area.radiance * (max(0.0, -dot(s.wi, area.normal)) * area.area / dot(to_middle, to_middle));
    }
#endif
    towards = s.wi;
    return s.radiance;
}

// Cook-Torrance with the k of a lamp, and what Fresnel leaves at the half vector for the base.
vec3 split_sum_light(Vertex vertex, LightChoice choice) {
    vec3 towards;
    vec3 irradiance = split_sum_light_irradiance(choice, vertex.origin, towards);
    vec3 wo = vertex.wo;
    vec3 wi = frame_to_local(vertex.frame, towards);
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
    return reflected * irradiance;
}

vec3 split_sum_lights(Vertex vertex) {
    vec3 radiance = vec3(0.0);
    for (int i = 0; i < u_light_count; i++) radiance += split_sum_light(vertex, light_choice_load(i));
    return radiance;
}
