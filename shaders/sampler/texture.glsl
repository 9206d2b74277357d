// SPDX-License-Identifier: MIT
// The random-vector texture: each RANDOM_GROUP layers hold w * h points, four coordinates a layer, of an Owen-scrambled
// net, made and shuffled by packing/random_texture.py. Layers repeat over dimensions and points over the image; what
// makes each use its own are hashes:
// - of (pixel, group of dimensions, block of w * h samples), XORed with the point index, which permutes the aligned
//   power-of-two blocks of a sequence;
// - of (pixel, dimension, block), XORed with the bits of the coordinates (a random digital shift: Owen 2003, Variance
//   with Alternative Scramblings of Digital Nets), which keeps the stratification of the net.
// Each block of samples is thus an independent randomisation, so accumulation has no floor.
#include "core/hash.glsl"
#include "core/texels.glsl"
#include "sampler/roulette.glsl"

TEXELS_3D(8) u_random_texture;
uniform uint u_seed;

// Powers of two, and unsigned, so that division and remainder are shifts and masks.
const uint RANDOM_WIDTH = 64u;
const uint RANDOM_LAYERS = 16u;
const uint RANDOM_GROUP = 4u;
const uint RANDOM_POINTS = RANDOM_WIDTH * RANDOM_WIDTH;

vec4 sampler_vec4(ivec2 pixel, uint index, int dimension, out float rr_sample) {
    uint place = uint(pixel.x) + (uint(pixel.y) << 16u);
    uint block = index / RANDOM_POINTS;
    uint group = uint(dimension) / RANDOM_GROUP;
    uint order = hash_uint(hash_uint(hash_uint(place ^ hash_uint(u_seed)) ^ block) ^ group);
    uint point = (index ^ order) % RANDOM_POINTS;
    uvec3 texel = uvec3(point % RANDOM_WIDTH, point / RANDOM_WIDTH, uint(dimension) % RANDOM_LAYERS);
    uvec4 bits = hash_pcg4d(uvec4(place, u_seed, uint(dimension), block));
    rr_sample = sampler_rr_sample(bits, index);
    // The texture holds 1 + u, so the 23 bits of the mantissa are the digits of u.
    uvec4 digits = floatBitsToUint(texel_read_3d(u_random_texture, ivec3(texel)));
    return uintBitsToFloat(digits ^ (bits >> 9u)) - 1.0;
}
