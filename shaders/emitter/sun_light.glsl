// SPDX-License-Identifier: MIT
// A disc infinitely far away, the same radiance all over, sampled uniformly over the cone it subtends.

vec3 sun_light_sample(vec3 center, float one_minus_cos, vec2 u) {
    return frame_to_world(frame_from_normal(center), square_to_uniform_cone(u, one_minus_cos));
}

// Density over solid angle, 0 beside the disc. |a - b|^2 = 2 (1 - cos) keeps the precision that 1 - dot(a, b) loses.
float sun_light_pdf(vec3 center, float one_minus_cos, vec3 wi) {
    vec3 off = wi - center;
    return dot(off, off) <= 2.0 * one_minus_cos ? square_to_uniform_cone_pdf(one_minus_cos) : 0.0;
}
