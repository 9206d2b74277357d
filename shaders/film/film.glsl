// SPDX-License-Identifier: MIT
// One pixel's running mean and variance. Every sample updates the mean by its share, so float32
// neither drifts nor stalls, and the result does not depend on how samples are cut into passes.
#include "core/math.glsl"

uniform highp sampler2D u_film_mean;      // rgb: mean radiance, a: number of finite samples
uniform highp sampler2D u_film_variance;  // rgb: sample variance, a: number of samples that are not finite

struct Film { vec3 mean; vec3 variance; float count; float non_finite; };

Film film_load(ivec2 pixel) {
    vec4 mean = texelFetch(u_film_mean, pixel, 0);
    vec4 variance = texelFetch(u_film_variance, pixel, 0);
    return Film(mean.rgb, variance.rgb, mean.a, variance.a);
}

// The number of samples this pixel has had, which is the index of its next one.
uint film_sample_index(Film film) { return uint(film.count + film.non_finite); }

// Welford 1962, Note on a Method for Calculating Corrected Sums of Squares and Products, with the
// sum of squares divided by the count. Samples that are not finite are counted apart.
void film_add(inout Film film, vec3 radiance) {
    if (!is_finite(radiance)) {
        film.non_finite += 1.0;
        return;
    }
    film.count += 1.0;
    float share = 1.0 / film.count;
    vec3 delta = radiance - film.mean;
    film.mean += delta * share;
    film.variance += (delta * (radiance - film.mean) - film.variance) * share;
}

// Marks the pixel as one that has not had the samples asked for.
void film_invalidate(inout Film film) { film.count = film.non_finite = -1.0; }

vec4 film_mean(Film film) { return vec4(film.mean, film.count); }
vec4 film_variance(Film film) { return vec4(film.variance, film.non_finite); }
