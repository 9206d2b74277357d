// SPDX-License-Identifier: MIT
// A rectangle, disk or triangle that emits from its front, sampled uniformly over its area.
#include "core/math.glsl"
#include "core/warp.glsl"
#include "light/sample.glsl"
#include "scene/light.glsl"
#include "scene/shape.glsl"

#ifndef HAS_AREA_LIGHT
#define HAS_AREA_LIGHT 0
#endif

// Density over solid angle at `distance` under the angle `cos_theta` to the normal; 0 from behind.
float area_light_pdf(float area, float distance, float cos_theta) {
    return cos_theta > 0.0 ? square(distance) / (cos_theta * area) : 0.0;
}

LightSample area_light_sample(AreaLight light, vec3 origin, vec2 u) {
    vec2 p = light.kind == KIND_RECTANGLE ? u : light.kind == KIND_DISK ? square_to_disk(u) : square_to_triangle(u);
    vec3 to_light = light.a + p.x * light.edge_u + p.y * light.edge_v - origin;
    float distance = length(to_light);
    vec3 wi = to_light / distance;
    float pdf = area_light_pdf(light.area, distance, -dot(wi, light.normal));
    return LightSample(wi, distance, light.radiance, pdf, false, light.primitive);
}
