// SPDX-License-Identifier: MIT
// Unidirectional path tracing with next-event estimation and multiple importance sampling (Veach 1997, chapters 9 and
// 10). The loop makes one vertex a turn, whatever its path: where one has ended, the pixel's next begins at once (Novák
// et al. 2010, Path Regeneration for Interactive Path Tracing).
//
// bounces counts scattering events: 0 is emission seen directly, 1 adds direct light.
#include "camera/camera.glsl"
#include "film/film.glsl"
#include "film/parts.glsl"
#include "guiding/measure.glsl"
#include "integrator/direct.glsl"
#include "integrator/escape.glsl"
#include "integrator/interior.glsl"
#include "integrator/vertex.glsl"
#include "sampler/sampler.glsl"

uniform int u_bounces;
uniform int u_russian_roulette_vertex;  // the first vertex at which a path may be ended early
uniform int u_is_open;                  // 1: many rays escape; decides over speed alone

struct Path {
    Ray ray;
    vec3 throughput;  // product of the BSDF weights so far
    float eta_scale;  // product of eta^2 of its refractions, which compensates their factors 1 / eta^2 in it
    vec3 radiance;    // the sum of what the path has met
    int depth;        // scattering events so far
    int passed;       // vertices that were none: surfaces passed unchanged
    float pdf;        // 1/sr, of the ray's direction by BSDF sampling
    bool certain;     // the ray could only have come this way: from the camera or a delta lobe
    bool has_ended;   // and is no sample yet
    float rr_sample;  // uniform number that decides whether the path survives its next vertex
    uint seed;        // of stochastic alpha and of blends, another for each path
    ivec4 inside;     // the dielectrics that the ray is in (integrator/interior.glsl)
    int band;         // the colour that dispersion has left of it, or BAND_NONE
#if HAS_MEDIA || HAS_EXACT_FRESNEL
    vec3 start;       // where light was scattered last, before boundaries of media or panes were passed
    float way;        // distance from there to the origin of the ray
#endif
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
    LightTraced traced;  // what of its light is left to light tracing
#endif
    Moments moments;  // what guiding is worth, where that is measured
#if FILM_LIGHT == FILM_LIGHT_PARTS
    Parts parts;       // of the radiance
    vec3 diffuse;      // what of the BSDF was its diffuse part, towards the ray that left the first vertex
#endif
};

Path path_begin(ivec2 pixel, vec4 u) {
    Ray ray = camera_ray(pixel, u);
    return Path(ray, vec3(1.0), 1.0, vec3(0.0), 0, 0, 0.0, true, false, 0.0, hash_pcg4d(floatBitsToUint(u)).x, u_camera_interiors, BAND_NONE
#if HAS_MEDIA || HAS_EXACT_FRESNEL
        , ray.origin, 0.0
#endif
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
        , light_traced_begin()
#endif
        , moments_begin()
#if FILM_LIGHT == FILM_LIGHT_PARTS
        , parts_begin(), vec3(0.0)
#endif
    );
}

// Adds what the ray has met.
void path_receive(inout Path path, vec3 radiance) {
    path.radiance += radiance;
#if FILM_LIGHT == FILM_LIGHT_PARTS
    parts_receive(path.parts, path.depth, radiance, radiance * path.diffuse);
#endif
}

// What the path tracer counts of the light of lights that the path meets.
vec3 path_rest(Path path) {
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
    return light_traced_rest(path.traced);
#else
    return vec3(1.0);
#endif
}

// Whether guiding finds light of the path that light tracing does not.
bool path_is_guided(Path path) {
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
    return path.depth > 0 && max_component(path.traced.received + path.traced.mirrored) < 0.5;
#else
    return true;
#endif
}

// What a path sees whose ray escapes.
vec3 path_escaped_radiance(Path path) {
    return path.throughput * escaped_radiance(path.ray.direction, path.depth, path.pdf, path.certain, path_rest(path));
}

// Adds a path that `ends`: it is a sample.
void path_end_if(bool ends, Path path, inout Film film) {
    film_add_if(ends, film, moments_of_path(path.moments, path.radiance));
#if FILM_LIGHT == FILM_LIGHT_PARTS
    if (ends && is_finite(path.radiance)) parts_add(path.parts, 1.0 / film.count);
#endif
}

