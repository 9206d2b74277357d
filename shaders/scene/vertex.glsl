// SPDX-License-Identifier: MIT
// Attributes of vertices: a table of u_vertices for each kind that the scene has, a texel for each vertex.
#include "scene/storage.glsl"

uniform int u_vertex_attributes;  // which of these there are:
const int ATTRIBUTE_NORMAL = 1;
const int ATTRIBUTE_UV = 2;       // both sets of texture coordinates
const int ATTRIBUTE_TANGENT = 4;
const int ATTRIBUTE_COLOR = 8;

uniform int u_first_normal;  // texels where the tables begin
uniform int u_first_uv;
uniform int u_first_tangent;
uniform int u_first_color;

bool vertices_have(int kind) { return (u_vertex_attributes & kind) != 0; }

// The value between three vertices with barycentric coordinates b.
vec4 vertex_interpolate(int first, uvec3 vertices, vec3 b) {
    ivec3 index = first + ivec3(vertices);
    return b.x * vertex_texel(index.x) + b.y * vertex_texel(index.y) + b.z * vertex_texel(index.z);
}
