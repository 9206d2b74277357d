// SPDX-License-Identifier: MIT
// Lookups in the maps of the split-sum approximation (gpu/cube_maps.py), turned and multiplied as the
// environment is.
#include "light/environment.glsl"
#include "texture/cube.glsl"

uniform highp sampler2D u_irradiance_map;   // over pi
uniform highp sampler2D u_prefiltered_map;  // roughness 0 to 1, level by level
uniform highp sampler2D u_brdf_map;         // factors of F0 and of F90, and the integral of the lobe
uniform int u_irradiance_size;              // of a face
uniform int u_prefiltered_size;
uniform int u_prefiltered_levels;

// What a white Lambert surface reflects.
vec3 maps_irradiance(vec3 normal) {
    vec3 radiance = vec3(0.0);
#if HAS_ENVIRONMENT
    vec3 direction = environment_to_map(normal);
    radiance += cube_lookup(u_irradiance_map, u_irradiance_size, 1, direction, 0.0) * u_environment_scale;
#endif
    return radiance;
}

// The mean over the lobe around a direction.
vec3 maps_prefiltered(vec3 direction, float roughness) {
    vec3 radiance = vec3(0.0);
#if HAS_ENVIRONMENT
    float level = roughness * float(u_prefiltered_levels - 1);
    direction = environment_to_map(direction);
    radiance += cube_lookup(u_prefiltered_map, u_prefiltered_size, u_prefiltered_levels, direction, level) * u_environment_scale;
#endif
    return radiance;
}

vec3 maps_brdf(float cos_theta, float roughness) {
    return textureLod(u_brdf_map, vec2(cos_theta, roughness), 0.0).rgb;
}
