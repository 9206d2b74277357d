// SPDX-License-Identifier: MIT
// The random-vector texture: layer k holds w * h points of an Owen-scrambled four-dimensional Sobol
// set, made and shuffled by random_texture.py. Layers repeat over dimensions and points over the
// image; what makes each use its own is a hash of (pixel, dimension, block of w * h samples):
// - the point index is XORed with it, which permutes the aligned power-of-two blocks of a sequence;
// - the bits of the coordinates are XORed with it (a random digital shift: Owen 2003, Variance with
//   Alternative Scramblings of Digital Nets), which keeps the stratification of the net.
// Each block of samples is thus an independent randomisation, so accumulation has no floor.
uniform highp sampler3D u_random_texture;
uniform uint u_seed;

const int RANDOM_TEXTURE_POINTS = RANDOM_TEXTURE_WIDTH * RANDOM_TEXTURE_WIDTH;

vec4 sampler_vec4(ivec2 pixel, uint index, int dimension) {
    uint block = index / uint(RANDOM_TEXTURE_POINTS);
    uvec4 bits = hash_pcg4d(uvec4(uint(pixel.x) + (uint(pixel.y) << 16u), u_seed, uint(dimension), block));
    // The shift takes the upper 24 bits of each word, the index the lower 8 of two: independent.
    uint shuffle = (bits.x & 0xffu) | ((bits.y & 0xffu) << 8u);
    int point = int((index ^ shuffle) & uint(RANDOM_TEXTURE_POINTS - 1));
    ivec3 texel = ivec3(point % RANDOM_TEXTURE_WIDTH, point / RANDOM_TEXTURE_WIDTH, dimension % RANDOM_TEXTURE_LAYERS);
    ivec4 digits = ivec4(texelFetch(u_random_texture, texel, 0)) ^ ivec4(bits >> 8u);
    return vec4(digits) * (1.0 / 16777216.0);
}
