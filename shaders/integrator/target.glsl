// SPDX-License-Identifier: MIT
// The shapes that photons are sent to, or parts of them, and points there.
#include "core/math.glsl"
#include "core/warp.glsl"
#include "light/sample.glsl"
#include "scene/storage.glsl"
#include "shape/instance.glsl"
#include "shape/shape.glsl"

uniform int u_target_count;
uniform float u_target_reach;  // m; what of a plane is a target: a disk about the point that is nearest to the origin
UTEXELS(16) u_targets;  // a row of the alias table over all targets, and the target of that number

struct Target {
    float threshold;  // of the alias table: below it this one, above the other
    int other;
    int record;       // of the shape
    int instance;     // record of the instance that it is there in, or -1
    float density;    // of its points, 1/m^2, the probability of this target included
    ivec2 cells;      // the part of the unit square, of which points are made, that it is: one of so many
    int cell;         // row by row
    bool is_culled;   // only its front is met
};
Target target_of(uvec4 t0, uvec4 t1) {
    return Target(uintBitsToFloat(t0.x), int(t0.y), int(t0.z), int(t0.w) - 1, uintBitsToFloat(t1.x),
        ivec2(t1.y & 0xffffu, t1.y >> 16u), int(t1.z), t1.w != 0u);
}
Target target_load(int index) {
    return target_of(texel_read(u_targets, storage_place(2 * index)), texel_read(u_targets, storage_place(2 * index + 1)));
}

// By two uniform numbers: the row of the table, and which of its two targets (Walker 1977, An Efficient Method for
// Generating Discrete Random Variables with General Distributions).
int target_choose(float u, float v) {
    int index = min(int(u * float(u_target_count)), u_target_count - 1);
    Target target = target_load(index);
    return v < target.threshold ? index : target.other;
}

// A point uniform over the area of a target: the hit of the ray that begins there.
Hit target_point(Target target, vec2 u, out Ray ray) {
    u = (vec2(target.cell % target.cells.x, target.cell / target.cells.x) + u) / vec2(target.cells);
    u = min(u, vec2(ONE_MINUS_EPSILON));
    uvec4 t0 = shape_texel(target.record, 0);
    uvec4 t1 = shape_texel(target.record, 1);
    uvec4 t2 = shape_texel(target.record, 2);
    uint kind = t0.w >> 24u;
    vec3 a = uintBitsToFloat(t0.xyz);
    vec2 place = kind == KIND_TRIANGLE ? square_to_triangle(u) : flat_sample(kind, u);
    vec3 position = a + place.x * (uintBitsToFloat(t1.xyz) - a) + place.y * (uintBitsToFloat(t2.xyz) - a);
    if (kind == KIND_SPHERE) position = a + uintBitsToFloat(t1.x) * square_to_uniform_sphere(u);
    if (u_plane_count > 0 && kind == KIND_PLANE) {
        Plane plane = plane_of(t0, t1);
        vec3 beside = u_target_reach * vec3(square_to_disk(u), 0.0);
        position = plane.offset * plane.normal + frame_to_world(frame_from_normal(plane.normal), beside);
    }
    ray = Ray(position, vec3(0.0, 0.0, 1.0));
    return Hit(0.0, target.record, place, target.instance);
}
