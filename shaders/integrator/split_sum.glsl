// SPDX-License-Identifier: MIT
// The split-sum approximation (Karis 2013, Real Shading in Unreal Engine 4) as a game engine shades with it:
// what a camera ray meets, lit by lookups of the environment, whatever stands in the way, and by the lights as
// points without shadows. docs/split-sum.md measures what it costs.
#if INTEGRATOR == INTEGRATOR_SPLIT_SUM

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

vec3 split_sum_environment(Vertex vertex) {
    vec3 irradiance = maps_irradiance(vertex.frame.normal);
    vec3 mirrored = frame_to_world(vertex.frame, vec3(-vertex.wo.xy, vertex.wo.z));
    vec3 prefiltered = maps_prefiltered(mirrored, sqrt(vertex.bsdf.alpha));
#if HAS_AMBIENT
    irradiance += u_ambient_radiance;
    prefiltered += u_ambient_radiance;
#endif
#if HAS_OCCLUSION_TEXTURE && SPLIT_SUM_STEP == SPLIT_SUM_OCCLUSION_MAP
    irradiance *= vertex.occlusion;
    prefiltered *= vertex.occlusion;
#endif
    return split_sum_shade(vertex, irradiance, prefiltered);
}

#if LIGHT_COUNT
// The light as seen from far away: direction in xyz of `towards`, and irradiance at normal incidence.
vec3 split_sum_light_irradiance(Light light, vec3 origin, out vec3 towards) {
    if (light.kind == LIGHT_SUN) {
        towards = light.position;
        return light.radiance * (2.0 * PI * light.radius);
    }
    vec3 middle = light.position;
    if (light.kind == LIGHT_RECTANGLE) middle += 0.5 * (light.edge_u + light.edge_v);
    if (light.kind == LIGHT_TRIANGLE) middle += (light.edge_u + light.edge_v) / 3.0;
    towards = middle - origin;
    float distance2 = dot(towards, towards);
    towards *= inversesqrt(distance2);
    if (light.kind == LIGHT_POINT) return light.radiance / distance2;
    if (light.kind == LIGHT_SPHERE) return light.radiance * (PI * square(light.radius) / distance2);
    return light.radiance * (max(0.0, -dot(towards, light.normal)) * light.area / distance2);
}

// Cook-Torrance with the k of a lamp, and what Fresnel leaves at the half vector for the base.
vec3 split_sum_light(Vertex vertex, Light light) {
    vec3 towards;
    vec3 irradiance = split_sum_light_irradiance(light, vertex.origin, towards);
    vec3 wo = vertex.wo;
    vec3 wi = frame_to_local(vertex.frame, towards);
    if (wi.z <= 0.0 || wo.z <= 0.0) return vec3(0.0);
    Bsdf b = vertex.bsdf;
    vec3 wh = normalize(wo + wi);
    vec3 fresnel = fresnel_schlick(b.f0, b.f90, dot(wo, wh));
    vec3 reflected = (1.0 - fresnel) * b.diffuse * (INVERSE_PI * wi.z);
    if (!bsdf_has_delta(b)) {
        float k = ggx_k_direct(b.alpha);
        float masking = ggx_g1_schlick(k, wo.z) * ggx_g1_schlick(k, wi.z);
        reflected += fresnel * (ggx_d(b.alpha, wh) * masking / (4.0 * wo.z));
    }
    return reflected * irradiance;
}
#endif

vec3 split_sum_lights(Vertex vertex) {
    vec3 radiance = vec3(0.0);
#if LIGHT_COUNT
    for (int i = 0; i < LIGHT_COUNT; i++) {
        Light light = light_load(i);
        // Meshes that emit have no one place, and give no light, as in a game engine.
        bool is_point = light.kind != LIGHT_ENVIRONMENT && light.kind != LIGHT_MESH;
        if (is_point) radiance += split_sum_light(vertex, light);
    }
#endif
    return radiance;
}

#include "integrator/split_sum_steps.glsl"

// Radiance along the path's first ray.
vec3 split_sum_value(Path path, ivec2 pixel, uint index) {
    Vertex vertex = path_extend(path);
    if (!vertex.scatters) return path.radiance;
#if SPLIT_SUM_STEP >= SPLIT_SUM_LOOKUPS
    path.radiance += split_sum_environment(vertex);
#else
    path.radiance += split_sum_step(vertex, pixel, index);
#endif
    return path.radiance + split_sum_lights(vertex);
}
#endif
