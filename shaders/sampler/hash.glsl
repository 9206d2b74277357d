// SPDX-License-Identifier: MIT
// Independent uniform numbers, straight from a hash: the alternative the texture is tested against.
#include "core/hash.glsl"
#include "sampler/roulette.glsl"

uniform uint u_seed;

vec4 sampler_vec4(ivec2 pixel, uint index, int dimension, out float rr_sample) {
    uvec4 bits = hash_pcg4d(uvec4(uint(pixel.x) + (uint(pixel.y) << 16u), u_seed, uint(dimension), index));
    rr_sample = sampler_rr_sample(bits, index);
    return hash_to_unit(bits);
}
