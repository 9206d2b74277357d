// SPDX-License-Identifier: MIT
// Small scalar and vector helpers.
#include "core/constants.glsl"

float square(float x) { return x * x; }

float max_component(vec3 v) { return max(v.x, max(v.y, v.z)); }

// Relative luminance of linear Rec. 709 (ITU-R BT.709-6, section 3.2).
float luminance(vec3 color) { return dot(color, vec3(0.2126, 0.7152, 0.0722)); }

// Looks at the exponent bits, since isnan() and isinf() may be optimised away by fast-math drivers.
bool is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }
bool is_finite(vec3 v) {
    uvec3 exponents = floatBitsToUint(v) & 0x7f800000u;
    return max(exponents.x, max(exponents.y, exponents.z)) != 0x7f800000u;
}

// The sine of an angle given in turns, -0.25 <= turns <= 0.25, to 3e-7 of itself: a minimax polynomial. Drivers differ in
// sin() and cos(), some make them slow, and their error need not be smaller where the sine is.
float sin_quarter(float turns) {
    float x2 = turns * turns;
    return turns * (6.2831852 + x2 * (-41.341655 + x2 * (81.601004 + x2 * (-76.549782 + x2 * 39.536702))));
}

// (cos, sin) of an angle given in turns, 0 <= turns <= 1, to 3e-7.
vec2 cos_sin_turns(float turns) {
    float x = abs(turns - 0.5) - 0.25;
    float s = sin_quarter(0.25 - abs(x));
    return vec2(sin_quarter(x), turns < 0.5 ? s : -s);
}

// The angle of a vector in turns, -0.5 to 0.5, to 5e-8: an odd minimax polynomial of atan(t) / 2 pi on [0, 1].
// GLSL allows atan() an error of 4096 units in the last place.
float turns_of(vec2 v) {
    vec2 a = abs(v);
    float t = min(a.x, a.y) / max(max(a.x, a.y), 1e-37);
    float t2 = t * t;
    float p = 0.015346031 + t2 * (-0.008898719 + t2 * (0.0034795953 + t2 * -0.00064530375));
    p = t * (0.15915483 + t2 * (-0.053046122 + t2 * (0.031745944 + t2 * (-0.02213627 + t2 * p))));
    p = a.y > a.x ? 0.25 - p : p;
    p = v.x < 0.0 ? 0.5 - p : p;
    return v.y < 0.0 ? -p : p;
}

// Chooses one of two alternatives, the first with the given probability, and stretches u so that it
// is uniform in [0, 1) again: one number serves both (Shirley et al. 1996, section 3.3).
bool choose_first(float probability, inout float u) {
    bool first = u < probability;
    u = (first ? u : u - probability) / (first ? probability : 1.0 - probability);
    u = min(u, ONE_MINUS_EPSILON);
    return first;
}

// Power heuristic with exponent 2 for one technique of `pdf` against another of `other`
// (Veach 1997, Robust Monte Carlo Methods, section 9.2.4). Both already carry their sample counts.
float power_heuristic(float pdf, float other) {
    if (pdf <= 0.0) return 0.0;
    float ratio = other / pdf;
    return 1.0 / (1.0 + ratio * ratio);
}
