// SPDX-License-Identifier: MIT
// Points as the camera sees them at once, or over one of the scene's largest surfaces that scatter narrowly, called mirrors
// here: what joins photons to pixels. Over a flat mirror or the outside of a sphere there is one place at most where light
// is reflected; over a rough one that is the middle of those from which one is drawn.
#include "bsdf/bsdf.glsl"
#include "camera/view.glsl"
#include "integrator/vertex.glsl"
#include "shape/shape.glsl"
#include "shape/sphere_reflection.glsl"

uniform int u_mirror_count;
uniform ivec4 u_mirrors;       // the records of their shapes, -1 for none
uniform vec4 u_mirror_widths;  // their GGX widths, 0 of smooth ones

struct MirroredView {
    CameraView camera;  // of the point, or of that on the mirror; its weight is that of radiance that leaves the point
    vec3 leaves;        // unit, from the point to the camera or the mirror
    vec3 origin;        // of a ray from the mirror to the point
    int mirror;         // its record, -1 where it is seen at once
    vec3 reflectance;   // of the mirror, or a sample of it; of a rough one, per solid angle
};

// Whether a shape is a mirror.
bool is_mirror(int primitive) { return any(equal(ivec4(primitive), u_mirrors)); }

// The view of a point from one of the lens that `lens` chooses, over mirror number `index`, or at once where that is below
// 0. Its camera's weight is 0 where there is none. `u` chooses among the lobes of a smooth mirror, and the place on a rough
// one.
MirroredView mirrored_view(vec3 point, int index, vec2 lens, vec2 u, uint seed) {
    CameraView direct = camera_view(point, lens);
    MirroredView view = MirroredView(direct, -direct.direction, point, -1, vec3(1.0));
    if (index >= 0) {
        index = max(index, 0);  // for compilers that complain of -1 here where they unroll a loop
        int record = u_mirrors[index];
        uvec4 t0 = shape_texel(record, 0);
        uvec4 t1 = shape_texel(record, 1);
        bool is_sphere = t0.w >> 24u == KIND_SPHERE;
        bool is_plane = t0.w >> 24u == KIND_PLANE;
        Sphere sphere = sphere_of(t0, t1, uvec4(0u));
        Plane plane = plane_of(t0, t1);
        Flat flat_shape = flat_of(t0, t1, shape_texel(record, 2), shape_texel(record, 3));
        vec3 origin = direct.origin;

        // Where a smooth mirror reflects it.
        vec3 normal, place;
        float curvature = 0.0;
        bool is_seen;
        if (is_sphere) {
            normal = sphere_reflection_normal((origin - sphere.center) / sphere.radius, (point - sphere.center) / sphere.radius);
            place = sphere.center + sphere.radius * normal;
            curvature = 1.0 / sphere.radius;
            is_seen = dot(normal, normal) > 0.0;
        } else {
            normal = is_plane ? plane.normal : flat_shape.normal;
            float offset = is_plane ? plane.offset : dot(normal, flat_shape.a);
            float height = dot(normal, point) - offset;
            float height_of_origin = dot(normal, origin) - offset;
            normal = height < 0.0 ? -normal : normal;
            place = mix(origin - height_of_origin * sign(height) * normal, point - abs(height) * normal,
                height_of_origin / (height_of_origin + height));
            is_seen = height * height_of_origin > 0.0;
        }

        // A rough one does so around that. Where the place moves, half vectors tilt from the normal, along the plane of
        // incidence and across it, by about so much; their slopes are drawn by GGX.
        float alpha = u_mirror_widths[index];
        vec3 to_origin = normalize(origin - place);
        float cos_theta = max(dot(normal, to_origin), 1e-4);
        float bend = 0.5 / distance(origin, place) + 0.5 / distance(point, place);
        vec2 tilt = curvature + bend * vec2(cos_theta, 1.0 / cos_theta);
        Frame frame = frame_from_normal(normal);
        frame.tangent = unit_or(to_origin - dot(normal, to_origin) * normal, frame.tangent);
        frame.bitangent = cross(normal, frame.tangent);
        float steepness = u.x / (1.0 - u.x);
        vec2 slope = alpha * sqrt(steepness) * cos_sin_turns(u.y);
        float density = tilt.x * tilt.y / (PI * square(alpha * (1.0 + steepness)));  // of the place, 1/m^2
        place += slope.x / tilt.x * frame.tangent + slope.y / tilt.y * frame.bitangent;
        if (is_sphere) {
            float stretch = distance(place, sphere.center) / sphere.radius;
            density *= stretch * square(stretch);
            normal = (place - sphere.center) / (sphere.radius * stretch);
            place = sphere.center + sphere.radius * normal;
        }

        view.camera = camera_view(place, lens);
        vec3 to_mirror = place - point;
        float after = length(to_mirror);
        view.leaves = to_mirror / after;
        view.mirror = record;
        Ray ray = Ray(origin, view.camera.direction);
        is_seen = is_seen && dot(normal, ray.direction) < 0.0 && dot(normal, view.leaves) < 0.0;
        if (!is_sphere && !is_plane) is_seen = is_seen && flat_intersect(flat_shape, ray) < INFINITE_DISTANCE;
        Surface surface = surface_at(ray, Hit(view.camera.distance, record, vec2(0.0), -1));
        Material material = material_at(surface);
        Vertex vertex = vertex_at(surface, material, ray.direction, seed);
        view.origin = vertex.origin;
        if (alpha > 0.0) {
            vec3 wi = frame_to_local(vertex.frame, -view.leaves);
            vec3 value = vertex_eval_pdf(vertex, wi).rgb;
            view.reflectance = value * vertex_narrow_share(vertex, wi, value);
            view.camera.weight *= vertex.wo.z / (square(after) * density);
        } else {
            BsdfSample s = bsdf_sample(vertex.bsdf, vertex.wo, u);
            view.reflectance = bsdf_is_delta(s) && (s.event & EVENT_REFLECTION) != 0 ? s.weight : vec3(0.0);
            // By how much a bundle of rays has spread, across the plane of incidence and along it (Igehy 1999, Tracing
            // Ray Differentials, has the general case).
            float before = view.camera.distance;
            float bent = 2.0 * before * after * curvature;
            view.camera.weight *= square(before) / ((before + after + bent * cos_theta) * (before + after + bent / cos_theta));
        }
        if (!is_seen || vertex.is_bent) view.camera.weight = 0.0;
    }
    return view;
}
