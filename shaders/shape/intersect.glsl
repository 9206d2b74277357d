// SPDX-License-Identifier: MIT
// What a ray meets first: the short list one by one, then the grid of spheres, then the BVH.
#include "shape/bvh.glsl"
#include "shape/ray.glsl"
#include "shape/shape.glsl"
#include "shape/sphere_grid.glsl"

// The closest hit nearer than max_distance, its primitive NO_PRIMITIVE where there is none; if `any` will do, some hit.
// The primitive `ignored` is passed over: a light does not occlude itself.
Hit scene_intersect(Ray ray, float max_distance, int ignored, bool any) {
    Hit hit = Hit(max_distance, NO_PRIMITIVE, vec2(0.0), -1);
    shape_list_intersect(hit, ray, ignored);
    sphere_grid_intersect(hit, ray, any);
    bvh_intersect(hit, ray, ignored, any);
    return hit;
}
