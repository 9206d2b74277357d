// SPDX-License-Identifier: MIT
// Direct light at a vertex by next-event estimation, and how it is weighed against light that BSDF sampling meets
// (multiple importance sampling: Veach 1997, chapter 9).
#include "core/hash.glsl"
#include "core/math.glsl"
#include "integrator/interior.glsl"
#include "integrator/light_traced.glsl"
#include "integrator/vertex.glsl"
#include "light/light.glsl"
#include "material/visibility.glsl"
#include "sampler/sampler.glsl"

#define ESTIMATOR_MIS 0
#define ESTIMATOR_NEE 1
#define ESTIMATOR_BSDF 2
#ifndef ESTIMATOR
#define ESTIMATOR ESTIMATOR_MIS
#endif

uniform int u_light_samples;  // at each vertex
uniform int u_has_panes;      // 1: some surface is a smooth pane
uniform vec3 u_ambient_radiance;

#if FILM_LIGHT == FILM_LIGHT_PARTS
vec3 direct_diffuse;  // what of the light that direct_light() has returned is scattered by the diffuse part of the BSDF
#endif

#if FILM_LIGHT == FILM_LIGHT_UNTRACED
vec3 direct_traced = vec3(0.0);  // what of narrowly scattered light direct_light() leaves to light tracing
bool direct_is_traced;           // whether light is traced from all panes that the last ray has passed
#endif

// Weight of a sample of the lights of density light_pdf, against BSDF sampling of density bsdf_pdf.
float direct_light_weight(float light_pdf, float bsdf_pdf, bool delta) {
#if ESTIMATOR == ESTIMATOR_MIS
    return delta ? 1.0 : power_heuristic(float(u_light_samples) * light_pdf, bsdf_pdf);
#elif ESTIMATOR == ESTIMATOR_NEE
    return 1.0;
#else
    return float(delta);
#endif
}

// Weight of emission met by BSDF sampling of density bsdf_pdf, against light sampling of density light_pdf; `certain`
// says that the ray could only have come this way: from the camera or a delta lobe.
float direct_emission_weight(float bsdf_pdf, float light_pdf, bool certain) {
#if ESTIMATOR == ESTIMATOR_MIS
    return certain ? 1.0 : power_heuristic(bsdf_pdf, float(u_light_samples) * light_pdf);
#elif ESTIMATOR == ESTIMATOR_NEE
    return certain ? 1.0 : 0.0;
#else
    return 1.0;
#endif
}

// Of a ray that `u` has chosen.
uint direct_seed(Vertex vertex, vec2 u) {
    return hash_uint(vertex.seed ^ hash_uint(floatBitsToUint(u.x) ^ hash_uint(floatBitsToUint(u.y))));
}

// Whether anything is between the start of a ray that `u` has chosen and a light.
bool direct_is_occluded(Vertex vertex, Ray ray, float distance, int light_primitive, vec2 u) {
    return is_occluded(ray, distance, light_primitive, direct_seed(vertex, u));
}

// Whether rays to lights pass the surface of the vertex as the sample `s` does, in which case a path that goes on behind it
// is weighed by the vertex before.
bool direct_passes(Vertex vertex, BsdfSample s) {
    return u_has_panes != 0 && vertex.bsdf.model == BSDF_THIN_DIELECTRIC && bsdf_is_null(s);
}

#if HAS_MEDIA || HAS_EXACT_FRESNEL
// What a surface lets pass of a ray that has met it, which goes on as if there was none.
vec3 direct_pane_transmittance(Surface surface, Hit hit, vec3 direction, uint seed) {
    Material material = material_at(surface);
    Vertex pane = vertex_at(surface, material, direction, seed);
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
    direct_is_traced = direct_is_traced && light_traced_from(hit) && !pane.is_bent;
#endif
    return bsdf_null_transmittance(pane.bsdf, pane.wo.z) * vertex_shading_factor(pane, -pane.wo);
}

