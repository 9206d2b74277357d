// SPDX-License-Identifier: MIT
// A uniform grid over many spheres of about one size: a ray goes from cell to cell (Amanatides and Woo 1987, A Fast Voxel
// Traversal Algorithm for Ray Tracing). Each turn of the loop reads one texel, which is a sphere of a cell, and tests it.
// Rounding may lead a ray past a cell that it just touches: a sphere is in all cells that it nearly touches.
#include "scene/shape.glsl"
#include "scene/storage.glsl"
#include "shape/ray.glsl"
#include "shape/sphere.glsl"

uniform vec3 u_sphere_grid_low;
uniform vec3 u_sphere_grid_cell;     // metres
uniform ivec3 u_sphere_grid_size;    // cells
uniform int u_sphere_grid_capacity;  // entries of each cell
uniform int u_first_sphere_grid;     // texel of u_scene where they begin: centre and radius, which is negated in the last
                                     // of a cell; behind them the number of each, four in a texel
uniform int u_first_grid_sphere;     // record of number 0

// Updates `hit` by the spheres of the grid; with `any` some nearer hit will do.
void sphere_grid_intersect(inout Hit hit, Ray ray, bool any) {
    if (u_has_sphere_grid == 0 || (any && hit.primitive != NO_PRIMITIVE)) return;
    vec3 inverse = ray_inverse(ray.direction);
    vec3 to_low = u_sphere_grid_low - ray.origin;
    vec3 to_high = to_low + u_sphere_grid_cell * vec3(u_sphere_grid_size);
    vec3 nearest = min(to_low * inverse, to_high * inverse);
    vec3 farthest = max(to_low * inverse, to_high * inverse);
    float enters = max(max(nearest.x, nearest.y), max(nearest.z, 0.0));
    if (!(enters <= min(min(farthest.x, farthest.y), min(farthest.z, hit.distance)))) return;

    ivec3 place = ivec3(floor((enters * ray.direction - to_low) * (1.0 / u_sphere_grid_cell)));
    place = clamp(place, ivec3(0), u_sphere_grid_size - 1);
    ivec3 ahead = ivec3(greaterThan(inverse, vec3(0.0)));
    vec3 way = abs(u_sphere_grid_cell * inverse);  // from one side of a cell to the next
    vec3 leaves = (to_low + u_sphere_grid_cell * vec3(place + ahead)) * inverse;
    vec3 end = farthest - 0.5 * way;               // beyond it a side is that of the grid
    int row = u_sphere_grid_size.x;
    ivec3 stride = u_sphere_grid_capacity * (2 * ahead - 1) * ivec3(1, row, row * u_sphere_grid_size.y);
    int first = u_sphere_grid_capacity * ((place.z * u_sphere_grid_size.y + place.y) * row + place.x);
    int entry = first;
    int found = -1;
    bool is_done = false;
    do {
        uvec4 t = scene_texel(u_first_sphere_grid + entry);
        float radius = uintBitsToFloat(t.w);
        bool is_front;
        float distance = sphere_intersect(uintBitsToFloat(t.xyz), abs(radius), ray.origin, ray.direction, is_front);
        found = distance < hit.distance ? entry : found;
        hit.distance = min(distance, hit.distance);
        bool is_last = radius <= 0.0;
        float leaves_at = min(min(leaves.x, leaves.y), leaves.z);
        bool is_x = leaves.x <= leaves_at;
        bool is_y = !is_x && leaves.y <= leaves_at;
        float end_there = is_x ? end.x : is_y ? end.y : end.z;
        is_done = is_done || (any && found >= 0) || (is_last && (hit.distance <= leaves_at || !(leaves_at <= end_there)));
        first += is_last ? (is_x ? stride.x : is_y ? stride.y : stride.z) : 0;
        entry = is_last ? first : entry + 1;
        leaves.x += is_last && is_x ? way.x : 0.0;
        leaves.y += is_last && is_y ? way.y : 0.0;
        leaves.z += is_last && !is_x && !is_y ? way.z : 0.0;
    } while (!is_done);
    if (!is_done) traversal_was_cut = true;
    if (found >= 0) {
        int cells = u_sphere_grid_size.x * u_sphere_grid_size.y * u_sphere_grid_size.z;
        uvec4 numbers = scene_texel(u_first_sphere_grid + cells * u_sphere_grid_capacity + (found >> 2));
        int slot = found & 3;
        uint number = slot == 0 ? numbers.x : slot == 1 ? numbers.y : slot == 2 ? numbers.z : numbers.w;
        hit = Hit(hit.distance, u_first_grid_sphere + int(number), vec2(0.0), -1);
    }
}
