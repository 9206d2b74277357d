// SPDX-License-Identifier: MIT
// What a fragment works on: its own pixel, or, where samples are spread unevenly, an item of a list: some samples of one
// pixel, as many for each item, so that no lane waits for another. Light in parts is sampled evenly: its layers have the
// texture unit of the list.
#include "film/parts.glsl"

uniform highp usampler2D u_work;  // x: the pixel, its row in the upper 16 bits; y: the number of the first sample
uniform int u_has_work;

struct Work { ivec2 pixel; uint first_sample; };

Work work_load(ivec2 texel) {
    if (FILM_LIGHT == FILM_LIGHT_PARTS || u_has_work == 0) return Work(texel, 0u);
    uvec2 item = texelFetch(u_work, texel, 0).xy;
    return Work(ivec2(item.x & 0xffffu, item.x >> 16u), item.y);
}
