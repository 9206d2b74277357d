// SPDX-License-Identifier: MIT
// The film of paths with the light of photons added, to be shown (light_tracing/picture.py): the standard error is that of
// both.
#include "core/texels.glsl"
#include "film/film.glsl"

OUTPUT(0) out_mean;
OUTPUT(1) out_variance;
OUTPUT(2) out_half_difference;

uniform highp sampler2D u_light;             // rgb: radiance that photons bring
uniform highp sampler2D u_light_difference;  // rgb: half the difference of that of both halves of them
uniform highp sampler2D u_light_variance;    // rgb: of u_light, as of independent photons

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Film film = film_load(pixel, 0u);
    vec3 light = texelFetch(u_light, pixel, 0).rgb;
    film.mean += light;
    film.variance += texelFetch(u_light_variance, pixel, 0).rgb * max(film.count - 1.0, 0.0);
    // Of two streams of samples one may have one more.
    float odd = mod(film.count, 2.0) / max(film.count, 1.0);
    film.half_difference += texelFetch(u_light_difference, pixel, 0).rgb + light * odd;
    output_write(out_mean, film_mean(film));
    output_write(out_variance, film_variance(film));
    output_write(out_half_difference, film_half_difference(film));
}
