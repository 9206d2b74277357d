// SPDX-License-Identifier: MIT
// What a camera ray meets first, as numbers instead of light, gathered in a film like light: for the eyes of a person
// who looks for a mistake in a scene. No light transport.
#include "camera/camera.glsl"
#include "core/texels.glsl"
#include "film/film.glsl"
#include "material/visibility.glsl"
#include "sampler/sampler.glsl"

#define AUXILIARY_NORMALS 0
#define AUXILIARY_DEPTH 1
#define AUXILIARY_ALBEDO 2
#ifndef AUXILIARY
#define AUXILIARY AUXILIARY_NORMALS
#endif

OUTPUT(0) out_mean;
OUTPUT(1) out_variance;
OUTPUT(2) out_half_difference;

uniform int u_rays;

vec3 auxiliary_value(Ray ray, uint seed) {
    Hit hit = closest_hit(ray, seed);
    if (hit.primitive == NO_PRIMITIVE) return vec3(0.0);
    Surface surface = surface_at(ray, hit);
    material_choose(surface, seed);
    Material material = material_at(surface);
#if AUXILIARY == AUXILIARY_NORMALS
    return 0.5 + 0.5 * surface.mapped_normal;
#elif AUXILIARY == AUXILIARY_DEPTH
    return vec3(hit.distance);
#else
    if (material_is_unlit(material)) return material.emission;
    bool is_black = material_is_black(material, dot(surface.normal, ray.direction) < 0.0);
    return is_black ? vec3(0.0) : material.diffuse + material.f0;
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Film film = film_load(pixel, 0u);
    float unused;
    for (int i = 0; i < u_rays; i++) {
        uint index = film_sampler_index(film);
        vec4 u = sampler_vec4(pixel, index, dimension_camera(), unused);
        film_add(film, auxiliary_value(camera_ray(pixel, u), hash_pcg4d(floatBitsToUint(u)).x));
    }
    if (traversal_was_cut) film_invalidate(film);
    output_write(out_mean, film_mean(film));
    output_write(out_variance, film_variance(film));
    output_write(out_half_difference, film_half_difference(film));
}
