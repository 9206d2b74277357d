// SPDX-License-Identifier: MIT
#include "core/hash.glsl"

// A uniform number from two words and the sample index. All 64 bits of the words count: numbers from a smaller set
// would be shared by pixels and seeds, and the roulette biased by what that set happens to hold.
float sampler_rr_sample(uvec4 bits, uint index) {
    return hash_to_unit(hash_uint(bits.z ^ hash_uint(bits.w + index)));
}
