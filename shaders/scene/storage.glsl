// SPDX-License-Identifier: MIT
// Where the scene lies: textures of 32-bit words, 4096 texels wide. A record is a run of texels; each file of this
// folder says what its records hold, and packing/records.py packs them by the same table (tests/packing holds the
// two together).
#include "core/texels.glsl"

UTEXELS(9) u_scene;     // materials, textures and lights, one table after the other
UTEXELS(10) u_shapes;   // shapes, and the nodes of the BVH over them
TEXELS(11) u_vertices;  // attributes of the vertices of meshes, one table after the other

const int SHAPE_TEXELS = 4;  // of each record of u_shapes; what intersection needs is in the first three

// Where a texel is in a texture 4096 texels wide.
ivec2 storage_place(int index) { return ivec2(index & 4095, index >> 12); }

uvec4 scene_texel(int index) { return texel_read(u_scene, storage_place(index)); }

uvec4 shape_texel(int record, int texel) {
    return texel_read(u_shapes, ivec2((record & 1023) << 2 | texel, record >> 10));
}

vec4 vertex_texel(int index) { return texel_read(u_vertices, storage_place(index)); }
