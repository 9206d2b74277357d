// SPDX-License-Identifier: MIT
// What lies between surfaces: dielectrics that may lie within each other, or overlap, of which the one with the highest
// priority counts (Schmidt and Budge 2002, Simple Nested Dielectrics in Ray Traced Images). A path has a list of those that
// it is in: four at most, each as often as it was entered. A dielectric is there as the number of its record and 1, which
// rises with the priority; 0 is none.
#include "integrator/vertex.glsl"
#include "scene/material.glsl"
#include "shape/bvh.glsl"

uniform int u_has_interiors;       // 0: nothing absorbs, and no two overlap: every dielectric is met from outside or left
uniform ivec4 u_camera_interiors;  // where paths begin

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

#if HAS_DIELECTRIC
Dielectric interior_load(int interior) { return dielectric_load(interior - 1); }

float interior_eta(int interior) { return interior == 0 ? 1.0 : interior_load(interior).eta; }
#endif

// What is left of light along a way of that length (Beer and Lambert).
vec3 interior_transmittance(ivec4 inside, float distance) {
#if HAS_DIELECTRIC
    int interior = interior_of(inside);
    if (u_has_interiors != 0 && interior != 0) return exp(-interior_load(interior).absorption * distance);
#endif
    return vec3(1.0);
}

// Says of a vertex what lies on both sides of it, where a path arrives that is `inside` of some: of a dielectric, in which
// ratio their indices are. Where another one of higher priority lies on both sides, its surface is none.
void interior_set_vertex(inout Vertex vertex, Material material, bool is_entered, ivec4 inside) {
#if HAS_DIELECTRIC
    if (u_has_interiors == 0) return;
    vertex.inside = inside;
    vertex.beyond = inside;
    if (vertex.bsdf.model != BSDF_DIELECTRIC) return;
    int interior = material.record + 1;
    vertex.beyond = is_entered ? interior_with(inside, interior) : interior_without(inside, interior);
    int before = max(interior_of(inside), is_entered ? 0 : interior);
    int behind = interior_of(vertex.beyond);
    vertex.bsdf.eta = before == behind ? 1.0 : interior_eta(behind) / interior_eta(before);
    if (before == behind) vertex.bsdf.transmittance = vec3(1.0);
#endif
}

// Whether a path may go on through a surface of this material as if there was none.
bool interior_may_pass(Material material) {
#if HAS_DIELECTRIC
    return material.bsdf == BSDF_THIN_DIELECTRIC || (material.bsdf == BSDF_DIELECTRIC && u_has_interiors != 0);
#else
    return false;
#endif
}

// The dielectrics that a ray is in which leaves the vertex in the local direction wi.
ivec4 interior_behind_vertex(Vertex vertex, vec3 wi) { return wi.z < 0.0 ? vertex.beyond : vertex.inside; }
