// SPDX-License-Identifier: MIT
// Where a sphere reflects light from one point to another: Alhazen's problem.
#include "core/constants.glsl"
#include "core/math.glsl"

// The unit vector from the centre of a sphere of radius 1 to where light from `a` is reflected to `b`, which are relative to
// it; 0 where there is no such place outside. It lies in their plane, at the angle from `a` where incidence and reflection
// are alike: one grows with the angle and the other falls, between the ends from which `a` or `b` is hidden. By Newton's
// method on the sine of their difference: 8 steps are enough for float32.
vec3 sphere_reflection_normal(vec3 a, vec3 b) {
    float length_a = length(a), length_b = length(b);
    vec3 x = a / length_a;
    vec3 across = b - dot(b, x) * x;
    float height = length(across);
    vec2 between = vec2(dot(b, x), height) / length_b;
    // Angles are in turns.
    float whole = turns_of(between);
    vec2 end = min(1.0 / vec2(length_a, length_b), 1.0);
    vec2 seen = sqrt(1.0 - end * end);
    float low = max(0.0, whole - turns_of(vec2(end.y, seen.y)));
    float high = min(whole, turns_of(vec2(end.x, seen.x)));
    bool is_seen = length_a > 1.0 && length_b > 1.0 && low <= high;
    float angle = clamp(whole * (length_a - 1.0) / (length_a + length_b - 2.0), low, high);
    for (int i = 0; i < 8; i++) {
        vec2 turn = cos_sin_turns(angle);
        vec2 back = vec2(dot(between, turn), between.y * turn.x - between.x * turn.y);
        vec2 to_a = length_a * turn - vec2(1.0, 0.0);  // from the place; x along its normal
        vec2 to_b = length_b * back - vec2(1.0, 0.0);
        float squared_a = dot(to_a, to_a), squared_b = dot(to_b, to_b);
        float difference = (to_a.y * to_b.x - to_a.x * to_b.y) * inversesqrt(squared_a * squared_b);
        float slope = length_a * (length_a - turn.x) / squared_a + length_b * (length_b - back.x) / squared_b;
        if (difference < 0.0) low = angle;
        else high = angle;
        float next = angle - difference / (2.0 * PI * slope);
        angle = next >= low && next <= high ? next : 0.5 * (low + high);
    }
    vec2 turn = cos_sin_turns(angle);
    vec3 normal = turn.x * x + (height > 0.0 ? turn.y / height * across : vec3(0.0));
    return is_seen ? normal : vec3(0.0);
}
