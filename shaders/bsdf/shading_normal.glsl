// SPDX-License-Identifier: MIT
// What interpolated normals need, so that they neither darken where they should not nor let light through. Both
// leave a flat surface exactly as it is.
#include "core/math.glsl"

uniform int u_has_shading_normals;  // 0: every shading normal is the geometric one

const float SHADING_NORMAL_LEAST_COSINE = 0.01;

// How much of wo is added to the shading normal, if it is more than 0, to bend it towards wo where it looks away from it: near
// an outline the surface is seen, and is lit. `geometric`, the normal of the surface itself on the side of wo, is not bent.
float shading_normal_bend(vec3 normal, vec3 geometric, vec3 wo) {
    return min(SHADING_NORMAL_LEAST_COSINE, dot(geometric, wo)) - dot(normal, wo);
}

// Factor of what is scattered to wi, local to the shading normal: 0 where wi is reflected by one normal and transmitted by
// the other, so that nothing leaks; for a reflection falling to that smoothly, so that no edge of a triangle shows at the
// shadow terminator (Chiang, Li and Burley 2019, Taming the Shadow Terminator, equation 3).
float shadow_terminator(vec3 geometric, vec3 wi) {
    float cos_theta = dot(geometric, wi);
    if (wi.z < 0.0) return float(cos_theta < 0.0);
    if (cos_theta <= 0.0 || wi.z <= 0.0) return 0.0;
    float g = min(1.0, cos_theta / (wi.z * max(geometric.z, 1e-6)));
    return g + square(g) * (1.0 - g);
}

float shading_normal_factor(vec3 geometric, vec3 wi) {
    return u_has_shading_normals != 0 ? shadow_terminator(geometric, wi) : 1.0;
}
