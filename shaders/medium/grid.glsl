// SPDX-License-Identifier: MIT
// Grids of densities in boxes, interpolated between the centres of their voxels.
#include "core/math.glsl"
#include "scene/storage.glsl"
#include "shape/ray.glsl"

uniform int u_first_grid;  // texel of u_scene where the table begins
uniform int u_has_grids;   // 1: some medium has one

struct Grid {
    vec3 low;           // corner of the box
    int first;          // texel of u_scene of the first voxel; after all of them come the cells
    vec3 inverse_size;  // of the box
    uvec3 voxels;       // along each edge
    uvec3 cells;        // along each edge, each with the largest density in it
};
Grid grid_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3) {
    return Grid(uintBitsToFloat(t0.xyz), int(t0.w), uintBitsToFloat(t1.xyz), t2.xyz, t3.xyz);
}
Grid grid_load(int index) {
    int first = u_first_grid + 4 * index;
    return grid_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2), scene_texel(first + 3));
}

// 1 / direction, finite.
vec3 grid_inverse(Ray ray) { return bvh_ray(ray.origin, ray.direction).inverse; }

// Where a ray is in the box, no farther than `distance`.
vec2 grid_range(Grid grid, Ray ray, vec3 inverse, float distance) {
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

// A ray on its way through the cells (Amanatides and Woo 1987, A Fast Voxel Traversal Algorithm for Ray Tracing).
struct GridWalk {
    ivec3 cell;
    vec3 next;      // distances along the ray at which it leaves the cell by each axis
    float end;      // where it does so, or stops
    float largest;  // density in the cell
};

// Says what belongs to the cell, of a ray that stops at `farthest`.
void grid_set_cell(inout GridWalk walk, Grid grid, Ray ray, vec3 inverse, float farthest) {
    ivec3 cells = ivec3(grid.cells);
    ivec3 cell = clamp(walk.cell, ivec3(0), cells - 1);
    vec3 side = vec3(walk.cell) + vec3(greaterThan(inverse, vec3(0.0)));
    walk.next = (grid.low + side / (grid.inverse_size * vec3(grid.cells)) - ray.origin) * inverse;
    float end = cell == walk.cell ? min(walk.next.x, min(walk.next.y, walk.next.z)) : farthest;
    walk.end = clamp(end, walk.end, farthest);  // rounding leads no ray back
    int first = grid.first + int(grid.voxels.x * grid.voxels.y * grid.voxels.z);
    walk.largest = uintBitsToFloat(scene_texel(first + (cell.z * cells.y + cell.y) * cells.x + cell.x).x);
}

// At the beginning of a range.
GridWalk grid_walk(Grid grid, Ray ray, vec3 inverse, vec2 range) {
    GridWalk walk;
    vec3 place = (ray.origin + range.x * ray.direction - grid.low) * grid.inverse_size * vec3(grid.cells);
    walk.cell = ivec3(clamp(floor(place), vec3(0.0), vec3(grid.cells) - 1.0));
    walk.end = range.x;
    grid_set_cell(walk, grid, ray, inverse, range.y);
    return walk;
}

// Into the next cell.
void grid_step(inout GridWalk walk, Grid grid, Ray ray, vec3 inverse, float farthest) {
    vec3 across = vec3(lessThanEqual(walk.next, vec3(walk.end)));
    walk.cell += ivec3(across * sign(inverse));
    grid_set_cell(walk, grid, ray, inverse, farthest);
}
