// SPDX-License-Identifier: MIT
// One pass of the bloom, as images/bloom.py defines it: bright parts at 1/4, half the size, a level with a
// coarser one over it, or a blur along one axis.
#include "core/constants.glsl"
#include "core/math.glsl"
#include "display/picture.glsl"

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
    i = (i < 0 ? -1 - i : i) % (2 * size);
    return i < size ? i : 2 * size - 1 - i;
}

vec3 bright_part(ivec2 pixel) {
    vec2 place = (vec2(mirrored(pixel.x, u_size.x), mirrored(pixel.y, u_size.y)) + 0.5) / vec2(u_size);
    vec3 x = min(expose(nearest_radiance(place), u_exposure), 1e30);
    return x * max(1.0 - u_threshold / max(luminance(x), 1e-30), 0.0);
}

// The mean of 4 x 4 pixels; of four of them, in a film that has less than one texel for each.
vec3 bright(ivec2 texel) {
    const int stride = FILM_FITS == 1 ? 1 : 2;
    vec3 sum = vec3(0.0);
    for (int y = 0; y < 4; y += stride) {
        for (int x = 0; x < 4; x += stride) sum += bright_part(4 * texel + ivec2(x, y));
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

vec3 level_at(ivec2 texel) {
    ivec2 size = textureSize(u_level, 0);
    return texelFetch(u_level, ivec2(mirrored(texel.x, size.x), mirrored(texel.y, size.y)), 0).rgb;
}

vec3 blurred(ivec2 texel) {
#if BLOOM_PASS == BLOOM_BLUR_X
    const ivec2 axis = ivec2(1, 0);
#else
    const ivec2 axis = ivec2(0, 1);
#endif
    vec3 sum = u_weights[0] * level_at(texel);
    for (int i = 1; i <= BLOOM_RADIUS; i++) sum += u_weights[i] * (level_at(texel + i * axis) + level_at(texel - i * axis));
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
