// SPDX-License-Identifier: MIT
// The film of paths with the light of photons added, to be shown (light_tracing/picture.py): the standard error is that of
// both.
#include "core/texels.glsl"
#include "film/film.glsl"

OUTPUT(0) out_mean;
OUTPUT(1) out_variance;
OUTPUT(2) out_half_difference;

uniform highp sampler2D u_light_even;     // rgb: sums of the radiance of photons, of passes with even numbers,
uniform highp sampler2D u_light_odd;      // of those with odd ones,
uniform highp sampler2D u_light_squares;  // and of its squares, of all passes
uniform int u_light_passes;
uniform float u_light_photons;            // of a pass

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Film film = film_load(pixel, 0u);
    float passes = float(max(u_light_passes, 1));
    float photons = passes * u_light_photons;
    vec3 even = texelFetch(u_light_even, pixel, 0).rgb / photons;
    vec3 odd = texelFetch(u_light_odd, pixel, 0).rgb / photons;
    vec3 light = even + odd;
    film.mean += light;
    film.variance += texelFetch(u_light_squares, pixel, 0).rgb / (photons * photons) * max(film.count - 1.0, 0.0);
    // Of two streams one may have one more: a pass of photons, a sample of a path.
    film.half_difference += even - odd + light * (mod(film.count, 2.0) / max(film.count, 1.0) - mod(passes, 2.0) / passes);
    output_write(out_mean, film_mean(film));
    output_write(out_variance, film_variance(film));
    output_write(out_half_difference, film_half_difference(film));
}
