// SPDX-License-Identifier: MIT
// What a fragment works on: its own pixel, or, where samples are spread unevenly, an item of a list: some samples of one
// pixel, as many for each item, so that no lane waits for another. Light in parts is sampled evenly: its layers have the
// texture unit of the list.
#include "film/parts.glsl"

// x: the pixel, its row in the upper 16 bits, and in the highest bit of each half whether it takes the random numbers of
// the block of 2 x 2 pixels that it is in, and whether such blocks begin at odd pixels (sampling/gradients.py); y: the
// number of the first sample.
uniform highp usampler2D u_work;
uniform int u_has_work;

struct Work {
    ivec2 pixel;
    ivec2 numbers;  // whose random numbers it takes: its pixel, or a name of the block that this is in
    uint first_sample;
};

Work work_load(ivec2 texel) {
    if (FILM_LIGHT == FILM_LIGHT_PARTS || u_has_work == 0) return Work(texel, texel, 0u);
    uvec2 item = texelFetch(u_work, texel, 0).xy;
    ivec2 pixel = ivec2(item.x & 0x7fffu, item.x >> 16u & 0x7fffu);
    int shift = int(item.x >> 31u);
    ivec2 block = ((pixel + shift) >> 1) + ivec2(shift << 15, 0);
    return Work(pixel, (item.x & 0x8000u) != 0u ? block : pixel, item.y);
}
