// SPDX-License-Identifier: MIT
// Where the scene lies: textures of 32-bit words, 4096 texels wide. A record is a run of texels; each file of this
// folder says what its records hold, and packing/records.py packs them by the same table (tests/packing holds the
// two together). Textures are read by textureLod at the centres of texels: for texelFetch llvmpipe looks up the level
// for each of its lanes.
uniform highp usampler2D u_scene;   // materials, textures and lights, one table after the other
uniform highp usampler2D u_shapes;  // shapes, and the nodes of the BVH over them
uniform highp sampler2D u_vertices; // attributes of the vertices of meshes, one table after the other

const int SHAPE_TEXELS = 4;  // of each record of u_shapes; what intersection needs is in the first three

// The centre of a texel of a texture 4096 texels wide.
vec2 storage_place(int column, int row, int height) {
    return (vec2(column, row) + 0.5) * vec2(1.0 / 4096.0, 1.0 / float(height));
}
vec2 storage_place(int index, int height) { return storage_place(index & 4095, index >> 12, height); }

uvec4 scene_texel(int index) {
    return textureLod(u_scene, storage_place(index, textureSize(u_scene, 0).y), 0.0);
}

uvec4 shape_texel(int record, int texel) {
    vec2 place = storage_place((record & 1023) << 2 | texel, record >> 10, textureSize(u_shapes, 0).y);
    return textureLod(u_shapes, place, 0.0);
}

vec4 vertex_texel(int index) {
    return textureLod(u_vertices, storage_place(index, textureSize(u_vertices, 0).y), 0.0);
}
