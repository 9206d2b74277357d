// SPDX-License-Identifier: MIT
// Surfaces that are there in part (glTF 2.0, section 3.9.4): a ray meets one of opacity a with chance a, and else goes
// on as if there was none. The mean of what it then meets is that of a radiance weighted by a, and of shadows the
// transmittance, the product of all 1 - a, whatever technique chose the direction; so no weight between techniques
// needs to know of it. Each surface on the way is decided on its own, by a hash of the ray's own `seed`.
#if HAS_ALPHA

// As scene_intersect(), but the closest surface that is there. It asks after the traversal and not within it, where
// every triangle that a ray touches would cost a lookup; a ray that goes on begins again behind the surface.
Hit alpha_intersect(Ray ray, float max_distance, int skipped, uint seed) {
    vec3 start = ray.origin;
    float passed = 0.0;  // distance from the start to where the ray began again
    Hit hit;
    bool goes_on;
    do {
        hit = scene_intersect(ray, max(0.0, max_distance - passed), skipped, false);
        goes_on = false;
        if (hit.primitive != NO_PRIMITIVE) {
            Surface surface = surface_at(ray, hit);
            seed = hash_uint(seed + 0x9e3779b9u);
            goes_on = hash_to_unit(seed) >= material_opacity_at(surface, ray.direction);
            hit.distance += passed;
            if (goes_on) {
                vec3 beyond = dot(surface.normal, ray.direction) < 0.0 ? -surface.normal : surface.normal;
                ray.origin = ray_offset_origin(surface.position, beyond + ray.direction, surface.extent);
                passed = dot(ray.origin - start, ray.direction);
            }
        }
    } while (goes_on);
    if (goes_on) scene_is_cut_short = true;
    return hit;
}
#endif