// As direct_transmittance(), from surface to surface.
vec3 direct_transmittance_in_steps(Vertex vertex, Ray ray, float distance, ivec4 inside, int light_primitive, vec2 u) {
    uint seed = direct_seed(vertex, u);
    vec3 transmittance = vec3(1.0);
    bool goes_on;
    do {
        Hit hit = closest_hit_before(ray, distance, light_primitive, seed, u_has_null == 0 && u_has_panes == 0);
        goes_on = hit.primitive != NO_PRIMITIVE;
        float way = goes_on ? hit.distance : distance;
#if HAS_MEDIA
        transmittance *= medium_transmittance(medium_load(interior_of(inside)), ray, way, hash_uint(~seed));
#else
        transmittance *= interior_transmittance(inside, way);
#endif
        if (goes_on) {
            Surface surface = surface_at(ray, hit);
            material_choose(surface, seed);
            Material material = material_load(surface.material);
            bool is_entered = dot(surface.normal, ray.direction) < 0.0;
            if (interior_bounds_medium(material)) {
                int interior = material.record + 1;
                inside = is_entered ? interior_with(inside, interior) : interior_without(inside, interior);
            } else {
                transmittance *= u_has_panes != 0 ? direct_pane_transmittance(surface, hit, ray.direction, seed) : vec3(0.0);
            }
            vec3 beyond = ray.direction + (is_entered ? -surface.normal : surface.normal);
            vec3 origin = ray_offset_origin(surface.position, beyond, surface.extent);
            distance = max(0.0, distance - dot(origin - ray.origin, ray.direction));
            ray.origin = origin;
            seed = hash_uint(seed);
        }
        goes_on = goes_on && max_component(transmittance) > 0.0;
    } while (goes_on);
    if (goes_on) traversal_was_cut = true;
    return transmittance;
}
#endif

// What is left of light that arrives along a ray from `distance`, where the ray begins `inside` of some dielectrics; it
// passes boundaries of media and smooth panes.
vec3 direct_transmittance(Vertex vertex, Ray ray, float distance, ivec4 inside, int light_primitive, vec2 u) {
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
    direct_is_traced = true;
#endif
#if HAS_MEDIA
    return direct_transmittance_in_steps(vertex, ray, distance, inside, light_primitive, u);
#else
#if HAS_EXACT_FRESNEL
    if (u_has_panes != 0) return direct_transmittance_in_steps(vertex, ray, distance, inside, light_primitive, u);
#endif
    return direct_is_occluded(vertex, ray, distance, light_primitive, u) ? vec3(0.0) : interior_transmittance(inside, distance);
#endif
}

#if HAS_MEDIA
const float DIRECT_BY_WAY = 0.5;  // the probability that a light is chosen by what it brings to a way, not by power alone

// The point of a way through a medium where direct_light() takes one sample of a light, for a path that `flight` scatters
// on the way. Of few lights u.x chooses that one, and is changed to what chooses it there.
MediumSample direct_flight(Medium medium, Ray ray, float distance, vec3 throughput, MediumSample flight, inout vec2 u) {
    if (!flight.scatters || u_light_count == 0 || u_light_count > FEW_LIGHTS) return flight;
    bool is_by_way = u.x < DIRECT_BY_WAY;
    u.x = is_by_way ? u.x / DIRECT_BY_WAY : (u.x - DIRECT_BY_WAY) / (1.0 - DIRECT_BY_WAY);
    LightChoice chosen = light_choice_load(0);
    Equiangular chosen_way;
    float worth, sum = 0.0;
    bool is_near;
    for (int i = 0; i < u_light_count; i++) {
        LightChoice choice = light_choice_load(i);
        vec4 focus = light_focus(choice);
        Equiangular way = equiangular_over(ray, distance, focus.xyz, focus.w);
        // The integral of 1 / r^2 over the way; of light from everywhere or afar, as if it was as far away as that is long.
        float brings = choice.probability * (focus.w >= 0.0 ? way.angle / way.aside : 1.0 / distance);
        sum += brings;
        // A light takes the place of those before it with its share of the sum.
        float share = is_by_way ? brings / sum : choice.probability / (choice.cumulative + choice.probability);
        bool is_taken = i == 0 || u.x < share;
        u.x = i == 0 ? u.x : is_taken ? u.x / share : (u.x - share) / (1.0 - share);
        if (is_taken) {
            chosen = choice;
            chosen_way = way;
            worth = brings;
            is_near = focus.w >= 0.0;
        }
    }
    MediumSample s = flight;
    if (is_near) s = medium_lit_point(medium, distance, throughput, flight, chosen_way, u.y);
    if (u_light_samples == 1) s.weight *= chosen.probability / mix(chosen.probability, worth / sum, DIRECT_BY_WAY);
    u.x = chosen.cumulative + chosen.probability * min(u.x, ONE_MINUS_EPSILON);
    return s;
}
#endif

// Radiance scattered towards wo from one sample of the lights, if nothing occludes it; `eval_pdf` is vertex_eval_pdf().
vec3 direct_unoccluded(Vertex vertex, LightSample light, vec3 wi, vec4 eval_pdf) {
    vec3 value = eval_pdf.rgb * vertex_shading_factor(vertex, wi);
    if (light.pdf <= 0.0 || max_component(value) <= 0.0) return vec3(0.0);
    float bsdf_pdf = vertex_bsdf_probability(vertex) * eval_pdf.a;
    return value * light.radiance * (direct_light_weight(light.pdf, bsdf_pdf, light.delta) / light.pdf);
}

