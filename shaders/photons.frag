// SPDX-License-Identifier: MIT
// Photons that train the guiding (guiding/lobes.glsl): one for each fragment, from a light over surfaces that scatter it
// narrowly to one where it is received (Jensen 1995, Importance Driven Path Tracing Using the Photon Map).
//
// A photon begins at the first surface that it meets, and not at the light, so that every kind of light serves as it is:
// a point of a target, which is a shape that may scatter narrowly, is drawn by area, and a light sample there is the photon
// that arrives.
#include "core/constants.glsl"
#include "core/texels.glsl"
#include "sampler/sampler.glsl"
#include "bsdf/bsdf.glsl"
#include "scene/storage.glsl"
#include "texture/texture.glsl"
#include "shape/intersect.glsl"
#include "material/material.glsl"
#include "light/light.glsl"
#include "integrator/direct.glsl"
#include "integrator/target.glsl"
#include "integrator/vertex.glsl"

OUTPUT(0) out_receiver;  // place, flux in W over the density of all that was drawn; below 0: over more than one surface
OUTPUT(1) out_source;    // the vertex before, irradiance of the receiver by one more reflection
OUTPUT(2) out_target;    // r: the number of the target

const float FOCUS = 2.0;   // times the density of a cosine lobe: from there on scattering is narrow
const int MOST_HOPS = 8;

vec4 photon_random(ivec2 photon, int dimension, out float u) { return sampler_vec4(photon, 0u, dimension, u); }

void main() {
    ivec2 photon = ivec2(gl_FragCoord.xy);
    vec4 receiver = vec4(0.0);
    vec4 source = vec4(0.0);
    float survival;
    vec4 u = photon_random(photon, 0, survival);
    int number = target_choose(u.x, survival);
    Target target = target_load(number);
    uint seed = hash_uint(floatBitsToUint(u.x) ^ hash_uint(floatBitsToUint(survival)));
    Ray ray;
    Hit hit = target_point(target, u.yz, ray);
    float flux = 1.0 / target.density;
    int turn = 0;
    bool is_received = false;
    bool is_straight = true;  // whether rays to the light that it is from pass all that is behind it
    bool goes_on;
    // One place to trace rays, whatever they are for: drivers inline it, and compile it as often.
    do {
        seed = hash_uint(seed);
        bool is_first = turn == 0;
        if (!is_first) hit = closest_hit(ray, seed);
        Surface surface = surface_at(ray, hit);
#if HAS_ALPHA
        if (is_first) flux *= material_opacity(surface);
#endif
        material_choose(surface, seed);
        Material material = material_at(surface);
        bool is_met = hit.primitive != NO_PRIMITIVE && !material_is_unlit(material);

        // Light at the first vertex, which is the photon, and at the one that the receiver sees.
        u = photon_random(photon, 1 + turn, survival);
        LightSample light = light_sample(surface.position, u.xy);
        if (is_first) ray.direction = -light.wi;
        Vertex vertex = vertex_at(surface, material, ray.direction, seed);
        bool is_lit = is_met && (is_first || is_received) && light.pdf > 0.0;
        if (is_first && target.is_culled) is_lit = is_lit && dot(surface.normal, light.wi) > 0.0;
        if (is_lit) is_lit = !direct_is_occluded(vertex, Ray(vertex.origin, light.wi), light.distance, light.primitive, u.xy);
        if (is_received) {
            vec3 wi = frame_to_local(vertex.frame, light.wi);
            vec3 radiance = is_lit ? direct_unoccluded(vertex, light, wi, vertex_eval_pdf(vertex, wi)) : vec3(0.0);
            source.w = PI * luminance(hit.primitive == NO_PRIMITIVE ? u_ambient_radiance : radiance);
        }
        if (is_first) flux *= is_lit ? luminance(light.radiance) / light.pdf * abs(dot(surface.normal, light.wi)) : 0.0;
        goes_on = is_met && flux > 0.0 && !is_received && turn <= MOST_HOPS;

        // What is no delta is guided, and may scatter narrowly all the same: of the photons that it does, half go on.
        vec3 any_direction = square_to_cosine_hemisphere(u.zw);
        vec3 scatters = bsdf_eval(vertex.bsdf, vertex.wo, any_direction) + vertex.bsdf.transmitted;
        bool receives = !is_first && !is_straight && max_component(scatters) > 0.0;
        BsdfSample scattered = bsdf_sample(vertex.bsdf, vertex.wo, u.zw);
        // Where the environment shines through a pane they do, too, but do not know where there is one.
        if (is_first) is_straight = light.primitive != PRIMITIVE_AROUND;
        is_straight = is_straight && direct_passes(vertex, scattered);
        bool is_narrow = bsdf_is_delta(scattered) || scattered.pdf > FOCUS * INVERSE_PI * abs(scattered.wi.z);
        flux *= receives && is_narrow ? 2.0 : 1.0;
        is_received = goes_on && receives && (!is_narrow || survival < 0.5);
        if (is_received) {
            receiver = vec4(surface.position, turn > 1 ? -flux : flux);
            source.xyz = ray.origin;
            scattered.wi = any_direction;
        } else {
            flux *= is_narrow ? luminance(scattered.weight) * vertex_shading_factor(vertex, scattered.wi) * square(scattered.eta) : 0.0;
            goes_on = goes_on && scattered.pdf > 0.0;
        }
        ray = Ray(vertex_origin(vertex, scattered.wi), frame_to_world(vertex.frame, scattered.wi));
        turn++;
    } while (goes_on);
    output_write(out_receiver, receiver);
    output_write(out_source, source);
    output_write(out_target, vec4(float(number), 0.0, 0.0, 0.0));
}
