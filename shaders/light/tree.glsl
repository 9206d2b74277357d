// SPDX-License-Identifier: MIT
// Choice of one of many lights by what they bring to a point, by going down a binary tree (Estevez and Kulla 2018,
// Importance Sampling of Many Lights with Adaptive Tree Splitting). A child brings its power over the mean squared distance
// of its lights, which is known of all of them at once: the squared distance of their mean place, and their spread
// around it. Neither directions nor what is between are looked at, so that a part of each probability is by power alone.
//
// The way ends at a light, or where the lights below are about as far away as each other: those are chosen by power. So
// what it costs depends on how near lights are, and hardly on how many there are.
#include "core/math.glsl"
#include "scene/storage.glsl"

uniform int u_light_tree_count;          // lights of the tree, the first of all, in its order; 0: there is no tree
uniform float u_light_tree_probability;  // that one of them is chosen
uniform int u_first_light_node;          // texel of u_scene where its nodes begin, the root first

const float LIGHT_TREE_BY_POWER = 0.05;  // of the probability at each node
const float LIGHT_TREE_LEAST = 1e-6;     // the least probability of a child
const float LIGHT_TREE_FAR = 16.0;       // squared distance over spread of lights that are chosen by power

// Of its two children: the mean place of their lights, weighted by power, and the mean squared distance from it; a node,
// or -1 for a single light.
struct LightNode {
    vec3 first_place;
    float first_spread;
    vec3 second_place;
    float second_spread;
    float split;  // cumulative probability of all lights before the second child (LightChoice)
    int first;
    int second;
};
LightNode light_node_of(uvec4 t0, uvec4 t1, uvec4 t2) {
    return LightNode(
        uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), uintBitsToFloat(t1.w),
        uintBitsToFloat(t2.x), int(t2.y), int(t2.z));
}
LightNode light_node_load(int index) {
    int first = u_first_light_node + 3 * index;
    return light_node_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2));
}

// Lights side by side: the cumulative probability of those before them, and the end of theirs; and the probability that
// the way through the tree ends here.
struct LightGroup {
    float begin;
    float end;
    float probability;
};

// The group to which the way from `origin` leads that u chooses; or, if `cumulative` is not negative, that which holds the
// light of this cumulative probability. Stretches u over the group.
LightGroup light_tree_group(vec3 origin, float cumulative, inout float u) {
    LightGroup group = LightGroup(0.0, u_light_tree_probability, 1.0);
    int place = 0;
    while (place >= 0) {
        LightNode node = light_node_load(place);
        vec3 to_first = node.first_place - origin, to_second = node.second_place - origin;
        vec2 distances = vec2(dot(to_first, to_first), dot(to_second, to_second));
        vec2 spreads = vec2(node.first_spread, node.second_spread);
        float power = (node.split - group.begin) / (group.end - group.begin);
        vec2 brings = vec2(power, 1.0 - power) * (distances + spreads).yx;
        float sum = brings.x + brings.y;
        float first = mix(sum > 0.0 ? brings.x / sum : power, power, LIGHT_TREE_BY_POWER);
        first = clamp(first, LIGHT_TREE_LEAST, 1.0 - LIGHT_TREE_LEAST);
        bool is_first = cumulative < 0.0 ? u < first : cumulative < node.split;
        float probability = is_first ? first : 1.0 - first;
        u = min((is_first ? u : u - first) / probability, ONE_MINUS_EPSILON);
        group.probability *= probability;
        group.begin = is_first ? group.begin : node.split;
        group.end = is_first ? node.split : group.end;
        bool is_far = is_first ? distances.x > LIGHT_TREE_FAR * spreads.x : distances.y > LIGHT_TREE_FAR * spreads.y;
        place = is_far ? -1 : is_first ? node.first : node.second;
    }
    return group;
}

// The probability that a light is chosen that has `probability` by power alone, one of the tree.
float light_tree_probability(vec3 origin, float cumulative, float probability) {
    float unused = 0.0;
    LightGroup group = light_tree_group(origin, cumulative, unused);
    return u_light_tree_probability * group.probability * (probability / (group.end - group.begin));
}