vec3 direct_sample(Vertex vertex, bool is_wanted, vec2 u) {
    LightSample light = light_sample(vertex.origin, u);
    vec3 wi = frame_to_local(vertex.frame, light.wi);
    vec4 eval_pdf = vertex_eval_pdf(vertex, wi);
    vec3 radiance = direct_unoccluded(vertex, light, wi, eval_pdf);
    // Nothing that emits lights itself: it is convex. Where it transmits, rounding would have a sphere do so.
    bool is_lit = light.primitive != vertex.primitive || light.primitive < 0;
    if (!is_wanted || !is_lit || max_component(radiance) <= 0.0) return vec3(0.0);
    Ray ray = Ray(vertex_origin(vertex, wi), light.wi);
    ivec4 inside = interior_behind_vertex(vertex, wi);
    radiance *= direct_transmittance(vertex, ray, light.distance, inside, light.primitive, u);
#if FILM_LIGHT == FILM_LIGHT_PARTS
    direct_diffuse += radiance * vertex_diffuse_share(vertex, wi, eval_pdf.rgb);
#endif
#if FILM_LIGHT == FILM_LIGHT_UNTRACED
    vec3 narrow = vertex_narrow_share(vertex, wi, eval_pdf.rgb);
    if (light_traced_is_wanted(light) && direct_is_traced) radiance *= 1.0 - direct_traced * narrow;
#endif
    return radiance;
}

// The ambient light by sampling it alone, from all directions where the surface transmits. The other estimators leave it
// to BSDF sampling, which is proportional to the integrand where nothing occludes; its light pdf is therefore 0 there.
vec3 direct_ambient_sample(Vertex vertex, vec2 u) {
#if HAS_MEDIA
    if (vertex.in_medium) {
        Ray way = Ray(vertex.origin, frame_to_world(vertex.frame, phase_sample(vertex.g, vertex.wo, u)));
        vec3 scattered = u_ambient_radiance * direct_transmittance(vertex, way, INFINITE_DISTANCE, vertex.inside, NO_PRIMITIVE, u);
#if FILM_LIGHT == FILM_LIGHT_PARTS
        direct_diffuse += scattered;
#endif
        return scattered;
    }
#endif
    bool transmits = bsdf_transmits(vertex.bsdf);
    vec3 wi = transmits ? square_to_uniform_sphere(u) : square_to_cosine_hemisphere(u);
    float density = transmits ? square_to_uniform_sphere_pdf() : square_to_cosine_hemisphere_pdf(wi);
    if (density <= 0.0) return vec3(0.0);
    Ray ray = Ray(vertex_origin(vertex, wi), frame_to_world(vertex.frame, wi));
    float factor = vertex_shading_factor(vertex, wi);
    ivec4 inside = interior_behind_vertex(vertex, wi);
    vec3 radiance = u_ambient_radiance * direct_transmittance(vertex, ray, INFINITE_DISTANCE, inside, NO_PRIMITIVE, u);
    vec3 value = bsdf_eval(vertex.bsdf, vertex.wo, wi);
    vec3 scattered = value * radiance * factor / density;
#if FILM_LIGHT == FILM_LIGHT_PARTS
    direct_diffuse += scattered * vertex_diffuse_share(vertex, wi, value);
#endif
    return scattered;
}

// Radiance from all lights that the vertex, number `depth` of its path, scatters towards wo; u serves if one sample is all,
// else the random numbers of a pixel. Where it is not wanted, no rays are traced, and the result is 0.
vec3 direct_light(Vertex vertex, bool is_wanted, int depth, ivec2 numbers, uint index, vec2 u) {
    vec3 direct = vec3(0.0);
    float unused;
#if FILM_LIGHT == FILM_LIGHT_PARTS
    direct_diffuse = vec3(0.0);
#endif
    if (u_light_count > 0) {
        int i = 0;
        do {
            if (u_light_samples > 1) {
                uint light_index = sampler_part_index(index, uint(u_light_samples), uint(i));
                u = sampler_vec4(numbers, light_index, dimension_light(depth), unused).xy;
            }
            direct += direct_sample(vertex, is_wanted, u);
            i++;
        } while (i < u_light_samples);
        direct /= float(u_light_samples);
#if FILM_LIGHT == FILM_LIGHT_PARTS
        direct_diffuse /= float(u_light_samples);
#endif
    }
#if ESTIMATOR == ESTIMATOR_NEE
    if (is_wanted && max_component(u_ambient_radiance) > 0.0) {
        direct += direct_ambient_sample(vertex, sampler_vec4(numbers, index, dimension_ambient(depth), unused).xy);
    }
#endif
    return direct;
}
