// SPDX-License-Identifier: MIT
// The contract of media, and how light passes them.
//
//   medium_transmittance  what is left of light along a way (Beer and Lambert)
//   medium_sample         where along a ray light is scattered next, if it is at all
//
// Extinction has a colour, and so has the density of free flights. One channel is drawn for each, in proportion to what
// the path is worth in it, and the weight is over the mean density of all (the balance heuristic: Wilkie et al. 2014, Hero
// Wavelength Spectral Sampling; Pharr, Jakob and Humphreys 2023, section 14.2). So no weight raises the sum of a path's channels.
#include "core/constants.glsl"
#include "core/math.glsl"
#include "scene/storage.glsl"

#ifndef HAS_MEDIA
#define HAS_MEDIA 0
#endif

uniform int u_first_medium;  // texel of u_scene where the table begins

// What is behind the surface of a dielectric: of the one whose record has the number i, that with the number i + 1. The
// first is the fog.
struct Medium {
    vec3 extinction;  // 1/m
    float g;          // mean cosine of scattering
    vec3 albedo;      // what of extinction is scattering
    int is_null;      // 1: the surface around it is none
};
Medium medium_of(uvec4 t0, uvec4 t1) {
    return Medium(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), int(t1.w));
}
Medium medium_load(int index) {
    int first = u_first_medium + 2 * index;
    return medium_of(scene_texel(first), scene_texel(first + 1));
}

vec3 medium_transmittance(Medium medium, float distance) { return exp(-medium.extinction * distance); }

struct MediumSample {
    float distance;
    vec3 weight;   // of what is scattered there, or of what arrives where the way ends
    bool scatters;
};

// A way of the length `distance`, for a path worth `throughput`; `u` chooses the channel and the free flight.
MediumSample medium_sample(Medium medium, float distance, vec3 throughput, vec2 u) {
    if (max_component(medium.albedo * medium.extinction) <= 0.0) {
        return MediumSample(distance, medium_transmittance(medium, distance), false);
    }
    vec3 probability = throughput / max(throughput.x + throughput.y + throughput.z, 1e-30);
    float extinction = u.x < probability.x ? medium.extinction.x : u.x < probability.x + probability.y ? medium.extinction.y : medium.extinction.z;
    float flight = extinction > 0.0 ? -log(1.0 - u.y) / extinction : INFINITE_DISTANCE;
    bool scatters = flight < distance;
    flight = min(flight, distance);
    vec3 transmittance = medium_transmittance(medium, flight);
    vec3 density = scatters ? medium.extinction * transmittance : transmittance;
    vec3 weight = (scatters ? medium.albedo : vec3(1.0)) * density / max(dot(probability, density), 1e-30);
    return MediumSample(flight, weight, scatters);
}
