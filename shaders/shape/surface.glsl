// SPDX-License-Identifier: MIT
// What a hit says about the surface: computed once, after the traversal.
#include "core/math.glsl"

struct Surface {
    vec3 position;        // put back onto the surface, free of the error of the distance
    vec3 normal;          // unit, geometric: out of a sphere, by the right hand on flat shapes
    vec3 shading_normal;  // unit, on the side of `normal`
    vec3 mapped_normal;   // that with the normal map of the material (material_at())
    float extent;         // the largest coordinate behind `position`, for ray_offset_origin
    int primitive;        // the record of its shape
    int material;
    int light;            // number of the light that this shape is, or -1
    float light_density;  // of the mesh light: per area, of a sample of it
    // Of meshes; elsewhere coordinates and tangent are 0, the colour 1.
    vec4 uv;              // both sets of texture coordinates
    vec4 tangent;         // unit, not perpendicular to the normal; w is the sign of the bitangent; 0: none is given
    vec4 color;
};

void surface_set_plane(inout Surface surface, vec3 normal, float height) {
    surface.normal = normal;
    surface.position -= normal * height;
    surface.extent = max_component(abs(surface.position));
}

// A vector in the direction of v, or `fallback` where v is too short to have one.
vec3 unit_or(vec3 v, vec3 fallback) {
    float size = length(v);
    return size > 1e-6 ? v / size : fallback;
}
