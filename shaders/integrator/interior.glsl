// SPDX-License-Identifier: MIT
// What lies between surfaces: dielectrics that may lie within each other, or overlap, of which the one with the highest
// priority counts (Schmidt and Budge 2002, Simple Nested Dielectrics in Ray Traced Images). A path has a list of those that
// it is in: four at most, each as often as it was entered. A dielectric is there as the number of its record and 1, which
// rises with the priority; 0 is none. Each has a medium within, and the fog is where there is none of them.
#include "integrator/vertex.glsl"
#include "medium/medium.glsl"
#include "scene/material.glsl"
#include "shape/bvh.glsl"

uniform int u_has_interiors;       // 0: nothing absorbs, all refract, and no two overlap: every dielectric is met from outside or left
uniform int u_has_null;            // 1: some surface is but the boundary of a medium
uniform ivec4 u_camera_interiors;  // where paths begin
uniform int u_has_dispersion;      // 1: some dielectric has an index of its own for each colour

// A path that has met dispersion is of one colour, its band: 0 to 2, before that -1.
const int BAND_NONE = -1;
// Of Cauchy's formula n = A + B / wavelength^2, (n - n_d) V / (n_d - 1) at the dominant wavelengths of the primaries of Rec.
// 709: 611.4, 549.1 and 464.3 nm; n_d at 587.56 nm and V, the Abbe number, by the Fraunhofer lines F and C.
const vec3 DISPERSION_OF_BANDS = vec3(-0.1160, 0.2199, 0.9123);

// The dielectric that counts, 0 where there is none.
int interior_of(ivec4 inside) { return max(max(inside.x, inside.y), max(inside.z, inside.w)); }

ivec4 interior_with(ivec4 inside, int added) {
    if (inside.x == 0) return ivec4(added, inside.yzw);
    if (inside.y == 0) return ivec4(inside.x, added, inside.zw);
    if (inside.z == 0) return ivec4(inside.xy, added, inside.w);
    if (inside.w != 0) traversal_was_cut = true;
    return ivec4(inside.xyz, added);
}

ivec4 interior_without(ivec4 inside, int removed) {
    if (inside.x == removed) return ivec4(0, inside.yzw);
    if (inside.y == removed) return ivec4(inside.x, 0, inside.zw);
    if (inside.z == removed) return ivec4(inside.xy, 0, inside.w);
    if (inside.w == removed) return ivec4(inside.xyz, 0);
    return inside;
}

#if HAS_EXACT_FRESNEL
Dielectric interior_load(int interior) { return dielectric_load(interior - 1); }

// Index of refraction for a band.
float interior_eta(int interior, int band) {
    if (interior == 0) return 1.0;
    Dielectric dielectric = interior_load(interior);
    if (u_has_dispersion == 0 || band == BAND_NONE) return dielectric.eta;
    float offset = band == 0 ? DISPERSION_OF_BANDS.x : band == 1 ? DISPERSION_OF_BANDS.y : DISPERSION_OF_BANDS.z;
    return dielectric.eta + (dielectric.eta - 1.0) * dielectric.dispersion * offset;
}
#endif

// Whether the surface of a dielectric is but the boundary of a medium.
bool interior_is_null(int interior) {
#if HAS_MEDIA
    return u_has_null != 0 && interior != 0 && medium_load(interior).is_null != 0;
#else
    return false;
#endif
}

// Whether that is all that a surface of this material is.
bool interior_bounds_medium(Material material) {
    return material.bsdf == BSDF_DIELECTRIC && interior_is_null(material.record + 1);
}

// The dielectric whose index of refraction counts: boundaries of media have none.
int interior_refracting(ivec4 inside) {
#if HAS_MEDIA
    if (interior_is_null(inside.x)) inside.x = 0;
    if (interior_is_null(inside.y)) inside.y = 0;
    if (interior_is_null(inside.z)) inside.z = 0;
    if (interior_is_null(inside.w)) inside.w = 0;
#endif
    return interior_of(inside);
}

// What is left of light along a way of that length (Beer and Lambert), where there are no media.
vec3 interior_transmittance(ivec4 inside, float distance) {
#if HAS_EXACT_FRESNEL
    int interior = interior_of(inside);
    if (u_has_interiors != 0 && interior != 0) return exp(-interior_load(interior).absorption * distance);
#endif
    return vec3(1.0);
}

// Says of a vertex what lies on both sides of it, where a path arrives that is `inside` of some: of a dielectric, in which
// ratio their indices are. Where another one of higher priority lies on both sides, its surface is none.
void interior_set_vertex(inout Vertex vertex, Material material, bool is_entered, ivec4 inside, int band) {
#if HAS_EXACT_FRESNEL
    if (u_has_interiors == 0) return;
    vertex.inside = inside;
    vertex.beyond = inside;
    if (vertex.bsdf.model != BSDF_DIELECTRIC || material_is_interface(material)) return;
    int interior = material.record + 1;
    vertex.beyond = is_entered ? interior_with(inside, interior) : interior_without(inside, interior);
    if (interior_is_null(interior)) {
        vertex.bsdf.transmittance = vec3(1.0);  // not the colour of a vertex
        return;
    }
    int before = max(interior_refracting(inside), is_entered ? 0 : interior);
    int behind = interior_refracting(vertex.beyond);
    vertex.bsdf.eta = before == behind ? 1.0 : interior_eta(behind, band) / interior_eta(before, band);
    if (before == behind) vertex.bsdf.transmittance = vec3(1.0);
#endif
}

// The band of a path that arrives at a surface of this material; u chooses one at the first that disperses light.
int interior_band(Material material, int band, float u) {
#if HAS_EXACT_FRESNEL
    if (u_has_dispersion == 0 || band != BAND_NONE || material.bsdf != BSDF_DIELECTRIC) return band;
    if (dielectric_load(material.record).dispersion > 0.0) return int(3.0 * u);
#endif
    return band;
}

// What that makes of white: each band is chosen by one path of three.
vec3 interior_band_color(int before, int band) {
    if (before == band) return vec3(1.0);
    return vec3(band == 0 ? 3.0 : 0.0, band == 1 ? 3.0 : 0.0, band == 2 ? 3.0 : 0.0);
}

// Whether a path may go on through a surface of this material as if there was none.
bool interior_may_pass(Material material) {
#if HAS_EXACT_FRESNEL
    return material.bsdf == BSDF_THIN_DIELECTRIC || (material.bsdf == BSDF_DIELECTRIC && u_has_interiors != 0);
#else
    return false;
#endif
}

// The dielectrics that a ray is in which leaves the vertex in the local direction wi.
ivec4 interior_behind_vertex(Vertex vertex, vec3 wi) { return wi.z < 0.0 ? vertex.beyond : vertex.inside; }
