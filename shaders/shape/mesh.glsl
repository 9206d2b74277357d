// SPDX-License-Identifier: MIT
// Triangles of meshes below a tree of boxes, all in one texture: records of four texels, of which the first is the
// root. A step of the traversal reads one record, whatever it is, since what costs is the reading.
#if HAS_MESHES

uniform highp usampler2D u_mesh;          // records
uniform highp sampler2D u_mesh_vertices;  // normals and the like, MESH_VERTEX_TEXELS each
uniform highp sampler2D u_mesh_lights;

// Textures are read at the centres of texels, without filter or level: for texelFetch llvmpipe looks up the level for
// each of its lanes.
uvec4 mesh_texel(int record, int texel) {
    vec2 place = vec2((record & 1023) << 2 | texel, record >> 10) + 0.5;
    return textureLod(u_mesh, place / vec2(textureSize(u_mesh, 0)), 0.0);
}

MeshTriangle mesh_triangle_load(int record) {
    return mesh_triangle_of(mesh_texel(record, 0), mesh_texel(record, 1), mesh_texel(record, 2), mesh_texel(record, 3));
}

// A ray as boxes and triangles want it. Distances are in units of `direction`, which need not be a unit.
struct MeshRay {
    vec3 origin;
    vec3 inverse;       // of the direction
    vec3 across, down;  // with the direction, axes of a space in which the ray runs along z
    vec3 along;         // direction / direction^2: dot(along, p) is the distance of p
};

MeshRay mesh_ray(vec3 origin, vec3 direction) {
    Frame frame = frame_from_normal(normalize(direction));
    // Finite and not 0 for all: a ray within the plane of a box's side must not make NaN.
    vec3 finite = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    return MeshRay(origin, 1.0 / finite, frame.tangent, frame.bitangent, direction / dot(direction, direction));
}

vec4 mesh_bytes(uint word) { return vec4(ivec4(uvec4(word, word >> 8u, word >> 16u, word >> 24u) & 255u)); }

// The children whose boxes the ray enters before max_distance: their slots, two bits each, the nearest lowest, and
// above them a 1. Distances are compared as bits, which have the order of floats that are not negative: below 0 any will
// do, since the box is behind. Far sides are moved away by what rounding may have brought them nearer
// (Ize 2013, Robust BVH Ray Traversal).
uint mesh_node_intersect(MeshNode node, MeshRay ray, float max_distance) {
    uvec3 exponents = uvec3(node.kind, node.kind >> 8u, node.kind >> 16u) & 255u;
    vec3 grid = uintBitsToFloat(exponents << 23u) * ray.inverse;
    vec3 start = (node.origin - ray.origin) * ray.inverse;
    bvec3 backward = lessThan(ray.inverse, vec3(0.0));
    ivec4 near_x = floatBitsToInt(start.x + grid.x * mesh_bytes(backward.x ? node.x.y : node.x.x));
    ivec4 near_y = floatBitsToInt(start.y + grid.y * mesh_bytes(backward.y ? node.y.y : node.y.x));
    ivec4 near_z = floatBitsToInt(start.z + grid.z * mesh_bytes(backward.z ? node.z.y : node.z.x));
    ivec4 far_x = floatBitsToInt(start.x + grid.x * mesh_bytes(backward.x ? node.x.x : node.x.y));
    ivec4 far_y = floatBitsToInt(start.y + grid.y * mesh_bytes(backward.y ? node.y.x : node.y.y));
    ivec4 far_z = floatBitsToInt(start.z + grid.z * mesh_bytes(backward.z ? node.z.x : node.z.y));
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

// Distance to the triangle in x, INFINITE_DISTANCE where the ray misses it, the weights of b and c in yz, and a number
// that is positive where the ray meets its front in w.
//
// Watertight, after Woop, Benthin and Wald 2013 (Watertight Ray/Triangle Intersection): the vertices are
// projected along the ray, each by itself, so that neighbours see the same points; then signs of 2D edge functions
// decide. An edge function that rounding could have given either sign counts as 0, as if the ray met the
// edge, so that neighbours agree however the driver contracts products and sums. A triangle
// seen edge-on, or without area, has only zeros and is never met.
vec4 mesh_triangle_intersect(vec3 a, vec3 b, vec3 c, MeshRay ray) {
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
    vec3 weights = edges * (1.0 / sum);
    float distance = dot(weights, z);
    bool is_within = !any(lessThan(edges, vec3(0.0))) || !any(greaterThan(edges, vec3(0.0)));
    bool is_met = is_within && sum != 0.0 && distance > 0.0;
    return vec4(is_met ? distance : INFINITE_DISTANCE, weights.yz, sum);
}

// Unit normal on the front. Sides are scaled first, since the square of a tiny triangle's area is no float32.
vec3 mesh_triangle_normal(vec3 a, vec3 b, vec3 c) {
    vec3 u = b - a;
    vec3 v = c - a;
    vec3 n = cross(u / max_component(abs(u)), v / max_component(abs(v)));
    return n / max(length(n), 1e-18);
}

#if MESH_VERTEX_TEXELS
vec4 mesh_vertex_texel(int index) {
    vec2 place = vec2(index & 4095, index >> 12) + 0.5;
    return textureLod(u_mesh_vertices, place / vec2(textureSize(u_mesh_vertices, 0)), 0.0);
}

MeshVertex mesh_vertex_load(uint vertex) {
    int first = MESH_VERTEX_TEXELS * int(vertex);
    return mesh_vertex_of(
        mesh_vertex_texel(first)
#if MESH_VERTEX_TEXELS > 1
        , mesh_vertex_texel(first + 1)
#endif
#if MESH_VERTEX_TEXELS > 2
        , mesh_vertex_texel(first + 2)
#endif
#if MESH_VERTEX_TEXELS > 3
        , mesh_vertex_texel(first + 3)
#endif
    );
}
#endif

#if HAS_INSTANCES
// A direction, or a point relative to the instance's translation, in the space of its triangles.
vec3 mesh_to_instance(MeshInstance space, vec3 v) {
    return vec3(dot(space.row_x, v), dot(space.row_y, v), dot(space.row_z, v));
}

MeshInstance mesh_instance_load(int record) {
    return mesh_instance_of(mesh_texel(record, 0), mesh_texel(record, 1), mesh_texel(record, 2), mesh_texel(record, 3));
}

// From the space of its triangles to the scene, but for the translation.
mat3 mesh_instance_matrix(MeshInstance space) { return inverse(transpose(mat3(space.row_x, space.row_y, space.row_z))); }

// A normal in the scene, not of unit length; its front stays the front even through a mirror.
vec3 mesh_normal_to_world(MeshInstance space, vec3 n) { return n.x * space.row_x + n.y * space.row_y + n.z * space.row_z; }
#endif

#endif
