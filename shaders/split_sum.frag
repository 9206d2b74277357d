// SPDX-License-Identifier: MIT
// The split-sum approximation (Karis 2013, Real Shading in Unreal Engine 4) as a game engine shades with it: what a camera
// ray meets, lit by lookups of the environment, whatever stands in the way, and by the lights as points without shadows;
// and, for the study of its errors, each of the steps from the light that really comes from the environment to it.
// docs/split-sum.md measures what they cost.
#include "camera/camera.glsl"
#include "core/texels.glsl"
#include "film/film.glsl"
#include "sampler/sampler.glsl"
#include "integrator/split_sum.glsl"
#include "integrator/split_sum_study.glsl"

OUTPUT(0) out_mean;
OUTPUT(1) out_variance;
OUTPUT(2) out_half_difference;

uniform int u_rays;
uniform int u_bounces;

// Of the light that comes from all around, by this step.
vec3 split_sum_surrounded(Vertex vertex, float occlusion, ivec2 pixel, uint index) {
#if SPLIT_SUM_STEP >= SPLIT_SUM_LOOKUPS
    return split_sum_environment(vertex, occlusion);
#else
    return split_sum_step(vertex, pixel, index);
#endif
}

// What a surface scatters. A coat and what lies below it are surfaces of their own, of which the light of the lower one
// passes the coat as if all of it came and went at the angle of view: under lights always, under light from all around
// from the step on that has no factor for the direction that light comes from.
vec3 split_sum_scattered(Vertex vertex, float occlusion, ivec2 pixel, uint index) {
#if HAS_EXACT_FRESNEL
    if (bsdf_is(vertex.bsdf, BSDF_COATED)) {
        Vertex base = split_sum_base(vertex), coat = split_sum_coat(vertex);
        float passed = square(coated_transmittance(vertex.bsdf, vertex.wo));
        float weight = vertex.bsdf.coat_weight;
        vec3 lit = passed * split_sum_lights(base) + weight * split_sum_lights(coat);
#if SPLIT_SUM_STEP < SPLIT_SUM_DIFFUSE
        return lit + split_sum_surrounded(vertex, occlusion, pixel, index);
#else
        return lit + passed * split_sum_surrounded(base, occlusion, pixel, index)
            + weight * split_sum_surrounded(coat, occlusion, pixel, index);
#endif
    }
#endif
    return split_sum_surrounded(vertex, occlusion, pixel, index) + split_sum_lights(vertex);
}

// Radiance along a camera ray.
vec3 split_sum_radiance(Ray ray, uint seed, ivec2 pixel, uint index) {
    Hit hit = closest_hit(ray, seed);
    if (hit.primitive == NO_PRIMITIVE) return escaped_radiance(ray.direction, 0, 0.0, true, vec3(1.0));
    Surface surface = surface_at(ray, hit);
    material_choose(surface, seed);
    Material material = material_at(surface);
    vec3 radiance = vec3(0.0);
    bool is_light = surface.light >= 0 && dot(surface.normal, ray.direction) < 0.0;
    if (is_light || material_is_unlit(material)) radiance += material.emission;
    bool is_black = material_is_black(material, dot(surface.normal, ray.direction) < 0.0);
    if (is_black || material_is_unlit(material) || u_bounces == 0) return radiance;
    Vertex vertex = vertex_at(surface, material, ray.direction, hash_uint(~seed));
    return radiance + split_sum_scattered(vertex, material_occlusion(surface), pixel, index);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Film film = film_load(pixel, 0u);
    float unused;
    for (int i = 0; i < u_rays; i++) {
        uint index = film_sampler_index(film);
        vec4 u = sampler_vec4(pixel, index, dimension_camera(), unused);
        film_add(film, split_sum_radiance(camera_ray(pixel, u), hash_pcg4d(floatBitsToUint(u)).x, pixel, index));
    }
    if (traversal_was_cut) film_invalidate(film);
    output_write(out_mean, film_mean(film));
    output_write(out_variance, film_variance(film));
    output_write(out_half_difference, film_half_difference(film));
}
