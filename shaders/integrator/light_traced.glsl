// SPDX-License-Identifier: MIT
// Which light is left to light tracing (light_tracing.frag): that which reaches a surface over at least one other one, of
// which the first after the light scatters it narrowly, and is seen there by the camera at once or over one of the largest
// mirrors (integrator/mirrored.glsl), other than narrowly. The path tracer leaves out just that, each share of each path, so
// that their sum is all light. The environment, and ambient light, it finds well by itself. So it does where a normal is
// bent towards the viewer, since a photon that arrives on the other side is not scattered that way.
//
//   camera - (mirror) - receiver - ... - narrow - light
#include "film/parts.glsl"
#include "integrator/mirrored.glsl"
#include "integrator/vertex.glsl"
#include "light/sample.glsl"
#include "shape/ray.glsl"

uniform int u_first_traced;  // the first shape that light is traced from: planes, which are infinite, are before it

// Whether light is traced from this shape on.
bool light_traced_from(Hit hit) { return hit.primitive >= u_first_traced; }

// Whether a light is one whose light is traced.
bool light_traced_is_wanted(LightSample light) { return light.primitive != PRIMITIVE_AROUND; }

#if FILM_LIGHT == FILM_LIGHT_UNTRACED
// Of a path's throughput.
struct LightTraced {
    vec3 mirrored;  // the share that the first surface, a mirror, scatters narrowly, until the next has scattered it
    vec3 received;  // the share that receivers have not scattered narrowly
    vec3 earlier;   // and what it was before the last surface
    vec3 narrow;    // the share that this one scatters narrowly
};

LightTraced light_traced_begin() { return LightTraced(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)); }

// After scattering event `depth`, from 0, at a vertex on what was `hit`; `passed` surfaces had not scattered before.
void light_traced_scatter(inout LightTraced traced, Vertex vertex, Hit hit, BsdfSample s, int depth, int passed) {
    bool is_target = light_traced_from(hit);
    if (vertex.is_bent) traced.received = vec3(0.0);
    if (bsdf_is_null(s)) {
        traced.narrow = is_target && !vertex.is_bent ? traced.narrow : vec3(0.0);
        return;
    }
    vec3 narrow = vertex_narrow_share(vertex, s.wi, vertex_value(vertex, s));
    if (bsdf_is_delta(s)) narrow = vec3(1.0);
    traced.earlier = traced.received;
    if (depth == 0 && passed == 0) traced.received = 1.0 - narrow;
    if (depth == 1 && passed == 0) traced.received += traced.mirrored * (1.0 - narrow);
    bool is_mirrored = depth == 0 && (s.event & EVENT_REFLECTION) != 0 && is_mirror(hit.primitive) && !vertex.is_bent;
    traced.mirrored = is_mirrored ? narrow : vec3(0.0);
    traced.narrow = is_target ? narrow : vec3(0.0);
}

// What is left to the path tracer of light that a ray meets.
vec3 light_traced_rest(LightTraced traced) { return 1.0 - traced.earlier * traced.narrow; }

// The share of light that reaches the next vertex, on what was `hit`, which is left to light tracing if it is scattered
// narrowly there.
vec3 light_traced_next(LightTraced traced, Vertex vertex, Hit hit) {
    return light_traced_from(hit) && !vertex.is_bent ? traced.received : vec3(0.0);
}
#endif
