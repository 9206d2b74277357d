// SPDX-License-Identifier: MIT
// A point where light is scattered: where it is, which way round, and how it scatters.
#include "bsdf/bsdf.glsl"
#include "bsdf/shading_normal.glsl"
#include "core/frame.glsl"
#include "guiding/guide.glsl"
#include "material/material.glsl"
#include "shape/shape.glsl"

struct Vertex {
    vec3 origin;     // of rays that are reflected
    vec3 behind;     // of rays that are transmitted
    Frame frame;     // its normal is the shading normal, on the side of wo
    vec3 geometric;  // unit normal of the surface itself on that side, local
    vec3 wo;         // local
    Bsdf bsdf;
    ivec4 inside;    // the dielectrics that the side of wo lies in (integrator/interior.glsl)
    ivec4 beyond;    // and the other one
    uint seed;       // of stochastic alpha, for the rays to lights
#if GUIDING
    Guide guide;     // set by vertex_guide()
#endif
};

// Of a surface that a ray has met.
Vertex vertex_at(Surface surface, Material material, vec3 direction, uint seed) {
    Vertex vertex;
    float side = dot(surface.normal, direction) > 0.0 ? -1.0 : 1.0;
    vec3 normal = side * surface.normal;
    // Back along the ray as well: where walls meet, the normal of one runs along the other, and a point
    // rounded to beyond that one would stay there.
    vertex.origin = ray_offset_origin(surface.position, normal - direction, surface.extent);
    vertex.behind = ray_offset_origin(surface.position, direction - normal, surface.extent);
    vec3 shading_normal = side * material_shading_normal(surface);
    if (u_has_shading_normals != 0) shading_normal = shading_normal_bend(shading_normal, -direction);
    vertex.frame = frame_from_normal(shading_normal);
    vertex.geometric = frame_to_local(vertex.frame, normal);
    vertex.wo = frame_to_local(vertex.frame, -direction);
    vertex.bsdf = material_bsdf(material, side > 0.0);
    vertex.inside = ivec4(0);
    vertex.beyond = ivec4(0);
    vertex.seed = seed;
    return vertex;
}

// Where rays start whose local direction is wi.
vec3 vertex_origin(Vertex vertex, vec3 wi) { return wi.z < 0.0 ? vertex.behind : vertex.origin; }

// Factor of what is scattered to wi, for the sake of shading normals.
float vertex_shading_factor(Vertex vertex, vec3 wi) {
    return u_has_shading_normals != 0 ? shadow_terminator(vertex.geometric, wi) : 1.0;
}

// Makes use of the guiding, if there is any, where `is_guided`.
void vertex_guide(inout Vertex vertex, bool is_guided) {
#if GUIDING
    vertex.guide = guide_at(vertex.origin, vertex.frame, vertex.bsdf, is_guided);
#endif
}

// The probability of sampling the BSDF.
float vertex_bsdf_probability(Vertex vertex) {
#if GUIDING
    return 1.0 - vertex.guide.sum;
#else
    return 1.0;
#endif
}

// The density of a direction that vertex_scatter() gave over that of the BSDF alone.
float vertex_odds(Vertex vertex, BsdfSample s) {
#if GUIDING
    if (bsdf_is_delta(s) || s.pdf <= 0.0) return 1.0 - vertex.guide.sum;
    return (1.0 - vertex.guide.sum) * (1.0 + guide_pdf(vertex.guide, frame_to_world(vertex.frame, s.wi)) / s.pdf);
#else
    return 1.0;
#endif
}

// The next direction, as bsdf_sample() gives it.
BsdfSample vertex_scatter(Vertex vertex, vec2 u) {
#if GUIDING
    return guide_scatter(vertex.guide, vertex.frame, vertex.bsdf, vertex.wo, u);
#else
    return bsdf_sample(vertex.bsdf, vertex.wo, u);
#endif
}
