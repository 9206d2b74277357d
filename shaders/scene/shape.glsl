// SPDX-License-Identifier: MIT
// Records of u_shapes: first the short list of shapes that every ray is tested against (planes, which are infinite,
// and the shapes of a scene that has few), then a BVH of two levels over all others. The highest byte of the first
// texel's last word is the kind of a record, its lowest bit a flag, and what is between them, of leaves and instances, the
// number of the object that it is of. Here are those of the BVH and of meshes; the record of any other shape
// stands in its own file, shape/NAME.glsl.
#include "scene/storage.glsl"

const uint KIND_NODE = 0u;
const uint KIND_TRIANGLE = 1u;  // of a mesh
const uint KIND_INSTANCE = 2u;

const uint SHAPE_CULLED = 1u;  // flag of a shape or an instance: only its front is met

const uint SHAPE_STORED = 1u;  // more than the numbers of materials and lights (packing/shapes.py)

int shape_object(uint kind) { return int((kind & 0xffffffu) >> 1u); }

// A driver may end a loop before its time (llvmpipe of Mesa 22.3 does after 65,535 rounds of all loops in a draw).
bool traversal_was_cut = false;

uniform int u_bvh_root;      // its record; -1: there is no BVH
uniform int u_bvh_stack;     // groups that lie on the stack of the traversal at once, at most
uniform int u_bvh_shapes;    // BVH_... of shape/: the kinds of its leaves besides triangles of meshes
uniform int u_mesh_light;    // number of the light that all triangles of meshes that emit are together

// Bounds of up to four children in steps of 2^exponent from the origin, a byte for each child: the lower ones in x of each
// vector, the upper ones in y (Ylitie, Karras and Laine 2017, Efficient Incoherent Ray Traversal on GPUs Through
// Compressed Wide BVHs).
struct Node {
    vec3 origin;
    uint kind;  // biased exponents of x, y and z in its lower bytes
    uvec2 x;
    uvec2 y;
    uvec2 z;
    uint first;  // record of the first child; the others follow
    uint count;
};
Node node_of(uvec4 t0, uvec4 t1, uvec4 t2) {
    return Node(uintBitsToFloat(t0.xyz), t0.w, t1.xy, t1.zw, t2.xy, t2.z, t2.w);
}

// A triangle of a mesh.
struct Triangle {
    vec3 a;
    uint kind;
    vec3 b;
    uint material;
    vec3 c;
    float density;  // of a sample of the mesh light, per area; 0 where the triangle is no light
    uvec3 vertices;
};
Triangle triangle_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3) {
    return Triangle(
        uintBitsToFloat(t0.xyz), t0.w, uintBitsToFloat(t1.xyz), t1.w, uintBitsToFloat(t2.xyz),
        uintBitsToFloat(t2.w), t3.xyz);
}
Triangle triangle_load(int record) {
    return triangle_of(shape_texel(record, 0), shape_texel(record, 1), shape_texel(record, 2), shape_texel(record, 3));
}

// A mesh that is there more than once.
struct Instance {
    vec3 row_x;  // rows of the matrix that takes p - translation to the space of the mesh
    uint kind;
    vec3 row_y;
    uint root;  // of its BVH
    vec3 row_z;
    uint material;
    vec3 translation;
};
Instance instance_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3) {
    return Instance(
        uintBitsToFloat(t0.xyz), t0.w, uintBitsToFloat(t1.xyz), t1.w, uintBitsToFloat(t2.xyz), t2.w,
        uintBitsToFloat(t3.xyz));
}
Instance instance_load(int record) {
    return instance_of(shape_texel(record, 0), shape_texel(record, 1), shape_texel(record, 2), shape_texel(record, 3));
}
