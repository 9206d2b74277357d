// SPDX-License-Identifier: MIT
// What a camera ray meets first, as numbers instead of light: for the eyes of a person who looks for
// a mistake in a scene. No light transport.
#if AUXILIARY
vec3 auxiliary_value(Path path) {
    Hit hit = path_intersect(path);
    if (hit.primitive == NO_PRIMITIVE) return vec3(0.0);
    Surface surface = surface_at(path.ray, hit);
#if AUXILIARY == AUXILIARY_NORMALS
#if HAS_SHADING_NORMALS
    return 0.5 + 0.5 * material_shading_normal(surface);
#else
    return 0.5 + 0.5 * surface.normal;
#endif
#elif AUXILIARY == AUXILIARY_DEPTH
    return vec3(hit.distance);
#else
    Material material = material_at(surface);
#if HAS_UNLIT
    if (material.unlit != 0) return material.emission;
#endif
    return material.diffuse + material.f0;
#endif
}
#endif
