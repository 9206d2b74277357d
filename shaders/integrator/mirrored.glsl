// SPDX-License-Identifier: MIT
// Points as the camera sees them at once, or over one of the scene's largest mirrors: what joins photons to pixels. Over a
// flat mirror or the outside of a sphere there is one such way at most.
#include "bsdf/bsdf.glsl"
#include "camera/view.glsl"
#include "integrator/vertex.glsl"
#include "shape/shape.glsl"
#include "shape/sphere_reflection.glsl"

uniform int u_mirror_count;
uniform ivec4 u_mirrors;  // the records of their shapes, -1 for none

struct MirroredView {
    CameraView camera;  // of the point, or of that on the mirror; its weight is that of radiance that leaves the point
    vec3 leaves;        // unit, from the point to the camera or the mirror
    float distance;     // from the point to the mirror
    vec3 origin;        // of a ray from the mirror to the point
    int mirror;         // its record, -1 where it is seen at once
    vec3 reflectance;   // of the mirror, or a sample of it
};

// Whether light that is seen in this shape is seen in a mirror of those.
bool is_mirror(int primitive) { return any(equal(ivec4(primitive), u_mirrors)); }

// The view of a point from one of the lens that `lens` chooses, over mirror number `index`, or at once where that is below
// 0. Its camera's weight is 0 where there is none. `u` chooses among the lobes of the mirror.
MirroredView mirrored_view(vec3 point, int index, vec2 lens, vec2 u, uint seed) {
    CameraView direct = camera_view(point, lens);
    MirroredView view = MirroredView(direct, -direct.direction, 0.0, point, -1, vec3(1.0));
    if (index >= 0) {
        int record = u_mirrors[index];
        uvec4 t0 = shape_texel(record, 0);
        uvec4 t1 = shape_texel(record, 1);
        uint kind = t0.w >> 24u;
        vec3 origin = direct.origin;
        vec3 place = point;
        float curvature = 0.0;
        bool is_seen = true;
        if (kind == KIND_SPHERE) {
            Sphere sphere = sphere_of(t0, t1);
            vec3 normal = sphere_reflection_normal((origin - sphere.center) / sphere.radius, (point - sphere.center) / sphere.radius);
            place = sphere.center + sphere.radius * normal;
            curvature = 1.0 / sphere.radius;
            is_seen = dot(normal, normal) > 0.0;
        } else {
            vec3 normal = uintBitsToFloat(t0.xyz);
            float offset = uintBitsToFloat(t1.x);
            Flat flat_shape = flat_of(t0, t1, shape_texel(record, 2), shape_texel(record, 3));
            if (kind != KIND_PLANE) {
                normal = flat_shape.normal;
                offset = dot(normal, flat_shape.a);
            }
            float height = dot(normal, point) - offset;
            Ray ray = Ray(origin, normalize(point - 2.0 * height * normal - origin));
            float distance = kind == KIND_PLANE ? plane_intersect(normal, offset, ray) : flat_intersect(flat_shape, ray);
            is_seen = distance < INFINITE_DISTANCE && height * (dot(normal, origin) - offset) > 0.0;
            place = origin + (is_seen ? distance : 0.0) * ray.direction;
        }

        view.camera = camera_view(place, lens);
        vec3 to_mirror = place - point;
        view.distance = length(to_mirror);
        view.leaves = to_mirror / view.distance;
        view.mirror = record;
        Ray ray = Ray(origin, view.camera.direction);
        Surface surface = surface_at(ray, Hit(view.camera.distance, record, vec2(0.0), -1));
        Vertex vertex = vertex_at(surface, material_at(surface), ray.direction, seed);
        view.origin = vertex.origin;
        BsdfSample s = bsdf_sample(vertex.bsdf, vertex.wo, u);
        is_seen = is_seen && bsdf_is_delta(s) && (s.event & EVENT_REFLECTION) != 0;
        view.reflectance = is_seen ? s.weight : vec3(0.0);
        // By how much a bundle of rays has spread, across the plane of incidence and along it (Igehy 1999, Tracing Ray
        // Differentials, has the general case).
        float before = view.camera.distance, after = view.distance;
        float bend = 2.0 * before * after * curvature;
        float spread = (before + after + bend * vertex.wo.z) * (before + after + bend / vertex.wo.z);
        view.camera.weight = is_seen ? view.camera.weight * square(before) / spread : 0.0;
    }
    return view;
}
