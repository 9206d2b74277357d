// SPDX-License-Identifier: MIT
// Stochastic alpha (glTF 2.0, section 3.9.4): a ray meets a surface of opacity a with probability a, and else goes on as if
// there was none. The mean of what it then meets is that of a radiance weighted by a, and of shadows the transmittance,
// the product of all 1 - a, whatever technique chose the direction; so no weight between techniques needs to know of
// it. Each surface on the way is decided on its own, by a hash of the ray's own `seed`.
#include "core/hash.glsl"
#include "material/material.glsl"
#include "shape/intersect.glsl"
#include "shape/shape.glsl"

#ifndef HAS_ALPHA
#define HAS_ALPHA 0
#endif

#if HAS_ALPHA
float material_opacity(Surface surface) {
    Opacity o = opacity_load(surface.material);
    if (o.mode == ALPHA_OPAQUE) return 1.0;
    float alpha = o.opacity * surface.color.a;
#if HAS_TEXTURES
    if (o.texture_index >= 0) alpha *= texture_value(texture_load(o.texture_index), surface.uv).a;
#endif
    return o.mode == ALPHA_MASK ? float(alpha >= o.cutoff) : clamp(alpha, 0.0, 1.0);
}

// As scene_intersect(), but the closest surface that is opaque to this ray. Opacity is looked up after the traversal and
// not within it, where every triangle that a ray touches would cost a lookup; a ray that goes on begins again behind
// the surface.
Hit alpha_intersect(Ray ray, float max_distance, int ignored, uint seed) {
    vec3 start = ray.origin;
    float passed = 0.0;  // distance from the start to where the ray began again
    Hit hit;
    bool goes_on;
    do {
        hit = scene_intersect(ray, max(0.0, max_distance - passed), ignored, false);
        goes_on = false;
        if (hit.primitive != NO_PRIMITIVE) {
            Surface surface = surface_at(ray, hit);
            seed = hash_uint(seed + 0x9e3779b9u);
            goes_on = hash_to_unit(seed) >= material_opacity(surface);
            hit.distance += passed;
            if (goes_on) {
                vec3 beyond = dot(surface.normal, ray.direction) < 0.0 ? -surface.normal : surface.normal;
                ray.origin = ray_offset_origin(surface.position, beyond + ray.direction, surface.extent);
                passed = dot(ray.origin - start, ray.direction);
            }
        }
    } while (goes_on);
    if (goes_on) traversal_was_cut = true;
    return hit;
}
#endif

// The closest surface nearer than `distance` that is opaque to this ray, but for the primitive `ignored`; if `any` will do,
// some. `seed` is the ray's own.
Hit closest_hit_before(Ray ray, float distance, int ignored, uint seed, bool any) {
#if HAS_ALPHA
    return alpha_intersect(ray, distance, ignored, seed);
#else
    return scene_intersect(ray, distance, ignored, any);
#endif
}

// The closest surface that is opaque to this ray.
Hit closest_hit(Ray ray, uint seed) { return closest_hit_before(ray, INFINITE_DISTANCE, NO_PRIMITIVE, seed, false); }

// Whether a surface opaque to this ray is nearer than `distance`, but for the primitive `ignored`.
bool is_occluded(Ray ray, float distance, int ignored, uint seed) {
    return closest_hit_before(ray, distance, ignored, seed, true).primitive != NO_PRIMITIVE;
}
