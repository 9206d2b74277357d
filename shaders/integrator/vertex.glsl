// SPDX-License-Identifier: MIT
// A point where light is scattered: where it is, which way round, and how it scatters.
#include "bsdf/bsdf.glsl"
#include "bsdf/shading_normal.glsl"
#include "core/frame.glsl"
#include "film/parts.glsl"
#include "guiding/guide.glsl"
#include "material/material.glsl"
#include "medium/medium.glsl"
#include "shape/shape.glsl"

// GGX width up to which a lobe is narrow: of wider ones light sampling finds the light well.
const float NARROW_WIDEST = 0.3;

struct Vertex {
    vec3 origin;     // of rays that are reflected
    vec3 behind;     // of rays that are transmitted
    Frame frame;     // its normal is the shading normal, on the side of wo; of a clear coat that of the coat
    vec3 geometric;  // unit normal of the surface itself on that side, local
    vec3 wo;         // local
    Bsdf bsdf;
    ivec4 inside;    // the dielectrics that the side of wo lies in (integrator/interior.glsl)
    ivec4 beyond;    // and the other one
    uint seed;       // of stochastic alpha, for the rays to lights
    int primitive;   // the record of the shape that it lies on
    bool is_bent;    // whether the normal was bent towards wo (bsdf/shading_normal.glsl)
#if GUIDING
    Guide guide;     // set by vertex_guide()
#endif
#if HAS_MEDIA
    bool in_medium;  // and on no surface: scattered by the phase function
    float g;         // of that
#endif
};

// Of a surface that a ray has met, and the material there: material_at() has set the mapped normal.
Vertex vertex_at(Surface surface, Material material, vec3 direction, uint seed) {
    Vertex vertex;
    float side = dot(surface.normal, direction) > 0.0 ? -1.0 : 1.0;
    vec3 normal = side * surface.normal;
    // Back along the ray as well: where walls meet, the normal of one runs along the other, and a point
    // rounded to beyond that one would stay there.
    vertex.origin = ray_offset_origin(surface.position, normal - direction, surface.extent);
    vertex.behind = ray_offset_origin(surface.position, direction - normal, surface.extent);
    vec3 shading_normal = side * surface.mapped_normal;
    float bend = u_has_shading_normals != 0 ? shading_normal_bend(shading_normal, normal, -direction) : 0.0;
    vertex.is_bent = bend > 0.0;
    if (vertex.is_bent) shading_normal = normalize(shading_normal - bend * direction);
    vertex.frame = frame_from_normal(shading_normal);
    vertex.bsdf = material_bsdf(material, side > 0.0);
    if (u_facets_are_isotropic == 0) {
        Anisotropy anisotropy = material_anisotropy(surface);
        vertex.bsdf.anisotropy = anisotropy.strength;
        if (anisotropy.strength > 0.0) {
            vertex.bsdf.alpha = max(vertex.bsdf.alpha, ALPHA_DELTA);
            vertex.frame = frame_from_tangent(shading_normal, material_tangent(surface, anisotropy));
        }
    }
#if HAS_EXACT_FRESNEL
    if (u_without_sheen == 0) material_set_sheen(vertex.bsdf, surface);
    if (u_without_iridescence == 0) material_set_iridescence(vertex.bsdf, surface);
    if (bsdf_is(vertex.bsdf, BSDF_TRANSLUCENT)) {
        material_set_translucency(vertex.bsdf, surface, translucency_load(material.record));
    }
    if (bsdf_is(vertex.bsdf, BSDF_COATED)) {
        ClearCoat coat = clear_coat_load(material.record);
        vec3 coat_normal = side * material_coat_normal(surface, coat);
        float coat_bend = u_has_shading_normals != 0 ? shading_normal_bend(coat_normal, normal, -direction) : 0.0;
        vertex.is_bent = vertex.is_bent || coat_bend > 0.0;
        if (coat_bend > 0.0) coat_normal = normalize(coat_normal - coat_bend * direction);
        material_set_coat(vertex.bsdf, surface, coat);
        Frame base = vertex.frame;
        vertex.frame = frame_from_normal(coat_normal);
        vertex.bsdf.base_normal = frame_to_local(vertex.frame, base.normal);
        vertex.bsdf.base_tangent = frame_to_local(vertex.frame, base.tangent);
        vertex.bsdf.geometric = frame_to_local(vertex.frame, normal);
    }
#endif
    vertex.geometric = frame_to_local(vertex.frame, normal);
    vertex.wo = frame_to_local(vertex.frame, -direction);
    vertex.inside = ivec4(0);
    vertex.beyond = ivec4(0);
    vertex.seed = seed;
    vertex.primitive = surface.primitive;
#if HAS_MEDIA
    vertex.in_medium = false;
    vertex.g = 0.0;
#endif
    return vertex;
}

