// SPDX-License-Identifier: MIT
// The table to choose among all lights. The record of each kind stands in its own file, light/KIND.glsl.
#include "scene/storage.glsl"

uniform int u_light_count;
uniform int u_first_light_choice;  // texel of u_scene where the table begins

// A light, and a row of the guide table that finds it (light/light.glsl).
struct LightChoice {
    float cumulative;  // probability of all lights before this one
    float probability;
    int kind;
    int record;  // of its kind's table
    int guide_first;  // row i: the lights that u from i / count to (i + 1) / count chooses
    int guide_last;
};
LightChoice light_choice_of(uvec4 t0, uvec4 t1) {
    return LightChoice(uintBitsToFloat(t0.x), uintBitsToFloat(t0.y), int(t0.z), int(t0.w), int(t1.x), int(t1.y));
}
LightChoice light_choice_load(int index) {
    int first = u_first_light_choice + 2 * index;
    return light_choice_of(scene_texel(first), scene_texel(first + 1));
}
