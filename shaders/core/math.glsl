// SPDX-License-Identifier: MIT
// Small scalar and vector helpers.

float square(float x) { return x * x; }

float max_component(vec3 v) { return max(v.x, max(v.y, v.z)); }

// Relative luminance of linear Rec. 709 (ITU-R BT.709-6, section 3.2).
float luminance(vec3 color) { return dot(color, vec3(0.2126, 0.7152, 0.0722)); }

// Looks at the exponent bits, since isnan() and isinf() may be optimised away by fast-math drivers.
bool is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }
bool is_finite(vec3 v) { return is_finite(v.x) && is_finite(v.y) && is_finite(v.z); }

// Power heuristic with exponent 2 for one technique of `pdf` against another of `other`
// (Veach 1997, Robust Monte Carlo Methods, section 9.2.4). Both already carry their sample counts.
float power_heuristic(float pdf, float other) {
    if (pdf <= 0.0) return 0.0;
    float ratio = other / pdf;
    return 1.0 / (1.0 + ratio * ratio);
}
