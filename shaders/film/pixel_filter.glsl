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
