// SPDX-License-Identifier: MIT
// What a hit says about the surface: computed once, after the traversal.

struct Surface {
    vec3 position;  // put back onto the surface, free of the error of the distance
    vec3 normal;    // unit, geometric: out of a sphere, up from a plane, by the right hand for the others
    float extent;   // the largest coordinate behind `position`, for ray_offset_origin
    int material;
    int light;      // index of the light that this primitive is, or -1
};

void surface_set_flat(inout Surface surface, vec4 plane, int material, int light) {
    surface.normal = plane.xyz;
    surface.position -= plane.xyz * (dot(plane.xyz, surface.position) - plane.w);
    surface.extent = max_component(abs(surface.position));
    surface.material = material;
    surface.light = light;
}

Surface surface_at(Ray ray, Hit hit) {
    Surface surface = Surface(ray.origin + hit.distance * ray.direction, vec3(0.0), 0.0, 0, -1);
#if SPHERE_COUNT
    if (hit.primitive < FIRST_PLANE) {
        Sphere s = sphere_select(hit.primitive - FIRST_SPHERE);
        surface.normal = normalize(surface.position - s.center);
        surface.position = s.center + s.radius * surface.normal;
        surface.extent = max_component(abs(s.center)) + s.radius;
        surface.material = s.material;
        surface.light = s.light;
    }
#endif
#if PLANE_COUNT
    if (hit.primitive >= FIRST_PLANE && hit.primitive < FIRST_RECTANGLE) {
        Plane p = plane_select(hit.primitive - FIRST_PLANE);
        surface_set_flat(surface, vec4(p.normal, p.offset), p.material, -1);
    }
#endif
#if RECTANGLE_COUNT
    if (hit.primitive >= FIRST_RECTANGLE && hit.primitive < FIRST_TRIANGLE) {
        Rectangle r = rectangle_select(hit.primitive - FIRST_RECTANGLE);
        surface_set_flat(surface, r.plane, r.material, r.light);
    }
#endif
#if TRIANGLE_COUNT
    if (hit.primitive >= FIRST_TRIANGLE) {
        Triangle t = triangle_select(hit.primitive - FIRST_TRIANGLE);
        surface_set_flat(surface, t.plane, t.material, t.light);
    }
#endif
    return surface;
}
