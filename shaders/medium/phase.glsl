// SPDX-License-Identifier: MIT
// The phase function of Henyey and Greenstein (1941, Diffuse Radiation in the Galaxy): how much light is scattered by an
// angle whose cosine has the mean g. Directions leave the point: light goes on straight where wi = -wo.
#include "core/constants.glsl"
#include "core/frame.glsl"
#include "core/math.glsl"

// 1/sr, of phase_sample() too. 1 + g^2 - 2 g cos is written as a sum, of which nothing cancels.
float phase_eval(float g, vec3 wo, vec3 wi) {
    vec3 aside = g > 0.0 ? wo + wi : wo - wi;
    float s = square(1.0 - abs(g)) + abs(g) * dot(aside, aside);
    return 0.25 * INVERSE_PI * (1.0 - g * g) / (s * sqrt(s));
}

// Its inverse distribution, written so that nothing cancels where g is near 0.
vec3 phase_sample(float g, vec3 wo, vec2 u) {
    float s = 2.0 * u.y - 1.0;
    float cos_theta = (s + 0.5 * g * (s * s + 3.0) + g * g * s + 0.5 * g * g * g * (s * s - 1.0)) / square(1.0 + g * s);
    float sin_theta = sqrt(max(0.0, 1.0 - cos_theta * cos_theta));
    return frame_to_world(frame_from_normal(-wo), vec3(sin_theta * cos_sin_turns(u.x), min(cos_theta, 1.0)));
}
