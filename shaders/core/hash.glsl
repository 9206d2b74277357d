// SPDX-License-Identifier: MIT

// PCG in four dimensions (Jarzynski and Olano 2020, Hash Functions for GPU Rendering, listing 4).
uvec4 hash_pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Wellons 2018, Prospecting for Hash Functions (lowbias32).
uint hash_uint(uint x) {
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    return x ^ (x >> 16u);
}

// The upper 23 bits as a uniform number in [0, 1): the largest result is 1 - 2^-23.
float hash_to_unit(uint bits) { return uintBitsToFloat((bits >> 9u) | 0x3f800000u) - 1.0; }
vec4 hash_to_unit(uvec4 bits) { return uintBitsToFloat((bits >> 9u) | 0x3f800000u) - 1.0; }
