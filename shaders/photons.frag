// SPDX-License-Identifier: MIT
// Photons that train the guiding (guiding/lobes.glsl): one for each fragment, from a light over surfaces that scatter it
// narrowly to one where it is received (Jensen 1995, Importance Driven Path Tracing Using the Photon Map).
//
// A photon begins at the first surface that it meets, and not at the light, so that every kind of light serves as it is:
// a chord of a target's bounding sphere finds a point of its surface, and a light sample there is the photon that
// arrives.
#include "core/constants.glsl"
#include "sampler/sampler.glsl"
#include "bsdf/bsdf.glsl"
#include "scene/storage.glsl"
#include "texture/texture.glsl"
#include "shape/intersect.glsl"
#include "material/material.glsl"
#include "light/light.glsl"
#include "integrator/direct.glsl"
#include "integrator/vertex.glsl"

layout(location = 0) out vec4 out_receiver;  // place, flux in W for a target of 1 m^2; below 0: over more than one surface
layout(location = 1) out vec4 out_source;    // the vertex before, irradiance of the receiver by one more reflection

uniform highp sampler2D u_photon_targets;  // centre and radius of a bounding sphere; below 0: chords begin inside

const float FOCUS = 2.0;   // times the density of a cosine lobe: from there on scattering is narrow
const int MOST_HOPS = 8;

vec4 photon_random(ivec2 photon, int dimension, out float u) { return sampler_vec4(photon, 0u, dimension, u); }

Ray photon_chord(vec4 target, vec4 u, float place) {
    Frame frame = frame_from_normal(square_to_uniform_sphere(u.xy));
    vec2 disk = square_to_disk(u.zw);
    float reach = sqrt(max(0.0, 1.0 - dot(disk, disk)));
    float start = target.w > 0.0 ? -reach : mix(-reach, reach, place);
    return Ray(target.xyz + abs(target.w) * frame_to_world(frame, vec3(disk, start)), frame.normal);
}

// Irradiance by what reaches a receiver over one more surface, from one direction.
float photon_indirect(Vertex receiver, vec4 u, uint seed) {
    vec3 wi = square_to_cosine_hemisphere(u.xy);
    Ray ray = Ray(receiver.origin, frame_to_world(receiver.frame, wi));
    Hit hit = closest_hit(ray, seed);
    if (hit.primitive == NO_PRIMITIVE) return PI * luminance(u_ambient_radiance);
    Surface surface = surface_at(ray, hit);
    material_choose(surface, seed);
    Vertex vertex = vertex_at(surface, material_at(surface), ray.direction, seed);
    return PI * luminance(direct_sample(vertex, true, u.zw));
}

void main() {
    ivec2 photon = ivec2(gl_FragCoord.xy);
    vec4 target = texelFetch(u_photon_targets, photon, 0);
    out_receiver = vec4(0.0);
    out_source = vec4(0.0);
    float survival;
    vec4 u = photon_random(photon, 0, survival);
    vec4 v = photon_random(photon, 1, survival);
    uint seed = hash_uint(floatBitsToUint(survival));

    Ray ray = photon_chord(target, u, v.x);
    Hit hit = closest_hit(ray, seed);
    Surface surface = surface_at(ray, hit);
    material_choose(surface, seed);
    if (hit.primitive == NO_PRIMITIVE || distance(surface.position, target.xyz) > 1.001 * abs(target.w)) return;
    Material material = material_at(surface);
    Vertex vertex = vertex_at(surface, material, ray.direction, seed);
    LightSample light = light_sample(vertex.origin, v.yz);
    if (material.unlit != 0 || light.pdf <= 0.0) return;
    if (direct_is_occluded(vertex, Ray(vertex.origin, light.wi), light.distance, light.primitive, v.yz)) return;
    float flux = luminance(light.radiance) / light.pdf * abs(dot(surface.normal, light.wi));
    vertex = vertex_at(surface, material, -light.wi, seed);

    int hop = 0;
    bool is_received = false;
    do {
        u = photon_random(photon, 2 + hop, survival);
        BsdfSample scattered = bsdf_sample(vertex.bsdf, vertex.wo, u.xy);
        bool is_narrow = bsdf_is_delta(scattered) || scattered.pdf > FOCUS * INVERSE_PI * abs(scattered.wi.z);
        flux *= is_narrow ? luminance(scattered.weight) * vertex_shading_factor(vertex, scattered.wi) * square(scattered.eta) : 0.0;
        ray = Ray(vertex_origin(vertex, scattered.wi), frame_to_world(vertex.frame, scattered.wi));
        seed = hash_uint(seed);
        hit = closest_hit(ray, seed);
        surface = surface_at(ray, hit);
        material_choose(surface, seed);
        material = material_at(surface);
        if (hit.primitive == NO_PRIMITIVE || material.unlit != 0 || scattered.pdf <= 0.0) flux = 0.0;
        vertex = vertex_at(surface, material, ray.direction, seed);
        // What is no delta is guided, and may scatter narrowly all the same: half of the photons go on there.
        bool receives = max_component(bsdf_eval(vertex.bsdf, vertex.wo, square_to_cosine_hemisphere(u.zw))) > 0.0;
        is_received = receives && survival < 0.5;
        flux *= receives ? 2.0 : 1.0;
        hop++;
    } while (flux > 0.0 && !is_received && hop < MOST_HOPS);
    if (flux <= 0.0 || !is_received) return;
    out_receiver = vec4(surface.position, hop > 1 ? -flux : flux);
    u = photon_random(photon, 2 + MOST_HOPS, survival);
    out_source = vec4(ray.origin, photon_indirect(vertex, u, seed));
}
