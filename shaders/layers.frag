// SPDX-License-Identifier: MIT
// What a compositor or a denoiser asks of the surface that a camera ray meets first: numbers in place of light, in the mean
// over the same places in the pixel, and on the lens, as the samples of the picture. For a denoiser, of the surface met first
// after smooth ones. The film holds the albedo; of mattes it holds nothing, and counts.
#include "bsdf/fresnel.glsl"
#include "camera/camera.glsl"
#include "core/texels.glsl"
#include "film/film.glsl"
#include "film/layers.glsl"
#include "material/visibility.glsl"
#include "sampler/sampler.glsl"

#define LAYERS_GEOMETRY 0
#define LAYERS_OBJECTS 1
#define LAYERS_MATERIALS 2
#define LAYERS_DENOISING 3
#ifndef LAYERS
#define LAYERS LAYERS_GEOMETRY
#endif

#include "integrator/interior.glsl"
#if LAYERS == LAYERS_DENOISING
#include "integrator/escape.glsl"

uniform int u_bounces;
uniform int u_russian_roulette_vertex;
#endif

OUTPUT(0) out_mean;
OUTPUT(1) out_variance;
OUTPUT(2) out_half_difference;
OUTPUT(3) out_layer_0;
OUTPUT(4) out_layer_1;
OUTPUT(5) out_layer_2;

uniform int u_rays;

#if LAYERS == LAYERS_GEOMETRY || LAYERS == LAYERS_DENOISING
// What the surface reflects and lets through of white light from straight above.
vec3 layers_albedo(Surface surface, Material material, bool is_front) {
    if (material_is_unlit(material)) return material.emission;
    if (material_is_black(material, is_front)) return vec3(0.0);
#if HAS_EXACT_FRESNEL
    Bsdf b = material_bsdf(material, is_front);
    vec3 base = material.diffuse + material.f0;
    if (u_without_iridescence == 0) {
        material_set_iridescence(b, surface);
        base += (iridescence_f0(b) - b.f0) * (1.0 - material.diffuse);
    }
    if (bsdf_is(b, BSDF_TRANSLUCENT)) {
        material_set_translucency(b, surface, translucency_load(material.record));
        base = b.diffuse + b.transmitted + b.f0;
    }
    if (u_without_sheen == 0) {
        material_set_sheen(b, surface);
        float sheen = sheen_reflectance(b, vec3(0.0, 0.0, 1.0));
        base = (1.0 - max_component(b.sheen_color) * sheen) * base + sheen * b.sheen_color;
    }
    if (bsdf_is(b, BSDF_COATED)) {
        material_set_coat(b, surface, clear_coat_load(material.record));
        float reflected = b.coat_weight * b.coat_f0;
        return square(1.0 - reflected) * base + reflected;
    }
    if (b.model == BSDF_DIELECTRIC || b.model == BSDF_THIN_DIELECTRIC) return b.transmittance;
    if (b.model == BSDF_CONDUCTOR) return fresnel_conductor(1.0, b.index, b.extinction);
    return base;
#else
    return material.diffuse + material.f0;
#endif
}

#endif

const int MOST_FOLLOWED = 16;  // surfaces that are passed, one after the other

#if LAYERS != LAYERS_DENOISING
// What a ray of a path that has this `seed` meets first, past the boundaries of media, at the last of which the ray begins
// then; the seed becomes that of the vertex there.
Hit layers_hit(inout Ray ray, inout uint seed) {
    uint path_seed = seed;
    Hit hit;
    int number = 0;
    bool goes_on;
    do {
        seed = hash_uint(path_seed + uint(number));
        hit = closest_hit(ray, seed);
        goes_on = false;
        if (u_has_null != 0 && hit.primitive != NO_PRIMITIVE) {
            Surface surface = surface_at(ray, hit);
            material_choose(surface, seed);
            goes_on = interior_bounds_medium(material_load(surface.material)) && number < MOST_FOLLOWED;
            vec3 behind = dot(surface.normal, ray.direction) < 0.0 ? -surface.normal : surface.normal;
            if (goes_on) ray.origin = ray_offset_origin(surface.position, ray.direction + behind, surface.extent);
        }
        number++;
    } while (goes_on);
    return hit;
}
#endif

#if LAYERS == LAYERS_GEOMETRY
uniform mat4 u_to_pixel;  // from homogeneous points to pixels, row 0 at the bottom
uniform mat4 u_to_previous_pixel;

vec4 layers[3];  // normal and how many rays have met something; position and depth in the mean of those; motion

// In pixels, from this picture to the previous one; 0 where that has it behind the camera.
vec2 layers_motion(vec4 point) {
    vec4 now = u_to_pixel * point;
    vec4 before = u_to_previous_pixel * point;
    return now.w > 0.0 && before.w > 0.0 ? before.xy / before.w - now.xy / now.w : vec2(0.0);
}

void layers_add(inout Film film, ivec2 pixel, uint index, Ray ray, uint seed) {
    Hit hit = layers_hit(ray, seed);
    bool is_hit = hit.primitive != NO_PRIMITIVE;
    Surface surface = surface_at(ray, hit);
    material_choose(surface, seed);
    bool is_front = dot(surface.normal, ray.direction) < 0.0;
    Material material = material_at(surface);
    film_add(film, is_hit ? layers_albedo(surface, material, is_front) : vec3(0.0));
    float share = 1.0 / film.count;
    layers[0].xyz += ((is_hit ? surface.mapped_normal : vec3(0.0)) - layers[0].xyz) * share;
    vec4 point = is_hit ? vec4(surface.position, 1.0) : vec4(ray.direction, 0.0);
    layers[2].xy += (layers_motion(point) - layers[2].xy) * share;
    if (!is_hit) return;
    layers[0].a += 1.0;
    float depth = -dot(surface.position - u_inverse_view[3].xyz, u_inverse_view[2].xyz);
    layers[1] += (vec4(surface.position, depth) - layers[1]) / layers[0].a;
}
#elif LAYERS == LAYERS_DENOISING
vec4 layers[3];  // normal; light

