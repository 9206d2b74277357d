// SPDX-License-Identifier: MIT
// What the window shows before exposure: the film, what it showed before, and a picture to compare with.
#include "core/math.glsl"

#ifndef FILM_FITS
#define FILM_FITS 1  // the film has a texel for each pixel of the picture
#endif
#ifndef HAS_HELD
#define HAS_HELD 0
#endif
#ifndef HAS_OTHER
#define HAS_OTHER 0
#endif

uniform highp sampler2D u_film_mean;  // rgb: mean radiance, a: number of finite samples
uniform highp sampler2D u_held;       // the mean of before, shown until this one is finer
uniform highp sampler2D u_other;      // a picture to compare with, beyond the wipe
uniform float u_held_weight;
uniform float u_wipe;                 // share of the width that shows the film

// Smooth between the texels; `texel` counts from the lower left corner.
vec4 fetch_between(highp sampler2D image, vec2 texel) {
    ivec2 last = textureSize(image, 0) - 1;
    vec2 low = floor(texel - 0.5);
    vec2 t = texel - 0.5 - low;
    ivec2 a = clamp(ivec2(low), ivec2(0), last);
    ivec2 b = clamp(ivec2(low) + 1, ivec2(0), last);
    vec4 below = mix(texelFetch(image, a, 0), texelFetch(image, ivec2(b.x, a.y), 0), t.x);
    vec4 above = mix(texelFetch(image, ivec2(a.x, b.y), 0), texelFetch(image, b, 0), t.x);
    return mix(below, above, t.y);
}

// `place` is from (0, 0) to (1, 1).
vec4 fetch_smoothly(highp sampler2D image, vec2 place) { return fetch_between(image, place * vec2(textureSize(image, 0))); }

// For sums over many pixels, where smoothness is not needed.
vec3 fetch_nearest(highp sampler2D image, vec2 place) {
    return texelFetch(image, ivec2(place * vec2(textureSize(image, 0))), 0).rgb;
}

// Of a pixel of the picture, whose middle is at `place`.
vec3 nearest_radiance(ivec2 pixel, vec2 place) {
#if HAS_OTHER
    if (place.x > u_wipe) return fetch_nearest(u_other, place);
#endif
#if FILM_FITS
    vec3 radiance = texelFetch(u_film_mean, pixel, 0).rgb;
#else
    vec3 radiance = fetch_nearest(u_film_mean, place);
#endif
#if HAS_HELD
    radiance = mix(radiance, fetch_nearest(u_held, place), u_held_weight);
#endif
    return radiance;
}

// Exposed radiance; black where it is not finite. `exposure` is a factor.
vec3 expose(vec3 radiance, float exposure) {
    return is_finite(radiance) ? min(max(radiance, 0.0) * exposure, 3e38) : vec3(0.0);
}
