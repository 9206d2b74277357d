// SPDX-License-Identifier: MIT
// One pixel's running mean, variance and half-difference. Every sample updates them by its share, so float32
// neither drifts nor stalls, and the result does not depend on how samples are cut into passes.
//
// Samples belong to two streams in turns, which are independent randomisations of the sampler. Half the difference of
// their means has the variance of the mean of all, stratification included, which the variance between samples does not
// know of (independent replications: Owen 2013, Monte Carlo Theory, Methods and Examples, chapter 17).
#include "core/math.glsl"
#include "sampler/stream.glsl"

uniform highp sampler2D u_film_mean;             // rgb: mean radiance, a: number of finite samples
uniform highp sampler2D u_film_variance;         // rgb: sample variance, a: number of samples that are not finite
uniform highp sampler2D u_film_half_difference;  // rgb: mean of the samples with alternating signs
uniform int u_stage;                             // whose samples the film holds

struct Film {
    vec3 mean;
    vec3 variance;
    vec3 half_difference;
    float count;       // of finite samples
    float non_finite;
    uint next;         // the number of its next sample
};

// The film of a texel, whose samples are numbered from `first` on.
Film film_load(ivec2 texel, uint first) {
    vec4 mean = texelFetch(u_film_mean, texel, 0);
    vec4 variance = texelFetch(u_film_variance, texel, 0);
    vec3 half_difference = texelFetch(u_film_half_difference, texel, 0).rgb;
    return Film(mean.rgb, variance.rgb, half_difference, mean.a, variance.a, first + uint(max(mean.a + variance.a, 0.0)));
}

// The sampler's index of the next sample.
uint film_sampler_index(Film film) {
    return sampler_stream_index(2u * uint(u_stage) + (film.next & 1u), film.next >> 1u);
}

// Adds a sample where a path `has_ended`. Welford 1962, Note on a Method for Calculating Corrected Sums of Squares and
// Products, with the sum of squares divided by the count. Samples that are not finite are counted apart. There is no
// branch, in which a software renderer would mask every assignment: what is not added is the mean, with no share.
void film_add_if(bool has_ended, inout Film film, vec3 radiance) {
    bool adds = has_ended && film.count >= 0.0;
    bool counts = adds && is_finite(radiance);
    film.count += counts ? 1.0 : 0.0;
    film.non_finite += adds && !counts ? 1.0 : 0.0;
    float share = counts ? 1.0 / film.count : 0.0;
    if (!counts) radiance = film.mean;
    vec3 delta = radiance - film.mean;
    film.mean += delta * share;
    film.variance += (delta * (radiance - film.mean) - film.variance) * share;
    film.half_difference += (((film.next & 1u) == 0u ? radiance : -radiance) - film.half_difference) * share;
    film.next += has_ended ? 1u : 0u;
}

void film_add(inout Film film, vec3 radiance) { film_add_if(true, film, radiance); }

// Adds all samples of another film (Chan, Golub and LeVeque 1983, Algorithms for Computing the Sample Variance).
void film_merge(inout Film film, Film other) {
    if (film.count < 0.0) return;
    film.non_finite += other.non_finite;
    if (other.count <= 0.0) return;
    float count = film.count + other.count;
    float share = other.count / count;
    vec3 delta = other.mean - film.mean;
    film.variance += (other.variance - film.variance + delta * delta * (1.0 - share)) * share;
    film.mean += delta * share;
    film.half_difference += (other.half_difference - film.half_difference) * share;
    film.count = count;
}

// Marks the pixel as one that has not had the samples asked for, which it stays whatever is added.
void film_invalidate(inout Film film) { film.count = film.non_finite = -1.0; }

vec4 film_mean(Film film) { return vec4(film.mean, film.count); }
vec4 film_variance(Film film) { return vec4(film.variance, film.non_finite); }
vec4 film_half_difference(Film film) { return vec4(film.half_difference, 0.0); }
