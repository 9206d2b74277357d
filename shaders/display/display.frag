// SPDX-License-Identifier: MIT
// From the film to the window: exposure, glare, tone curve, transfer function, and false colours of what
// the film knows besides the mean. No light transport. The chain is that of display/look.py.
#include "core/constants.glsl"
#include "core/math.glsl"
#include "display/picture.glsl"
#include "display/tone.glsl"

#define VIEW_RADIANCE 0
#define VIEW_SAMPLES 1
#define VIEW_ERROR 2
#define VIEW_NON_FINITE 3
#define VIEW_DATA 4  // the mean is to be shown as it is
#define VIEW_DEPTH 5
#define VIEW_ALBEDO 6
#define VIEW_BLOOM 7
#ifndef VIEW
#define VIEW VIEW_RADIANCE
#endif
#ifndef HAS_GAMMA
#define HAS_GAMMA 0
#endif
#ifndef HAS_BLOOM
#define HAS_BLOOM 0
#endif

uniform highp sampler2D u_film_variance;  // rgb: sample variance, a: number of non-finite samples
uniform highp sampler2D u_bloom;
uniform vec2 u_bloom_size;   // texels of it that the picture covers
uniform float u_bloom_strength;
uniform vec4 u_rectangle;  // of the picture in the window: left, bottom, width, height
uniform float u_exposure;  // factor
uniform float u_inverse_gamma;
uniform float u_range;     // the value that the top of a false-colour scale stands for

layout(location = 0) out vec4 out_color;

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

vec3 to_screen(vec3 radiance, vec2 place) {
    vec3 exposed = expose(radiance, u_exposure);
#if HAS_BLOOM
    vec3 glare = u_bloom_strength * fetch_between(u_bloom, place * u_bloom_size).rgb;
#if VIEW == VIEW_BLOOM
    exposed = glare;
#else
    exposed = min(exposed + glare, 3e38);
#endif
#endif
    vec3 shown = srgb_encode(clamp(tone_curve(exposed), 0.0, 1.0));
#if HAS_GAMMA
    shown = pow(shown, vec3(u_inverse_gamma));
#endif
    return is_finite(radiance) ? shown : vec3(1.0, 0.0, 1.0);
}

vec3 view(vec2 place, vec4 mean) {
#if VIEW == VIEW_SAMPLES
    return false_color(mean.a / u_range);
#elif VIEW == VIEW_ERROR
    vec3 variance = max(fetch(u_film_variance, place).rgb, 0.0);
    float error = dot(sqrt(variance / max(mean.a - 1.0, 1.0)), vec3(1.0 / 3.0));
    return false_color(error / (u_range * max(dot(mean.rgb, vec3(1.0 / 3.0)), 1e-6)));
#elif VIEW == VIEW_NON_FINITE
    return fetch(u_film_variance, place).a > 0.0 ? vec3(1.0, 0.0, 1.0) : 0.25 * to_screen(mean.rgb, place);
#elif VIEW == VIEW_DATA
    return clamp(mean.rgb, 0.0, 1.0);
#elif VIEW == VIEW_ALBEDO
    return srgb_encode(clamp(mean.rgb, 0.0, 1.0));
#elif VIEW == VIEW_DEPTH
    return vec3(mean.r > 0.0 ? 1.0 - min(mean.r / u_range, 1.0) : 0.0);
#else
    return to_screen(mean.rgb, place);
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
    if (place.x > u_wipe) out_color.rgb = to_screen(fetch_smoothly(u_other, place).rgb, place);
#endif
}
