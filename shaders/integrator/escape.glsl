// SPDX-License-Identifier: MIT
// What a ray sees that meets no surface.
#include "integrator/direct.glsl"
#include "light/light.glsl"
#include "light/maps.glsl"

#define BACKGROUND_ENVIRONMENT 0
#define BACKGROUND_COLOR 1
#define BACKGROUND_PREFILTERED 2
#define BACKGROUND_IRRADIANCE 3
#ifndef BACKGROUND
#define BACKGROUND BACKGROUND_ENVIRONMENT
#endif

uniform vec3 u_background_radiance;  // of BACKGROUND_COLOR
uniform float u_background_roughness;
uniform float u_sun_probability;     // of being chosen among the lights

// What camera rays see in place of the environment and the sun.
vec3 escaped_background(vec3 direction) {
#if BACKGROUND == BACKGROUND_PREFILTERED
    return maps_prefiltered(direction, u_background_roughness);
#elif BACKGROUND == BACKGROUND_IRRADIANCE
    return maps_irradiance(direction);
#else
    return u_background_radiance;
#endif
}

// Radiance from infinitely far away, weighed against light samples of the vertex before, which is number depth - 1; of the
// sun `rest` is left by light tracing.
vec3 escaped_radiance(vec3 direction, int depth, float pdf, bool certain, vec3 rest) {
    vec3 radiance = vec3(0.0);
    if (max_component(u_ambient_radiance) > 0.0) radiance += u_ambient_radiance * direct_emission_weight(pdf, 0.0, certain);
#if BACKGROUND != BACKGROUND_ENVIRONMENT
    if (depth == 0) return radiance + escaped_background(direction);
#endif
#if HAS_ENVIRONMENT
    vec4 environment = environment_radiance_pdf(direction);
    radiance += environment.rgb * direct_emission_weight(pdf, environment.a * u_environment_probability, certain);
#endif
#if HAS_SUN
    SunLight sun = sun_light_load(0);
    float sun_pdf = sun_light_pdf(sun, direction) * u_sun_probability;
    if (sun_pdf > 0.0) radiance += rest * sun.radiance * direct_emission_weight(pdf, sun_pdf, certain);
#endif
    return radiance;
}
