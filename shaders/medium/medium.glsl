// SPDX-License-Identifier: MIT
// The contract of media, and how light passes them.
//
//   medium_transmittance  what is left of light along a ray; in the mean, where the density varies
//   medium_sample         where along a ray light is scattered next, if it is at all
//   medium_lit_point      where along it to take the light from that is scattered there
//
// Where a grid says the density, both go on in steps through cells of the largest density within them, by delta tracking
// (Woodcock et al. 1965) and by ratio tracking (Novák et al. 2014, Residual Ratio Tracking for Estimating Attenuation in
// Participating Media).
//
// Extinction has a colour, and so has the density of free flights. One channel is drawn for each, in proportion to what
// the path is worth in it, and the weight is over the mean density of all (the balance heuristic: Wilkie et al. 2014, Hero
// Wavelength Spectral Sampling; Pharr, Jakob and Humphreys 2023, section 14.2). So no weight raises the sum of a path's channels.
#include "core/constants.glsl"
#include "core/frame.glsl"
#include "core/hash.glsl"
#include "core/math.glsl"
#include "scene/storage.glsl"
#include "shape/bvh.glsl"
#include "shape/ray.glsl"

#ifndef HAS_MEDIA
#define HAS_MEDIA 0
#endif
#if HAS_MEDIA
#include "medium/equiangular.glsl"
#include "medium/grid.glsl"
#include "medium/phase.glsl"

uniform int u_first_medium;  // texel of u_scene where the table begins

// What is behind the surface of a dielectric: of the one whose record has the number i, that with the number i + 1. The
// first is the fog.
struct Medium {
    vec3 extinction;  // 1/m
    float g;          // mean cosine of scattering
    vec3 albedo;      // what of extinction is scattering
    int is_null;      // 1: the surface around it is none
    int grid;         // number of the grid of densities that multiply the extinction, or -1
};
Medium medium_of(uvec4 t0, uvec4 t1, uvec4 t2) {
    return Medium(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), int(t1.w), int(t2.x));
}
Medium medium_load(int index) {
    int first = u_first_medium + 3 * index;
    return medium_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2));
}

// Beer and Lambert's law.
vec3 medium_passed(vec3 extinction, float distance) { return exp(-extinction * distance); }

struct MediumSample {
    float distance;
    vec3 weight;   // of what is scattered there, or of what arrives where the way ends
    bool scatters;
};

// Of being chosen, for each channel, by what a path is worth in it.
vec3 medium_channels(vec3 throughput) {
    float worth = throughput.x + throughput.y + throughput.z;
    return worth > 0.0 ? throughput / worth : vec3(1.0 / 3.0);
}

// Free flight of a path worth `throughput` through what has the same extinction everywhere, over a way of the length
// `distance`; `u` chooses the channel and the flight. The weight takes all extinction for scattering.
MediumSample medium_flight(vec3 extinction, float distance, vec3 throughput, vec2 u) {
    vec3 probability = medium_channels(throughput);
    float drawn = u.x < probability.x ? extinction.x : u.x < probability.x + probability.y ? extinction.y : extinction.z;
    float flight = drawn > 0.0 ? -log(1.0 - u.y) / drawn : INFINITE_DISTANCE;
    bool scatters = flight < distance;
    flight = min(flight, distance);
    vec3 passed = medium_passed(extinction, flight);
    vec3 density = scatters ? extinction * passed : passed;
    return MediumSample(flight, density / max(dot(probability, density), 1e-30), scatters);
}

// Of a medium with a grid: a collision with the largest density of a cell is one with a share of it.
MediumSample medium_track(Medium medium, Ray ray, float distance, vec3 throughput, vec2 u) {
    Grid grid = grid_load(medium.grid);
    vec3 inverse = grid_inverse(ray);
    vec2 range = grid_range(grid, ray, inverse, distance);
    MediumSample s = MediumSample(range.x, vec3(1.0), false);
    uint seed = hash_uint(floatBitsToUint(u.x) ^ hash_uint(floatBitsToUint(u.y)));
    bool goes_on = range.x < range.y;
    GridWalk walk = grid_walk(grid, ray, inverse, range);
    while (goes_on) {
        float rest = max(0.0, walk.end - s.distance);
        MediumSample flight = medium_flight(medium.extinction * walk.largest, rest, throughput * s.weight, u);
        s.distance = flight.scatters ? s.distance + flight.distance : walk.end;
        s.weight *= flight.weight;
        seed = hash_uint(seed + 0x9e3779b9u);
        if (flight.scatters) {
            float share = grid_density(grid, ray.origin + s.distance * ray.direction) / walk.largest;
            s.scatters = hash_to_unit(seed) < share;
            goes_on = !s.scatters;
        } else {
            goes_on = walk.end < range.y;
            grid_step(walk, grid, ray, inverse, range.y);
        }
        u = hash_to_unit(hash_pcg4d(uvec4(seed, 0u, 1u, 2u))).xy;
    }
    if (goes_on) traversal_was_cut = true;
    if (!s.scatters) s.distance = distance;
    return s;
}

