// SPDX-License-Identifier: MIT
// From the film to the window: exposure, tone curve, transfer function, and false colours of what the
// film knows besides the mean. No light transport. The curves are those of images/tone.py.

uniform highp sampler2D u_film_mean;      // rgb: mean radiance, a: number of finite samples
uniform highp sampler2D u_film_variance;  // rgb: sample variance, a: number of non-finite samples
uniform highp sampler2D u_held;           // the mean of before, shown until this one is finer
uniform highp sampler2D u_other;          // a picture to compare with, beyond the wipe
uniform float u_held_weight;
uniform vec4 u_rectangle;  // of the picture in the window: left, bottom, width, height
uniform float u_wipe;      // share of the width that shows the film
uniform float u_exposure;  // factor
uniform float u_inverse_gamma;
uniform float u_range;     // the value that the top of a false-colour scale stands for

layout(location = 0) out vec4 out_color;

// Narkowicz 2015, ACES Filmic Tone Mapping Curve.
vec3 tone_aces(vec3 x) {
    x = min(x, 1e6);
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
}

// Sobotka's AgX in the fit of Wrensch 2023, Minimal AgX Implementation: an inset, a curve over 16.5
// stops, and the outset; a power of 2.2 makes the result linear again.
vec3 tone_agx(vec3 x) {
    const mat3 inset = mat3(
        0.842479062253094, 0.0423282422610123, 0.0423756549057051,
        0.0784335999999992, 0.878468636469772, 0.0784336,
        0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    const mat3 outset = mat3(
        1.19687900512017, -0.0528968517574562, -0.0529716355144438,
        -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
        -0.0990297440797205, -0.0989611768448433, 1.15107367264116);
    vec3 stops = clamp(log2(max(inset * x, 1e-10)), -12.47393, 4.026069);
    x = (stops + 12.47393) / 16.5;
    x = ((((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x) + 0.1191) * x - 0.00232;
    return pow(max(outset * x, 0.0), vec3(2.2));
}

vec3 tone_curve(vec3 x) {
#if TONE_CURVE == TONE_REINHARD
    return x / (1.0 + x);
#elif TONE_CURVE == TONE_ACES
    return tone_aces(x);
#elif TONE_CURVE == TONE_AGX
    return tone_agx(x);
#else
    return x;
#endif
}

// IEC 61966-2-1.
vec3 srgb_encode(vec3 x) {
    vec3 curve = 1.055 * pow(max(x, 1e-6), vec3(1.0 / 2.4)) - 0.055;
    return mix(curve, 12.92 * x, vec3(lessThanEqual(x, vec3(0.0031308))));
}

// Smooth between the texels of a picture that is not as large as its place in the window.
vec4 fetch_smoothly(highp sampler2D image, vec2 place) {
    ivec2 last = textureSize(image, 0) - 1;
    vec2 texel = place * vec2(last + 1) - 0.5;
    vec2 low = floor(texel);
    vec2 t = texel - low;
    ivec2 a = clamp(ivec2(low), ivec2(0), last);
    ivec2 b = clamp(ivec2(low) + 1, ivec2(0), last);
    vec4 below = mix(texelFetch(image, a, 0), texelFetch(image, ivec2(b.x, a.y), 0), t.x);
    vec4 above = mix(texelFetch(image, ivec2(a.x, b.y), 0), texelFetch(image, b, 0), t.x);
    return mix(below, above, t.y);
}

vec4 fetch(highp sampler2D image, vec2 place) {
#if FILM_FITS
    return texelFetch(image, ivec2(place * u_rectangle.zw), 0);
#else
    return fetch_smoothly(image, place);
#endif
}

// Black, blue, green, yellow, red, white: a scale that reads from dark to bright.
vec3 false_color(float x) {
    vec3 low = mix(vec3(0.05, 0.03, 0.2), vec3(0.1, 0.45, 0.75), clamp(x * 3.0, 0.0, 1.0));
    vec3 middle = mix(low, vec3(0.45, 0.8, 0.3), clamp(x * 3.0 - 1.0, 0.0, 1.0));
    return mix(middle, vec3(1.0, 0.85, 0.2), clamp(x * 3.0 - 2.0, 0.0, 1.0));
}

vec3 to_screen(vec3 radiance) {
    vec3 shown = clamp(tone_curve(min(max(radiance, 0.0) * u_exposure, 3e38)), 0.0, 1.0);
#if HAS_GAMMA
    return pow(srgb_encode(shown), vec3(u_inverse_gamma));
#else
    return srgb_encode(shown);
#endif
}

vec3 view(vec2 place, vec4 mean) {
#if VIEW == VIEW_SAMPLES
    return false_color(mean.a / u_range);
#elif VIEW == VIEW_ERROR
    vec3 variance = max(fetch(u_film_variance, place).rgb, 0.0);
    float error = dot(sqrt(variance / max(mean.a - 1.0, 1.0)), vec3(1.0 / 3.0));
    return false_color(error / (u_range * max(dot(mean.rgb, vec3(1.0 / 3.0)), 1e-6)));
#elif VIEW == VIEW_NON_FINITE
    return fetch(u_film_variance, place).a > 0.0 ? vec3(1.0, 0.0, 1.0) : 0.25 * to_screen(mean.rgb);
#elif VIEW == VIEW_DATA
    return clamp(mean.rgb, 0.0, 1.0);
#elif VIEW == VIEW_ALBEDO
    return srgb_encode(clamp(mean.rgb, 0.0, 1.0));
#elif VIEW == VIEW_DEPTH
    return vec3(mean.r > 0.0 ? 1.0 - min(mean.r / u_range, 1.0) : 0.0);
#else
    return to_screen(mean.rgb);
#endif
}

void main() {
    vec2 place = (gl_FragCoord.xy - u_rectangle.xy) / u_rectangle.zw;
    vec4 mean = fetch(u_film_mean, place);
#if HAS_HELD
    mean.rgb = mix(mean.rgb, fetch_smoothly(u_held, place).rgb, u_held_weight);
#endif
    out_color = vec4(view(place, mean), 1.0);
#if HAS_OTHER
    if (place.x > u_wipe) out_color.rgb = to_screen(fetch_smoothly(u_other, place).rgb);
#endif
}