// Of the surface that is met first after smooth ones, which are followed as paths follow them (integrator/path.glsl, with
// the same random numbers): albedo, times what is left on the way, and normal; and the light emitted on that way.
void layers_add(inout Film film, ivec2 pixel, uint index, Ray ray, uint seed) {
    vec3 albedo = vec3(0.0);
    vec3 normal = vec3(0.0);
    vec3 light = vec3(0.0);
    vec3 throughput = vec3(1.0);
    float eta_scale = 1.0;
    ivec4 inside = u_camera_interiors;
    int band = BAND_NONE;
    int depth = 0;
    int number = 0;
    bool goes_on;
    do {
        uint vertex_seed = hash_uint(seed + uint(number));
        Hit hit = closest_hit(ray, vertex_seed);
        bool is_hit = hit.primitive != NO_PRIMITIVE;
        Surface surface = surface_at(ray, hit);
        material_choose(surface, vertex_seed);
        Material material = material_at(surface);
        float cos_theta = -dot(surface.normal, ray.direction);
        bool is_unlit = is_hit && material_is_unlit(material);
#if HAS_MEDIA
        bool is_certain = false;
#else
        throughput *= interior_transmittance(inside, hit.distance);
        bool is_certain = depth <= min(u_bounces, u_russian_roulette_vertex - 1);
#endif
        if (is_certain && !is_hit) light += throughput * escaped_radiance(ray.direction, depth, 0.0, true, vec3(1.0));
        if (is_certain && is_hit && surface.light >= 0 && cos_theta > 0.0) light += throughput * material.emission;
        if (is_certain && is_unlit) light += throughput * material.emission;
        float rr_sample;
        vec4 u = sampler_vec4(pixel, index, dimension_vertex(number), rr_sample);
        Vertex vertex = vertex_at(surface, material, ray.direction, 0u);
        if (is_hit) {
            int next_band = interior_band(material, band, hash_to_unit(hash_uint(seed ^ 0x68bc21ebu)));
            throughput *= interior_band_color(band, next_band);
            band = next_band;
            interior_set_vertex(vertex, material, cos_theta >= 0.0, inside, band);
        }
        BsdfSample s = bsdf_sample(vertex.bsdf, vertex.wo, u.xy);
        number++;
        goes_on = is_hit && !is_unlit && bsdf_is_delta(s) && s.pdf > 0.0 && number < MOST_FOLLOWED
            && (depth < u_bounces || interior_may_pass(material));
        if (is_hit && !goes_on) {
            albedo = throughput * eta_scale * layers_albedo(surface, material, cos_theta > 0.0);
            normal = surface.mapped_normal;
        }
        throughput *= s.weight * vertex_shading_factor(vertex, s.wi);
        eta_scale *= square(s.eta);
        ray = Ray(vertex_origin(vertex, s.wi), frame_to_world(vertex.frame, s.wi));
        inside = interior_behind_vertex(vertex, s.wi);
        depth += bsdf_is_null(s) ? 0 : 1;
    } while (goes_on);
    film_add(film, albedo);
    layers[0].xyz += (normal - layers[0].xyz) / film.count;
    layers[1].rgb += (light - layers[1].rgb) / film.count;
}
#else
vec4 layers[3];  // six ranks, two a texture: the number of an object or a material, from 1 on, and how many rays have met it

// Numbers that find no rank any more are left out.
void layers_count(float number) {
    bool is_counted = false;
    for (int i = 0; i < 3; i++) {
        if (!is_counted && (layers[i].x == number || layers[i].y == 0.0)) {
            layers[i].xy = vec2(number, layers[i].y + 1.0);
            is_counted = true;
        }
        if (!is_counted && (layers[i].z == number || layers[i].w == 0.0)) {
            layers[i].zw = vec2(number, layers[i].w + 1.0);
            is_counted = true;
        }
    }
}

void layers_add(inout Film film, ivec2 pixel, uint index, Ray ray, uint seed) {
    Hit hit = layers_hit(ray, seed);
    film_add(film, vec3(0.0));
    if (hit.primitive == NO_PRIMITIVE) return;
#if LAYERS == LAYERS_OBJECTS
    int record = hit.instance >= 0 ? hit.instance : hit.primitive;
    layers_count(float(1 + shape_object(shape_texel(record, 0).w)));
#else
    layers_count(float(1 + surface_at(ray, hit).material));
#endif
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Film film = film_load(pixel, 0u);
    for (int i = 0; i < 3; i++) layers[i] = layers_load(pixel, i);
    float unused;
    for (int i = 0; i < u_rays; i++) {
        uint index = film_sampler_index(film);
        vec4 u = sampler_vec4(pixel, index, dimension_camera(), unused);
        // The hash of the path's first vertex, so that stochastic alpha and blends decide as in the picture.
        layers_add(film, pixel, index, camera_ray(pixel, u), hash_pcg4d(floatBitsToUint(u)).x);
    }
    if (traversal_was_cut) film_invalidate(film);
    output_write(out_mean, film_mean(film));
    output_write(out_variance, film_variance(film));
    output_write(out_half_difference, film_half_difference(film));
    output_write(out_layer_0, layers[0]);
    output_write(out_layer_1, layers[1]);
    output_write(out_layer_2, layers[2]);
}