// A way of the length `distance` along a ray, for a path worth `throughput`; `u` chooses the channel and the free flight.
MediumSample medium_sample(Medium medium, Ray ray, float distance, vec3 throughput, vec2 u) {
    bool is_grid = u_has_grids != 0 && medium.grid >= 0;
    if (!is_grid && max_component(medium.albedo * medium.extinction) <= 0.0) {
        return MediumSample(distance, medium_passed(medium.extinction, distance), false);
    }
    MediumSample s;  // not by ?:, which WebGL has not for structs
    if (is_grid) s = medium_track(medium, ray, distance, throughput, u);
    else s = medium_flight(medium.extinction, distance, throughput, u);
    if (s.scatters) s.weight *= medium.albedo;
    return s;
}

const float MEDIUM_EQUIANGULAR = 0.5;  // the probability of equiangular sampling

// For a path that `flight` scatters on its `way`, a point of that to take light from: by equiangular sampling, or that of
// the flight, of the density of both.
MediumSample medium_lit_point(
    Medium medium, float distance, vec3 throughput, MediumSample flight, Equiangular way, float u) {
    if (u_has_grids != 0 && medium.grid >= 0) return flight;
    vec3 probability = medium_channels(throughput);
    float taken = u < MEDIUM_EQUIANGULAR ? equiangular_sample(way, u / MEDIUM_EQUIANGULAR) : flight.distance;
    vec3 scattered = medium.extinction * medium_passed(medium.extinction, taken);
    float scatters = dot(probability, 1.0 - medium_passed(medium.extinction, distance));
    float density = mix(dot(probability, scattered), scatters * equiangular_pdf(way, taken), MEDIUM_EQUIANGULAR);
    return MediumSample(min(taken, distance), medium.albedo * scattered / max(density, 1e-30), true);
}

const float MEDIUM_LITTLE = 0.05;  // what is left of light where roulette begins

// Along `distance` of a ray; `seed` is its own.
vec3 medium_transmittance(Medium medium, Ray ray, float distance, uint seed) {
    if (u_has_grids == 0 || medium.grid < 0) return medium_passed(medium.extinction, distance);
    Grid grid = grid_load(medium.grid);
    vec3 inverse = grid_inverse(ray);
    vec2 range = grid_range(grid, ray, inverse, distance);
    float largest = max_component(medium.extinction);
    vec3 transmittance = vec3(1.0);
    bool goes_on = range.x < range.y && largest > 0.0;
    GridWalk walk = grid_walk(grid, ray, inverse, range);
    while (goes_on) {
        seed = hash_uint(seed + 0x9e3779b9u);
        vec4 u = hash_to_unit(hash_pcg4d(uvec4(seed, 3u, 4u, 5u)));
        float extinction = max(largest * walk.largest, 1e-30);
        range.x -= log(1.0 - u.x) / extinction;
        if (range.x < walk.end) {
            float density = grid_density(grid, ray.origin + range.x * ray.direction);
            transmittance *= max(vec3(0.0), 1.0 - medium.extinction * (density / extinction));
            bool is_little = max_component(transmittance) < MEDIUM_LITTLE;
            if (is_little) transmittance *= u.y < 0.5 ? 2.0 : 0.0;
            goes_on = max_component(transmittance) > 0.0;
        } else {
            range.x = walk.end;
            goes_on = walk.end < range.y;
            grid_step(walk, grid, ray, inverse, range.y);
        }
    }
    if (goes_on) traversal_was_cut = true;
    return transmittance;
}

#endif
