// SPDX-License-Identifier: MIT
// The one traversal of the BVH, for closest hits and for occlusion. Its nodes have up to four children; leaves are single
// shapes, or instances with a BVH of their own below them. A step reads one record, whatever it is, since what costs is
// the reading.
#include "scene/shape.glsl"
#include "shape/instance.glsl"
#include "shape/ray.glsl"
#include "shape/shape.glsl"
#include "shape/stack.glsl"

vec4 node_bytes(uint word) { return vec4(ivec4(uvec4(word, word >> 8u, word >> 16u, word >> 24u) & 255u)); }

// The children whose bounds the ray enters before max_distance: their slots, two bits each, the nearest lowest, and
// above them a 1. Distances are compared as bits, which have the order of floats that are not negative: below 0 any will
// do, since the bounds are behind. Far sides are moved away by what rounding may have brought them nearer
// (Ize 2013, Robust BVH Ray Traversal).
uint node_intersect(Node node, BvhRay ray, float max_distance) {
    uvec3 exponents = uvec3(node.kind, node.kind >> 8u, node.kind >> 16u) & 255u;
    vec3 grid = uintBitsToFloat(exponents << 23u) * ray.inverse;
    vec3 start = (node.origin - ray.origin) * ray.inverse;
    bvec3 backward = lessThan(ray.inverse, vec3(0.0));
    ivec4 near_x = floatBitsToInt(start.x + grid.x * node_bytes(backward.x ? node.x.y : node.x.x));
    ivec4 near_y = floatBitsToInt(start.y + grid.y * node_bytes(backward.y ? node.y.y : node.y.x));
    ivec4 near_z = floatBitsToInt(start.z + grid.z * node_bytes(backward.z ? node.z.y : node.z.x));
    ivec4 far_x = floatBitsToInt(start.x + grid.x * node_bytes(backward.x ? node.x.x : node.x.y));
    ivec4 far_y = floatBitsToInt(start.y + grid.y * node_bytes(backward.y ? node.y.x : node.y.y));
    ivec4 far_z = floatBitsToInt(start.z + grid.z * node_bytes(backward.z ? node.z.x : node.z.y));
    ivec4 near = max(max(near_x, near_y), max(near_z, 0));
    ivec4 far = min(min(far_x, far_y), min(far_z, floatBitsToInt(max_distance))) + 6;
    bvec4 is_met = bvec4(near.x <= far.x, near.y <= far.y, near.z <= far.z && node.count > 2u, near.w <= far.w && node.count > 3u);

    const int none = 0x7fffffff;
    ivec4 keys = (near & ~3) | ivec4(0, 1, 2, 3);
    keys = ivec4(is_met.x ? keys.x : none, is_met.y ? keys.y : none, is_met.z ? keys.z : none, is_met.w ? keys.w : none);
    ivec2 low = min(keys.xz, keys.yw);
    ivec2 high = max(keys.xz, keys.yw);
    int second = max(low.x, low.y);
    int third = min(high.x, high.y);
    ivec4 slots = ivec4(min(low.x, low.y), min(second, third), max(second, third), max(high.x, high.y)) & 3;
    ivec4 count = ivec4(is_met);
    uint end = 1u << uint((count.x + count.y + count.z + count.w) << 1);
    return (uint(slots.x | slots.y << 2 | slots.z << 4 | slots.w << 6) & (end - 1u)) | end;
}

// The root; a constant where the scene is compiled in (gpu/specialise.py).
Node bvh_root_of(uvec4 t0, uvec4 t1, uvec4 t2) { return node_of(t0, t1, t2); }
Node bvh_root_load(int index) {
    return bvh_root_of(shape_texel(index, 0), shape_texel(index, 1), shape_texel(index, 2));
}

// Updates `hit` by the shapes of the BVH but `ignored`; with `any` some nearer hit will do.
void bvh_intersect(inout Hit hit, Ray ray, int ignored, bool any) {
    if (u_bvh_root < 0 || (any && hit.primitive != NO_PRIMITIVE)) return;
    BvhRay local = bvh_ray(ray.origin, ray.direction);
    // What is left to do: records that lie side by side, from `first` on, in the order of their slots in `rest`. The root,
    // which every ray meets, is a step of its own, before the loop.
    uint first = uint(u_bvh_root), rest = 4u;
    Node root = bvh_root_load(u_bvh_root);
    if (root.kind >> 24u == KIND_NODE) {
        rest = node_intersect(root, local, hit.distance);
        first = root.first;
    }
    if (rest <= 1u) return;
    uint last = 1u;          // the group to go on with after this one, 1 if there is none; the stack has those below it
    stack_clear();
    int instance = -1;       // the record of the one whose BVH is being traversed
    int instance_count = 0;  // groups on the stack that do not belong to the instance
    uint instance_kind = 0u;
    bool is_done = false;
    do {
        int record = int(first + (rest & 3u));
        rest >>= 2u;
        uvec4 t0 = shape_texel(record, 0);
        uvec4 t1 = shape_texel(record, 1);
        uvec4 t2 = shape_texel(record, 2);
        uint kind = t0.w >> 24u;
        uint below = 1u;
        uint below_first = 0u;
        if (kind == KIND_NODE) {
            Node node = node_of(t0, t1, t2);
            below = node_intersect(node, local, hit.distance);
            below_first = node.first;
        }
#if HAS_INSTANCES
        if (kind == KIND_INSTANCE) {
            Instance space = instance_of(t0, t1, t2, shape_texel(record, 3));
            instance = record;
            instance_count = stack_count + int(rest > 1u);
            instance_kind = space.kind;
            local = bvh_ray(instance_to_local(space, ray.origin - space.translation), instance_to_local(space, ray.direction));
            below = 4u;
            below_first = space.root;
        }
#endif
        vec2 barycentrics;
        bool is_front;
        float distance = shape_intersect(t0, t1, t2, local, barycentrics, is_front);
        uint flags = HAS_INSTANCES == 1 && instance >= 0 ? instance_kind : t0.w;
        if (distance < hit.distance && record != ignored && (is_front || (flags & SHAPE_CULLED) == 0u)) {
            hit = Hit(distance, record, barycentrics, instance);
            if (any) {
                last = 1u;
                rest = 1u;
            }
        }
        if (below > 1u) {
            if (rest > 1u) {
                stack_push(last);
                last = first << 7u | rest;
            }
            first = below_first;
            rest = below;
        }
        if (rest == 1u) {
            first = last >> 7u;
            rest = last & 127u;
            last = stack_pop();
#if HAS_INSTANCES
            if (instance >= 0 && stack_count < instance_count) {
                instance = -1;
                local = bvh_ray(ray.origin, ray.direction);
            }
#endif
        }
        // Once true it stays so: llvmpipe (Mesa 22.3) may give lanes that have left the values of later rounds.
        is_done = is_done || rest <= 1u;
    } while (!is_done);
    if (!is_done) traversal_was_cut = true;
}
