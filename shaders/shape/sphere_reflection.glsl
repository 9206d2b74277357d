// SPDX-License-Identifier: MIT
// Where a sphere reflects light from one point to another: Alhazen's problem.

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
    float whole = atan(between.y, between.x);
    float low = max(0.0, whole - acos(min(1.0 / length_b, 1.0)));
    float high = min(whole, acos(min(1.0 / length_a, 1.0)));
    bool is_seen = length_a > 1.0 && length_b > 1.0 && low <= high;
    float angle = clamp(whole * (length_a - 1.0) / (length_a + length_b - 2.0), low, high);
    for (int i = 0; i < 8; i++) {
        vec2 turn = vec2(cos(angle), sin(angle));
        vec2 back = vec2(dot(between, turn), between.y * turn.x - between.x * turn.y);
        vec2 to_a = length_a * turn - vec2(1.0, 0.0);  // from the place; x along its normal
        vec2 to_b = length_b * back - vec2(1.0, 0.0);
        float squared_a = dot(to_a, to_a), squared_b = dot(to_b, to_b);
        float difference = (to_a.y * to_b.x - to_a.x * to_b.y) * inversesqrt(squared_a * squared_b);
        float slope = length_a * (length_a - turn.x) / squared_a + length_b * (length_b - back.x) / squared_b;
        if (difference < 0.0) low = angle;
        else high = angle;
        float next = angle - difference / slope;
        angle = next >= low && next <= high ? next : 0.5 * (low + high);
    }
    vec3 normal = cos(angle) * x + (height > 0.0 ? sin(angle) / height * across : vec3(0.0));
    return is_seen ? normal : vec3(0.0);
}