// Adds `count` samples of the pixel to its film, with the random numbers of one that may be another.
void path_trace(inout Film film, ivec2 pixel, ivec2 numbers, int count) {
    uint end = film.next + uint(count);
    uint index = film_sampler_index(film);
    // Also after the last bounce, where surfaces that pass light unchanged do so without end.
    bool has_roulette = u_russian_roulette_vertex < u_bounces + HAS_EXACT_FRESNEL;
    bool is_open = u_is_open != 0 && HAS_MEDIA == 0;
    float rr_sample;
    Path path = path_begin(pixel, sampler_vec4(numbers, index, dimension_camera(), rr_sample));
    // The loop tests at its end: a software renderer runs a body once more than a leading test lets pass. And it computes
    // surface, vertex, light sample and next direction of every lane, those whose path ends too, which do not use them:
    // their branch would be run all the same, and every assignment in it be masked.
    do {
        // On to the next surface, in an open scene by way of new paths where rays escape. Where there are media, the light
        // that an escaped ray sees is added below: one of them may scatter the path before.
        Hit hit;
        int vertex_number;
        uint seed;
        bool begins;  // whether the path had ended, and is another one now
        do {
            vertex_number = path.depth + path.passed;
            seed = hash_uint(path.seed + uint(vertex_number));
            hit = closest_hit(path.ray, seed);
            begins = false;
#if !HAS_MEDIA
            path.throughput *= interior_transmittance(path.inside, hit.distance);
            bool escapes = hit.primitive == NO_PRIMITIVE;
            if (escapes && !path.has_ended) path_receive(path, path_escaped_radiance(path));
            if (is_open) {
                begins = escapes || path.has_ended;
                path_end_if(begins, path, film);
                index = film_sampler_index(film);
                vec4 u = sampler_vec4(numbers, index, dimension_camera(), rr_sample);
                if (begins) path = path_begin(pixel, u);
            }
#endif
        } while (begins && film.next < end);
        bool is_hit = hit.primitive != NO_PRIMITIVE && !begins;
        Surface surface = surface_at(path.ray, hit);
        material_choose(surface, seed);
        Material material = material_at(surface);
#if HAS_MEDIA
        // Or a point of the medium before that; not so near to the surface that rounding puts it beyond.
        float unused;
        vec4 u_flight = sampler_vec4(numbers, index, dimension_medium(vertex_number), unused);
        Medium medium = medium_load(interior_of(path.inside));
        MediumSample flight = medium_sample(medium, path.ray, hit.distance, path.throughput, u_flight.xy);
        vec2 u_lit = u_flight.zw;
        MediumSample lit = direct_flight(medium, path.ray, hit.distance, path.throughput, flight, u_lit);
        float farthest = is_hit ? max(0.0, hit.distance - RAY_OFFSET * surface.extent) : hit.distance;
        flight.distance = min(flight.distance, farthest);
        lit.distance = min(lit.distance, farthest);
        vec3 lit_throughput = path.throughput * lit.weight;
        path.throughput *= flight.weight;
        bool escapes = !is_hit && !flight.scatters;
        if (escapes) path_receive(path, path_escaped_radiance(path));
        is_hit = is_hit && !flight.scatters;
#endif
#if HAS_MEDIA || HAS_EXACT_FRESNEL
        vec3 start = path.start;
        float way = path.way + hit.distance;
#else
        vec3 start = path.ray.origin;
        float way = hit.distance;
#endif

        // Emission of the surface. Lights emit from their front alone, weighed against the sample of them at the vertex
        // before.
        float cos_theta = -dot(surface.normal, path.ray.direction);
        if (is_hit && u_light_count > 0 && surface.light >= 0 && cos_theta > 0.0) {
            float pdf = light_pdf(surface.light, start, way, cos_theta, surface.light_density);
            vec3 met = path.throughput * material.emission * direct_emission_weight(path.pdf, pdf, path.certain);
            path_receive(path, met * path_rest(path));
        }
        if (is_hit && material_is_unlit(material)) path_receive(path, path.throughput * material.emission);

        // The end, by the number of bounces or Russian roulette (Arvo and Kirk 1990, Particle Transport and Image
        // Synthesis). By the throughput itself it would end too many paths (docs/sampling.md).
        float survival = min(1.0, sqrt(path.eta_scale * max_component(path.throughput)));
        if (!has_roulette || path.depth < u_russian_roulette_vertex) survival = 1.0;
        bool survives = !has_roulette || path.rr_sample < survival;
        bool scatters = is_hit && !material_is_unlit(material);
#if HAS_MEDIA
        scatters = scatters || flight.scatters;
#endif
        scatters = scatters && path.depth < u_bounces && survives;
#if HAS_EXACT_FRESNEL
        bool may_pass = is_hit && path.depth == u_bounces && interior_may_pass(material);
        scatters = scatters || (may_pass && survives);
#endif
        path.throughput /= survival;

        // One draw of random numbers serves the path that goes on and the one that begins after this vertex.
        bool ends = !scatters && !is_open;
        path_end_if(ends, path, film);
        index = film_sampler_index(film);
        vec4 u = sampler_vec4(numbers, index, ends ? dimension_camera() : dimension_vertex(vertex_number), rr_sample);

        // Direct light.
        bool is_lit = scatters && path.depth < u_bounces;
        Vertex vertex = vertex_at(surface, material, path.ray.direction, hash_uint(~path.seed + uint(vertex_number)));
#if HAS_MEDIA
        if (flight.scatters) {
            vertex_set_medium(vertex, path.ray, lit.distance, path.inside, medium.g);
            u.z = scatters ? u_lit.x : u.z;  // not of a path that begins
        }
#endif
        if (scatters && is_hit) {
            int band = interior_band(material, path.band, hash_to_unit(hash_uint(path.seed ^ 0x68bc21ebu)));
            path.throughput *= interior_band_color(path.band, band);
            path.band = band;
            interior_set_vertex(vertex, material, cos_theta >= 0.0, path.inside, band);
        }
        vertex_guide(vertex, path.depth + 1 < u_bounces && path_is_guided(path));
        vec3 throughput = path.throughput;
#if HAS_MEDIA
        if (flight.scatters) throughput = lit_throughput / survival;
#endif
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
        direct_traced = light_traced_next(path.traced, vertex, hit);
#endif
        vec3 direct = direct_light(vertex, is_lit, vertex_number, numbers, index, u.zw);
        if (is_lit) {
            direct *= throughput;
            path.radiance += direct;
#if FILM_LIGHT == FILM_LIGHT_PARTS
            vec3 diffuse = path.depth == 0 ? throughput * direct_diffuse : direct * path.diffuse;
            parts_receive(path.parts, path.depth + 1, direct, diffuse);
#endif
        }

#if HAS_MEDIA
        if (flight.scatters) {  // on from where the flight ended
            vertex.origin = path.ray.origin + flight.distance * path.ray.direction;
            vertex.behind = vertex.origin;
        }
#endif

        // The next direction, drawn from the BSDF, or by the guiding. Where there is none, the path ends at what it meets.
        BsdfSample scattered = vertex_scatter(vertex, u.xy);
        moments_scatter(path.moments, path.radiance, vertex_odds(vertex, scattered));
#if FILM_LIGHT == FILM_LIGHT_PARTS
        vec3 share = vertex_diffuse_share(vertex, scattered.wi, vertex_value(vertex, scattered));
        if (path.depth == 0) path.diffuse = bsdf_is_delta(scattered) ? vec3(0.0) : share;
#endif
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
        light_traced_scatter(path.traced, vertex, hit, scattered, path.depth, path.passed);
#endif
        // Unit again, by a step of Newton's method for the inverse root: within glass, rounding adds up over hundreds of
        // reflections, and spheres would be met from within.
        vec3 direction = frame_to_world(vertex.frame, scattered.wi);
        direction *= 1.5 - 0.5 * dot(direction, direction);
        path.ray = Ray(vertex_origin(vertex, scattered.wi), direction);
        path.throughput *= scattered.weight * vertex_shading_factor(vertex, scattered.wi);
        path.eta_scale *= square(scattered.eta);
        path.inside = interior_behind_vertex(vertex, scattered.wi);
        path.depth = scattered.pdf > 0.0 ? path.depth + 1 : u_bounces + 1;
        bool is_passed = direct_passes(vertex, scattered);
#if HAS_MEDIA
        is_passed = is_passed || (is_hit && interior_bounds_medium(material));
#endif
#if HAS_MEDIA || HAS_EXACT_FRESNEL
        path.start = is_passed ? path.start : path.ray.origin;
        path.way = is_passed ? distance(path.start, path.ray.origin) : 0.0;
#endif
        path.pdf = is_passed ? path.pdf : scattered.pdf;
        path.certain = is_passed ? path.certain : bsdf_is_delta(scattered);
        path.rr_sample = rr_sample;
#if HAS_EXACT_FRESNEL
        // To pass a surface unchanged is no scattering, and after the last one all that is left.
        if (path.depth > u_bounces && !bsdf_is_null(scattered)) path.throughput = vec3(0.0);
        path.depth -= int(bsdf_is_null(scattered));
        path.passed += int(bsdf_is_null(scattered));
#endif

        path.has_ended = !scatters;
        if (ends) path = path_begin(pixel, u);
    } while (film.next < end);
}
