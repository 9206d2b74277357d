// SPDX-License-Identifier: MIT
// The one traversal of the BVH, for closest hits and for occlusion. Its nodes have up to four children; leaves are single
// shapes, or instances with a BVH of their own below them. A step reads one record, whatever it is, since what costs is
// the reading.
#include "core/frame.glsl"
#include "core/math.glsl"
#include "scene/shape.glsl"
#include "shape/flat.glsl"
#include "shape/ray.glsl"
#include "shape/sphere.glsl"

#ifndef HAS_MESHES
#define HAS_MESHES 0
#endif
#ifndef HAS_INSTANCES
#define HAS_INSTANCES 0
#endif

const int BVH_STACK = 64;  // MAX_DEPTH of fragtracer.bvh, twice

// A ray as nodes and triangles want it. Distances are in units of `direction`, which need not be a unit.
struct BvhRay {
    vec3 origin;
    vec3 direction;
    vec3 inverse;       // of the direction
    vec3 across, down;  // with the direction, axes of a space in which the ray runs along z
    vec3 along;         // direction / direction^2: dot(along, p) is the distance of p
};

BvhRay bvh_ray(vec3 origin, vec3 direction) {
    Frame frame = frame_from_normal(normalize(direction));
    // Finite and not 0 for all: a ray within the plane of a side must not make NaN.
    vec3 finite = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    return BvhRay(origin, direction, 1.0 / finite, frame.tangent, frame.bitangent, direction / dot(direction, direction));
}

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

// Distance to the triangle in x, INFINITE_DISTANCE where the ray misses its plane, the barycentric coordinates of b and c
// in yz, and in w a number that is positive where the ray meets the front; `inside` says whether it meets the triangle.
//
// Watertight, after Woop, Benthin and Wald 2013 (Watertight Ray/Triangle Intersection): the vertices are
// projected along the ray, each by itself, so that neighbours see the same points; then signs of 2D edge functions
// decide. An edge function that rounding could have given either sign counts as 0, as if the ray met the
// edge, so that neighbours agree however the driver contracts products and sums. A triangle
// seen edge-on, or without area, has only zeros and is never met.
vec4 triangle_intersect(vec3 a, vec3 b, vec3 c, BvhRay ray, out bool inside) {
    a -= ray.origin;
    b -= ray.origin;
    c -= ray.origin;
    vec3 x = vec3(dot(ray.across, a), dot(ray.across, b), dot(ray.across, c));
    vec3 y = vec3(dot(ray.down, a), dot(ray.down, b), dot(ray.down, c));
    vec3 z = vec3(dot(ray.along, a), dot(ray.along, b), dot(ray.along, c));
    vec3 first = x.zxy * y.yzx;  // across from a, b and c
    vec3 second = y.zxy * x.yzx;
    vec3 edges = first - second;
    edges = mix(edges, vec3(0.0), lessThanEqual(abs(edges), 2.4e-7 * (abs(first) + abs(second))));
    float sum = edges.x + edges.y + edges.z;
    vec3 barycentrics = edges * (1.0 / sum);
    float distance = dot(barycentrics, z);
    inside = !any(lessThan(edges, vec3(0.0))) || !any(greaterThan(edges, vec3(0.0)));
    return vec4(sum != 0.0 && distance > 0.0 ? distance : INFINITE_DISTANCE, barycentrics.yz, sum);
}

// Unit normal on the front of the triangle a, b, c. Sides are scaled first, since the square of a tiny triangle's area
// is no float32.
vec3 triangle_normal(vec3 a, vec3 b, vec3 c) {
    vec3 u = b - a;
    vec3 v = c - a;
    vec3 n = cross(u / max_component(abs(u)), v / max_component(abs(v)));
    return n / max(length(n), 1e-18);
}

#if HAS_INSTANCES
// A direction, or a point relative to the instance's translation, in the space of its mesh.
vec3 instance_to_local(Instance instance, vec3 v) {
    return vec3(dot(instance.row_x, v), dot(instance.row_y, v), dot(instance.row_z, v));
}

// From the space of the mesh to the scene, but for the translation.
mat3 instance_matrix(Instance instance) {
    return inverse(transpose(mat3(instance.row_x, instance.row_y, instance.row_z)));
}

// A normal in the scene, not of unit length; its front stays the front even through a mirror.
vec3 instance_normal_to_world(Instance instance, vec3 n) {
    return n.x * instance.row_x + n.y * instance.row_y + n.z * instance.row_z;
}
#endif

// A driver may end a loop before its time (llvmpipe does after 65,535 rounds of all loops in a draw).
bool traversal_was_cut = false;

// Updates `hit` by the shapes of the BVH but `ignored`; with `any` some nearer hit will do.
void bvh_intersect(inout Hit hit, Ray ray, int ignored, bool any) {
    if (u_bvh_root < 0 || (any && hit.primitive != NO_PRIMITIVE)) return;
    BvhRay local = bvh_ray(ray.origin, ray.direction);
    // What is left to do: records that lie side by side, from `first` on, in the order of their slots in `rest`.
    uint first = uint(u_bvh_root), rest = 4u;
    uint last = 1u;         // the group to go on with after this one, 1 if there is none
    uint stack[BVH_STACK];  // those below it
    int top = 0;
    int instance = -1;      // the record of the one whose BVH is being traversed
    int instance_top = 0;   // entries of the stack that do not belong to the instance
    uint instance_kind = 0u;
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
            instance_top = top + int(rest > 1u);
            instance_kind = space.kind;
            local = bvh_ray(instance_to_local(space, ray.origin - space.translation), instance_to_local(space, ray.direction));
            below = 4u;
            below_first = space.root;
        }
#endif
        float distance = INFINITE_DISTANCE;
        vec2 barycentrics = vec2(0.0);
        bool is_front = true;
#if !HAS_MESHES
        if ((u_bvh_shapes & BVH_FLATS) != 0)
#endif
        if (kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE) {
            bool inside;
            vec4 found = triangle_intersect(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.xyz), uintBitsToFloat(t2.xyz), local, inside);
            if ((u_bvh_shapes & BVH_FLATS) != 0 && kind != KIND_TRIANGLE) inside = flat_contains(t0.w, found.yz);
            distance = inside ? found.x : INFINITE_DISTANCE;
            barycentrics = found.yz;
            is_front = found.w > 0.0;
        }
        if ((u_bvh_shapes & BVH_SPHERES) != 0 && kind == KIND_SPHERE) {
            distance = sphere_intersect(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.x), local.origin, local.direction, is_front);
        }
        uint flags = HAS_INSTANCES == 1 && instance >= 0 ? instance_kind : t0.w;
        if (distance < hit.distance && record != ignored && (is_front || (flags & SHAPE_CULLED) == 0u)) {
            hit = Hit(distance, record, barycentrics, instance);
            if (any) {
                last = 1u;
                rest = 1u;
            }
        }
        stack[top] = last;
        if (below > 1u) {
            if (rest > 1u) {
                last = first << 7u | rest;
                top++;
            }
            first = below_first;
            rest = below;
        }
        if (rest == 1u) {
            first = last >> 7u;
            rest = last & 127u;
            top = max(top - 1, 0);
            last = stack[top];
#if HAS_INSTANCES
            if (instance >= 0 && top < instance_top) {
                instance = -1;
                local = bvh_ray(ray.origin, ray.direction);
            }
#endif
        }
    } while (rest > 1u);
    if (rest > 1u) traversal_was_cut = true;
}
