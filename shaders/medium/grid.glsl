// SPDX-License-Identifier: MIT
// Grids of densities in boxes, interpolated between the centres of their voxels.
#include "core/math.glsl"
#include "scene/storage.glsl"
#include "shape/ray.glsl"

uniform int u_first_grid;  // texel of u_scene where the table begins
uniform int u_has_grids;   // 1: some medium has one

struct Grid {
    vec3 low;           // corner of the box
    float largest;      // density
    vec3 inverse_size;  // of the box
    int first;          // texel of u_scene of the first voxel
    uvec3 voxels;       // along each edge
};
Grid grid_of(uvec4 t0, uvec4 t1, uvec4 t2) {
    return Grid(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), int(t1.w), t2.xyz);
}
Grid grid_load(int index) {
    int first = u_first_grid + 3 * index;
    return grid_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2));
}

// Where a ray is in the box, no farther than `distance`.
vec2 grid_range(Grid grid, Ray ray, float distance) {
    vec3 inverse = bvh_ray(ray.origin, ray.direction).inverse;
    vec3 a = (grid.low - ray.origin) * inverse;
    vec3 b = (grid.low + 1.0 / grid.inverse_size - ray.origin) * inverse;
    vec3 near = min(a, b);
    return vec2(max(max_component(near), 0.0), min(-max_component(-max(a, b)), distance));
}

// Interpolated between eight voxels. A texel has those of a voxel and its neighbours in y, in z, and in both.
float grid_density(Grid grid, vec3 position) {
    vec3 most = vec3(grid.voxels) - 1.0;
    vec3 place = clamp((position - grid.low) * grid.inverse_size * vec3(grid.voxels) - 0.5, vec3(0.0), most);
    vec3 whole = floor(place);
    vec3 part = place - whole;
    ivec3 voxel = ivec3(whole);
    ivec3 voxels = ivec3(grid.voxels);
    int first = grid.first + (voxel.z * voxels.y + voxel.y) * voxels.x;
    vec4 left = uintBitsToFloat(scene_texel(first + voxel.x));
    vec4 right = uintBitsToFloat(scene_texel(first + min(voxel.x + 1, voxels.x - 1)));
    vec4 along = mix(left, right, part.x);
    vec2 across = mix(along.xz, along.yw, part.y);
    return mix(across.x, across.y, part.z);
}
