// SPDX-License-Identifier: MIT

// Distance along the ray to the sphere, INFINITE_DISTANCE where it misses. The discriminant comes
// from the perpendicular distance to the centre, which survives small and distant spheres (Haines
// et al. 2019, Precision Improvements for Ray/Sphere Intersection, Ray Tracing Gems, ch. 7).
float sphere_intersect(vec3 center, float radius, Ray ray) {
    vec3 to_center = center - ray.origin;
    float b = dot(to_center, ray.direction);
    vec3 perpendicular = to_center - b * ray.direction;
    float discriminant = radius * radius - dot(perpendicular, perpendicular);
    if (discriminant < 0.0) return INFINITE_DISTANCE;
    float half_chord = sqrt(discriminant);
    float near = b - half_chord;
    float far = b + half_chord;
    return near > 0.0 ? near : (far > 0.0 ? far : INFINITE_DISTANCE);
}
