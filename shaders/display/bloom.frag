// SPDX-License-Identifier: MIT
// One pass of the bloom, as display/bloom.py defines it: bright parts at 1/4, half the size, a level with a
// coarser one over it, or a blur along one axis.
#include "core/constants.glsl"
#include "core/math.glsl"
#include "display/picture.glsl"

#define BLOOM_BRIGHT 0
#define BLOOM_HALF 1
#define BLOOM_ADD 2
#define BLOOM_BLUR_X 3
#define BLOOM_BLUR_Y 4
#ifndef BLOOM_PASS
#define BLOOM_PASS BLOOM_BRIGHT
#endif
#ifndef BLOOM_RADIUS
#define BLOOM_RADIUS 2  // taps of a blur to one side
#endif

uniform highp sampler2D u_level;   // what this pass reads
uniform highp sampler2D u_coarse;  // a level of half the size
uniform ivec2 u_size;              // of the picture in pixels
uniform float u_exposure;
uniform float u_threshold;
uniform float u_weights[BLOOM_RADIUS + 1];  // of the middle tap and those to one side
uniform float u_factor;

layout(location = 0) out vec4 out_level;

// Index i of a row of `size` that is mirrored without end, its last texels repeated first.
int mirrored(int i, int size) {
    float period = 2.0 * float(size);  // in floats: a division of integers is slow
    float x = float(i < 0 ? -1 - i : i) + 0.5;
    x -= period * floor(x / period);
    return int(min(x, period - x));
}

vec3 bright_part(ivec2 pixel, vec2 scale) {
    vec3 x = min(expose(nearest_radiance(pixel, (vec2(pixel) + 0.5) * scale), u_exposure), 1e30);
    return x * max(1.0 - u_threshold / max(luminance(x), 1e-30), 0.0);
}

// The mean of 4 x 4 pixels; of four of them, in a film that has less than one texel for each.
vec3 bright(ivec2 texel) {
    const int stride = FILM_FITS == 1 ? 1 : 2;
    vec2 scale = 1.0 / vec2(u_size);
    int columns[4];
    for (int x = 0; x < 4; x++) columns[x] = mirrored(4 * texel.x + x, u_size.x);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < 4; y += stride) {
        int row = mirrored(4 * texel.y + y, u_size.y);
        for (int x = 0; x < 4; x += stride) sum += bright_part(ivec2(columns[x], row), scale);
    }
    return sum * (float(stride * stride) / 16.0);
}

vec3 halved(ivec2 texel) {
    ivec2 first = 2 * texel;
    vec3 below = texelFetch(u_level, first, 0).rgb + texelFetch(u_level, first + ivec2(1, 0), 0).rgb;
    vec3 above = texelFetch(u_level, first + ivec2(0, 1), 0).rgb + texelFetch(u_level, first + ivec2(1, 1), 0).rgb;
    return 0.25 * (below + above);
}

vec3 with_coarse(ivec2 texel) {
    return texelFetch(u_level, texel, 0).rgb + fetch_between(u_coarse, 0.5 * (vec2(texel) + 0.5)).rgb;
}

// The texel `offset` further along the axis of this pass.
vec3 level_at(ivec2 texel, int offset) {
    ivec2 size = textureSize(u_level, 0);
#if BLOOM_PASS == BLOOM_BLUR_X
    texel.x = mirrored(texel.x + offset, size.x);
#else
    texel.y = mirrored(texel.y + offset, size.y);
#endif
    return texelFetch(u_level, texel, 0).rgb;
}

vec3 blurred(ivec2 texel) {
    vec3 sum = u_weights[0] * level_at(texel, 0);
    for (int i = 1; i <= BLOOM_RADIUS; i++) sum += u_weights[i] * (level_at(texel, i) + level_at(texel, -i));
    return u_factor * sum;
}

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
#if BLOOM_PASS == BLOOM_BRIGHT
    out_level = vec4(bright(texel), 1.0);
#elif BLOOM_PASS == BLOOM_HALF
    out_level = vec4(halved(texel), 1.0);
#elif BLOOM_PASS == BLOOM_ADD
    out_level = vec4(with_coarse(texel), 1.0);
#else
    out_level = vec4(blurred(texel), 1.0);
#endif
}
