// SPDX-License-Identifier: MIT
// Light from all around: an equirectangular map, bilinear between the centres of its texels, around in u
// and constant beyond the first and last row (scene/environment.py says which way it lies).
//
// A texel is chosen by its weight (packing/environment.py), down a tree of sums; the direction then is spread around its
// centre by a tent. A tent around each texel is what bilinear interpolation is, so the density is exactly that of the weights
// interpolated like the radiance.
#include "core/math.glsl"
#include "core/warp.glsl"
#include "light/sample.glsl"
#include "scene/storage.glsl"

#ifndef HAS_ENVIRONMENT
#define HAS_ENVIRONMENT 0
#endif
#if HAS_ENVIRONMENT

// Both textures are 4096 texels wide.
TEXELS(13) u_environment;                 // rgb: radiance / u_environment_scale, a: weight; texel by texel
TEXELS(14) u_environment_tree;            // sums of weights, from the root down (packing/environment.py)
uniform ivec2 u_environment_size;         // of the map
uniform int u_environment_levels;         // of the tree
uniform float u_environment_density;      // what turns weights into density over solid angle, times sin(theta)
uniform vec3 u_environment_scale;
uniform float u_environment_probability;  // of being chosen among the lights
uniform vec2 u_environment_rotation;      // cosine and sine of the angle about +y

vec4 environment_texel(int column, int row) {
    int index = row * u_environment_size.x + column;
    return texel_read(u_environment, storage_place(index));
}

vec4 environment_node(int index) {
    return texel_read(u_environment_tree, storage_place(index));
}

// What is `x` of the way from the left to the right; gradients have one column.
vec4 environment_between(int left, int right, int row, float x) {
    vec4 found = environment_texel(left, row);
    return u_environment_size.x > 1 ? mix(found, environment_texel(right, row), x) : found;
}

// At a place in texels from the upper left corner, at most one texel off the map in x.
vec4 environment_bilinear(vec2 place) {
    vec2 corner = floor(place - 0.5);
    vec2 f = place - 0.5 - corner;
    ivec2 last = u_environment_size - 1;
    int left = int(corner.x);
    int right = left + 1;
    if (u_environment_size.x == 1) left = 0;
    left += left < 0 ? u_environment_size.x : left > last.x ? -u_environment_size.x : 0;
    right -= right > last.x ? u_environment_size.x : 0;
    int upper = max(int(corner.y), 0);
    int lower = min(int(corner.y) + 1, last.y);
    vec4 above = environment_between(left, right, upper, f.x);
    return u_environment_size.y > 1 ? mix(above, environment_between(left, right, lower, f.x), f.y) : above;
}

float environment_density(float weight, float sin_theta) {
    return sin_theta > 0.0 ? weight * u_environment_density / sin_theta : 0.0;
}

// A direction of the world in the space of the map.
vec3 environment_to_map(vec3 wi) {
    float c = u_environment_rotation.x;
    float s = u_environment_rotation.y;
    return vec3(c * wi.x - s * wi.z, wi.y, s * wi.x + c * wi.z);
}

// Radiance from a direction of the world in rgb, the density of environment_light_sample() in a.
vec4 environment_radiance_pdf(vec3 wi) {
    vec3 local = environment_to_map(wi);
    float sin_theta = length(local.xz);
    // u = 0.5 is -z; both angles in turns, theta half a turn from pole to pole.
    float u = 0.5 + turns_of(vec2(-local.z, local.x));
    float v = 2.0 * turns_of(vec2(local.y, sin_theta));
    vec4 found = environment_bilinear(vec2(u, v) * vec2(u_environment_size));
    return vec4(found.rgb * u_environment_scale, environment_density(found.a, sin_theta));
}

// Chooses one of two by their weights and stretches u over the choice; one of weight 0 never.
bool environment_choose(float first, float second, inout float u) {
    float total = first + second;
    bool chosen = second <= 0.0 || u * total < first;
    u = (chosen ? u * total : u * total - first) / (chosen ? first : second);
    u = clamp(u, 0.0, ONE_MINUS_EPSILON);
    return chosen;
}

LightSample environment_light_sample(vec2 u) {
    ivec2 texel = ivec2(0);
    int first = 0;  // node of the level
    int level = u_environment_levels;
    do {
        ivec2 size = (u_environment_size + (1 << level) - 1) >> level;
        // x: upper left, y: upper right, z: lower left, w: lower right.
        vec4 weights = environment_node(first + texel.y * size.x + texel.x);
        bool left = environment_choose(weights.x + weights.z, weights.y + weights.w, u.x);
        vec2 column = left ? weights.xz : weights.yw;
        bool top = environment_choose(column.x, column.y, u.y);
        texel = 2 * texel + ivec2(left ? 0 : 1, top ? 0 : 1);
        first += size.x * size.y;
        level--;
    } while (level > 0);
    vec2 place = vec2(texel) + 0.5 + square_to_tent(u);
    // Beyond a pole the tent is folded back: the sum is then constant there, as the map is.
    float rows = float(u_environment_size.y);
    place.y = rows - abs(rows - abs(place.y));
    vec4 found = environment_bilinear(place);
    vec2 cos_sin_theta = cos_sin_turns(0.5 * place.y / rows);
    float turns = place.x / float(u_environment_size.x) - 0.5;
    vec2 cos_sin_phi = cos_sin_turns(turns - floor(turns));
    vec3 local = vec3(cos_sin_theta.y * cos_sin_phi.y, cos_sin_theta.x, -cos_sin_theta.y * cos_sin_phi.x);
    float c = u_environment_rotation.x;
    float s = u_environment_rotation.y;
    vec3 wi = vec3(c * local.x + s * local.z, local.y, c * local.z - s * local.x);
    float pdf = environment_density(found.a, cos_sin_theta.y);
    return LightSample(wi, INFINITE_DISTANCE, found.rgb * u_environment_scale, pdf, false, PRIMITIVE_AROUND);
}

#endif