#if HAS_MEDIA
// Makes it a point of a medium, where a ray arrives that is `inside` of some dielectrics.
void vertex_set_medium(inout Vertex vertex, Ray ray, float distance, ivec4 inside, float g) {
    vertex.in_medium = true;
    vertex.primitive = NO_PRIMITIVE;
    vertex.is_bent = false;
    vertex.g = g;
    vertex.origin = ray.origin + distance * ray.direction;
    vertex.behind = vertex.origin;
    vertex.frame = frame_from_normal(-ray.direction);
    vertex.geometric = vec3(0.0, 0.0, 1.0);
    vertex.wo = vec3(0.0, 0.0, 1.0);
    vertex.inside = inside;
    vertex.beyond = inside;
}
#endif

// f |cos_i| in rgb and the density in a, without delta lobes.
vec4 vertex_eval_pdf(Vertex vertex, vec3 wi) {
#if HAS_MEDIA
    if (vertex.in_medium) return vec4(phase_eval(vertex.g, vertex.wo, wi));
#endif
    return bsdf_eval_pdf(vertex.bsdf, vertex.wo, wi);
}

// What the diffuse part of the BSDF is of its `value` towards wi, f |cos_i| without delta lobes. Media scatter diffusely.
vec3 vertex_diffuse_share(Vertex vertex, vec3 wi, vec3 value) {
#if HAS_MEDIA
    if (vertex.in_medium) return vec3(1.0);
#endif
    return clamp(bsdf_diffuse(vertex.bsdf, vertex.wo, wi, value) / max(value, vec3(1e-30)), 0.0, 1.0);
}

// What of that `value` is narrow; delta lobes all are.
vec3 vertex_narrow_share(Vertex vertex, vec3 wi, vec3 value) {
#if HAS_EXACT_FRESNEL
    if (bsdf_is(vertex.bsdf, BSDF_COATED)) {
        vec3 wide = coated_wide(vertex.bsdf, vertex.wo, wi, NARROW_WIDEST);
        return 1.0 - clamp(wide / max(value, vec3(1e-30)), 0.0, 1.0);
    }
#endif
    return vertex.bsdf.alpha <= NARROW_WIDEST ? 1.0 - vertex_diffuse_share(vertex, wi, value) : vec3(0.0);
}

// Where rays start whose local direction is wi.
vec3 vertex_origin(Vertex vertex, vec3 wi) {
#if HAS_EXACT_FRESNEL
    return wi.z < 0.0 ? vertex.behind : vertex.origin;
#else
    return vertex.origin;  // nothing is transmitted
#endif
}

// Factor of what is scattered to wi, for the sake of shading normals. Clear coats count it themselves.
float vertex_shading_factor(Vertex vertex, vec3 wi) {
#if HAS_MEDIA
    if (vertex.in_medium) return 1.0;
#endif
#if HAS_EXACT_FRESNEL
    if (bsdf_is(vertex.bsdf, BSDF_COATED)) return 1.0;
#endif
    return shading_normal_factor(vertex.geometric, wi);
}

// Makes use of the guiding, if there is any, where `is_guided`; within media there is none.
void vertex_guide(inout Vertex vertex, bool is_guided) {
#if HAS_MEDIA
    is_guided = is_guided && !vertex.in_medium;
#endif
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
#if HAS_MEDIA
    if (vertex.in_medium) {
        vec3 wi = phase_sample(vertex.g, vertex.wo, u);
        return BsdfSample(wi, vec3(1.0), phase_eval(vertex.g, vertex.wo, wi), 1.0, EVENT_REFLECTION);
    }
#endif
#if GUIDING
    return guide_scatter(vertex.guide, vertex.frame, vertex.bsdf, vertex.wo, u);
#else
    return bsdf_sample(vertex.bsdf, vertex.wo, u);
#endif
}

// f |cos_i| towards a direction that vertex_scatter() gave, if it is of no delta lobe.
vec3 vertex_value(Vertex vertex, BsdfSample s) {
#if GUIDING
    return vertex_eval_pdf(vertex, s.wi).rgb;
#else
    return s.weight * s.pdf;
#endif
}
