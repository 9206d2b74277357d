// SPDX-License-Identifier: MIT
// Adds the films of a list of work to the pixels that its items are of, and mixes the picture to be shown: the mean of the
// finished stages and that of this one, with weights fixed in advance.
#include "core/texels.glsl"
#include "film/film.glsl"

OUTPUT(0) out_mean;
OUTPUT(1) out_variance;
OUTPUT(2) out_half_difference;
OUTPUT(3) out_picture;

uniform highp usampler2D u_items;              // x: the first item of each pixel, y: how many
uniform highp sampler2D u_list_mean;           // the films of the items
uniform highp sampler2D u_list_variance;
uniform highp sampler2D u_list_half_difference;
uniform highp sampler2D u_finished;            // rgb: mean radiance of the finished stages, a: finite samples in them
uniform float u_stage_weight;                  // of this stage in the picture

// Items stand in blocks of 4 x 4 texels, so that those shaded together are of neighbours.
Film gather_item(int item) {
    int block = item / 16;
    int blocks = textureSize(u_list_mean, 0).x / 4;
    ivec2 texel = 4 * ivec2(block % blocks, block / blocks) + ivec2(item % 4, item / 4 % 4);
    vec4 mean = texelFetch(u_list_mean, texel, 0);
    vec4 variance = texelFetch(u_list_variance, texel, 0);
    return Film(mean.rgb, variance.rgb, texelFetch(u_list_half_difference, texel, 0).rgb, mean.a, variance.a, 0u);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Film film = film_load(pixel, 0u);
    uvec2 items = texelFetch(u_items, pixel, 0).xy;
    for (uint i = 0u; i < items.y; i++) film_merge(film, gather_item(int(items.x + i)));
    vec4 finished = texelFetch(u_finished, pixel, 0);
    output_write(out_mean, film_mean(film));
    output_write(out_variance, film_variance(film));
    output_write(out_half_difference, film_half_difference(film));
    float weight = finished.a > 0.0 ? u_stage_weight * min(film.count, 1.0) : 1.0;
    output_write(out_picture, vec4(mix(finished.rgb, film.mean, weight), finished.a + film.count));
}
