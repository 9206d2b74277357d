// SPDX-License-Identifier: MIT
// Filter importance sampling (Ernst et al. 2006): the place in the image plane is drawn with the
// density of the filter, so every sample has the same weight and pixels stay independent.
#include "core/math.glsl"
#include "core/warp.glsl"

#define PIXEL_FILTER_BOX 0
#define PIXEL_FILTER_TENT 1
#define PIXEL_FILTER_GAUSSIAN 2
#ifndef PIXEL_FILTER
#define PIXEL_FILTER PIXEL_FILTER_BOX
#endif

// Offset from the pixel centre in pixels.
vec2 pixel_filter_sample(vec2 u) {
#if PIXEL_FILTER == PIXEL_FILTER_BOX
    return u - 0.5;
#elif PIXEL_FILTER == PIXEL_FILTER_TENT
    return square_to_tent(u);
#else
    // Standard deviation 0.5, not truncated (Box and Muller 1958).
    return 0.5 * sqrt(-2.0 * log(1.0 - u.x)) * cos_sin_turns(u.y);
#endif
}

// The other way round: the pixel, in xy, that is to have what is seen at a place in the picture, in pixels, and in z the
// sum of the filters of all pixels there, one of which is drawn in proportion to its share.
vec3 pixel_filter_pixel(vec2 place, vec2 u) {
#if PIXEL_FILTER == PIXEL_FILTER_BOX
    return vec3(floor(place), 1.0);
#elif PIXEL_FILTER == PIXEL_FILTER_TENT
    return vec3(floor(place + u - 0.5), 1.0);
#else
    vec2 pixel = floor(place);
    vec2 nearest = pixel;
    vec2 sum = vec2(0.0);
    for (int i = -4; i <= 4; i++) {  // eight standard deviations
        vec2 off = place - (nearest + float(i) + 0.5);
        vec2 density = exp(-2.0 * off * off) * sqrt(2.0 / PI);
        sum += density;
        bvec2 is_taken = lessThan(u * sum, density);
        pixel = mix(pixel, nearest + float(i), is_taken);
        u = mix((u * sum - density) / max(sum - density, vec2(1e-30)), u * sum / density, is_taken);
    }
    return vec3(pixel, sum.x * sum.y);
#endif
}
