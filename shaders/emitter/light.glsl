// SPDX-License-Identifier: MIT
// All lights of a scene as one: choosing one by its power, sampling it, and the density of both.

struct LightSample {
    vec3 wi;         // unit, towards the light
    float distance;  // to the light along wi
    vec3 radiance;   // incident from wi if nothing is in between; for a point light, irradiance at normal incidence
    float pdf;       // 1/sr with the probability of the choice included; 0 means "no sample"
    bool delta;      // a point light: pdf is the probability of the choice alone
    int primitive;   // the light's own primitive, or NO_PRIMITIVE
};

#if LIGHT_COUNT

// Density of light_sample() over solid angle for light `index`, met at `distance` with its normal
// under `cos_theta` to the direction back to `origin`. `density` is that of the surface (surface_light_density).
float light_pdf(int index, vec3 origin, float distance, float cos_theta, float density) {
    Light light = light_select(index);
    float pdf = 0.0;
#if HAS_SPHERE_LIGHT
    if (light.kind == LIGHT_SPHERE) pdf = sphere_light_pdf(light.position, light.radius, origin);
#endif
#if HAS_AREA_LIGHT
    if (light.kind == LIGHT_RECTANGLE || light.kind == LIGHT_TRIANGLE) pdf = area_light_pdf(light.area, distance, cos_theta);
#endif
#if HAS_MESH_LIGHT
    if (light.kind == LIGHT_MESH) pdf = mesh_light_pdf(density, distance, cos_theta);
#endif
    return pdf * light.probability;
}

// The light whose slice of the cumulative distribution holds u; stretches u over that slice.
Light light_choose(inout float u) {
    int index = 0;
    for (int i = 0; i < LIGHT_COUNT - 1; i++) index += int(u >= light_load(i).cumulative);
    Light light = light_select(index);
#if LIGHT_COUNT > 1
    u = clamp((u - light.cumulative) / light.probability + 1.0, 0.0, ONE_MINUS_EPSILON);
#endif
    return light;
}

// u chooses the light and the point on it.
LightSample light_sample(vec3 origin, vec2 u) {
    Light light = light_choose(u.x);
    LightSample s = LightSample(vec3(0.0, 0.0, 1.0), 0.0, light.radiance, 0.0, false, light.primitive);
#if HAS_POINT_LIGHT
    if (light.kind == LIGHT_POINT) {
        vec3 to_light = light.position - origin;
        s.distance = length(to_light);
        s.wi = to_light / s.distance;
        s.radiance /= square(s.distance);
        s.pdf = 1.0;
        s.delta = true;
    }
#endif
#if HAS_SPHERE_LIGHT
    if (light.kind == LIGHT_SPHERE) {
        vec4 point = sphere_light_sample(light.position, light.radius, origin, u);
        s.wi = point.xyz;
        s.distance = point.w;
        s.pdf = sphere_light_pdf(light.position, light.radius, origin);
    }
#endif
#if HAS_AREA_LIGHT
    if (light.kind == LIGHT_RECTANGLE || light.kind == LIGHT_TRIANGLE) {
        vec2 coordinates = light.kind == LIGHT_RECTANGLE ? u : square_to_triangle(u);
        vec4 point = area_light_sample(light.position, light.edge_u, light.edge_v, origin, coordinates);
        s.wi = point.xyz;
        s.distance = point.w;
        s.pdf = area_light_pdf(light.area, s.distance, -dot(s.wi, light.normal));
    }
#endif
#if HAS_SUN
    if (light.kind == LIGHT_SUN) {
        s.wi = sun_light_sample(light.position, light.radius, u);
        s.distance = INFINITE_DISTANCE;
        s.pdf = sun_light_pdf(light.position, light.radius, light.position);
    }
#endif
#if HAS_ENVIRONMENT
    if (light.kind == LIGHT_ENVIRONMENT) {
        EnvironmentSample environment = environment_sample(u);
        s.wi = environment.wi;
        s.distance = INFINITE_DISTANCE;
        s.radiance = environment.radiance;
        s.pdf = environment.pdf;
    }
#endif
#if HAS_MESH_LIGHT
    if (light.kind == LIGHT_MESH) {
        MeshLightSample point = mesh_light_sample(u);
        vec3 to_light = point.position - origin;
        s.distance = length(to_light);
        s.wi = to_light / s.distance;
        s.radiance = point.radiance;
        s.pdf = mesh_light_pdf(point.density, s.distance, -dot(s.wi, point.normal));
        s.primitive = FIRST_MESH + point.record;
    }
#endif
    s.pdf *= light.probability;
    return s;
}

#endif
