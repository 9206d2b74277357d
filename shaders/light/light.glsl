// SPDX-License-Identifier: MIT
// The contract of lights, the choice among them, and the dispatch to one file for each kind.
//
//   light_sample    a direction to a light, chosen by power or, of many, by what it brings (light/tree.glsl), with the
//                   radiance from there if nothing occludes it
//   light_pdf       the density of that sample, for a surface that emits and is met by BSDF sampling
//   light_focus     where a light is and how large, as far as it is anywhere
//   light_punctual  one light as if all of it were at its centre, for approximations without shadows
//
// Densities are over solid angle and include the probability of the choice. Each kind's file has KIND_light_sample() and,
// where the light can be met, KIND_light_pdf(), without the choice. A light that no ray meets has a delta sample: its pdf
// is the probability of the choice, and its radiance an irradiance at normal incidence.
#include "light/area.glsl"
#include "light/directional.glsl"
#include "light/environment.glsl"
#include "light/mesh.glsl"
#include "light/point.glsl"
#include "light/sample.glsl"
#include "light/sphere.glsl"
#include "light/spot.glsl"
#include "light/sun.glsl"
#include "light/tree.glsl"
#include "scene/light.glsl"

const int LIGHT_POINT = 0;
const int LIGHT_SPOT = 1;
const int LIGHT_DIRECTIONAL = 2;
const int LIGHT_SPHERE = 3;
const int LIGHT_AREA = 4;         // rectangles, disks and triangles of no mesh
const int LIGHT_MESH = 5;         // all triangles of meshes that emit
const int LIGHT_SUN = 6;
const int LIGHT_ENVIRONMENT = 7;

const int FEW_LIGHTS = 8;
const float LIGHT_STEP = 1.0 / 8388608.0;  // of which probabilities are multiples

// The light for begin + u: the last whose cumulative probability is not above it, which keeps the stratification of u; of
// their sum the last digits of u would be lost. A few are looked through; among many it is found by bisection between the
// first and last that the guide table allows for (Chen and Asau 1974, On Generating Random Variates from an Empirical
// Distribution), in constant time on average, whatever their number. Stretches u over the light's part.
LightChoice light_choose(float begin, inout float u) {
    int number = 0;
    if (u_light_count <= FEW_LIGHTS) {
        for (int i = 1; i < u_light_count; i++) number += int(u >= light_choice_load(i).cumulative - begin);
    } else {
        LightChoice guide = light_choice_load(min(int((begin + u) * float(u_light_count)), u_light_count - 1));
        number = guide.guide_first;
        int last = guide.guide_last;
        while (number < last) {
            int middle = (number + last + 1) / 2;
            bool is_above = light_choice_load(middle).cumulative - begin > u;
            number = is_above ? number : middle;
            last = is_above ? middle - 1 : last;
        }
    }
    LightChoice choice = light_choice_load(number);
    if (u_light_count > 1) {
        u = clamp((u - (choice.cumulative - begin)) / choice.probability, 0.0, ONE_MINUS_EPSILON);
    }
    return choice;
}

// The same for a point to be lit: of many lights that are somewhere by what they bring there.
LightChoice light_choose_at(vec3 origin, inout float u) {
    if (u_light_tree_count == 0 || u >= u_light_tree_probability) return light_choose(0.0, u);
    u /= u_light_tree_probability;
    LightGroup group = light_tree_group(origin, -1.0, u);
    float size = group.end - group.begin;
    u = min(u * size, size - 0.5 * LIGHT_STEP);
    LightChoice choice = light_choose(group.begin, u);
    choice.probability *= u_light_tree_probability * group.probability / size;
    return choice;
}

// u chooses the light and the point on it.
LightSample light_sample(vec3 origin, vec2 u) {
    LightChoice choice = light_choose_at(origin, u.x);
    LightSample s = light_no_sample();
#if HAS_POINT_LIGHT
    if (choice.kind == LIGHT_POINT) s = point_light_sample(point_light_load(choice.record), origin);
#endif
#if HAS_SPOT_LIGHT
    if (choice.kind == LIGHT_SPOT) s = spot_light_sample(spot_light_load(choice.record), origin);
#endif
#if HAS_DIRECTIONAL_LIGHT
    if (choice.kind == LIGHT_DIRECTIONAL) s = directional_light_sample(directional_light_load(choice.record));
#endif
#if HAS_SPHERE_LIGHT
    if (choice.kind == LIGHT_SPHERE) s = sphere_light_sample(sphere_light_load(choice.record), origin, u);
#endif
#if HAS_AREA_LIGHT
    if (choice.kind == LIGHT_AREA) s = area_light_sample(area_light_load(choice.record), origin, u);
#endif
#if HAS_MESH_LIGHT
    if (choice.kind == LIGHT_MESH) s = mesh_light_sample(origin, u, choice.probability);
#endif
#if HAS_SUN
    if (choice.kind == LIGHT_SUN) s = sun_light_sample(sun_light_load(choice.record), u);
#endif
#if HAS_ENVIRONMENT
    if (choice.kind == LIGHT_ENVIRONMENT) s = environment_light_sample(u);
#endif
    s.pdf *= choice.probability;
    return s;
}

// Density of light_sample() for the light `number`, a surface met at `distance` with its normal under `cos_theta` to
// the direction back to `origin`; `density` is that of the mesh light, per area (Surface.light_density).
float light_pdf(int number, vec3 origin, float distance, float cos_theta, float density) {
    LightChoice choice = light_choice_load(number);
    if (number < u_light_tree_count) choice.probability = light_tree_probability(origin, choice.cumulative, choice.probability);
    float pdf = 0.0;
#if HAS_SPHERE_LIGHT
    if (choice.kind == LIGHT_SPHERE) pdf = sphere_light_pdf(sphere_light_load(choice.record), origin);
#endif
#if HAS_AREA_LIGHT
    if (choice.kind == LIGHT_AREA) pdf = area_light_pdf(area_light_load(choice.record).area, distance, cos_theta);
#endif
#if HAS_MESH_LIGHT
    if (choice.kind == LIGHT_MESH) pdf = mesh_light_pdf(density, distance, cos_theta);
#endif
    return pdf * choice.probability;
}

// Where a light is and how large, for sampling what is near it: its centre and radius, which is negative of light from
// everywhere or afar.
vec4 light_focus(LightChoice choice) {
    vec4 focus = vec4(0.0, 0.0, 0.0, -1.0);
#if HAS_POINT_LIGHT
    if (choice.kind == LIGHT_POINT) focus = vec4(point_light_load(choice.record).position, 0.0);
#endif
#if HAS_SPOT_LIGHT
    if (choice.kind == LIGHT_SPOT) focus = vec4(spot_light_load(choice.record).position, 0.0);
#endif
#if HAS_SPHERE_LIGHT
    if (choice.kind == LIGHT_SPHERE) {
        SphereLight light = sphere_light_load(choice.record);
        focus = vec4(light.center, light.radius);
    }
#endif
#if HAS_AREA_LIGHT
    if (choice.kind == LIGHT_AREA) focus = area_light_focus(area_light_load(choice.record));
#endif
    return focus;
}

// A delta sample of one light. Meshes that emit have no one place, and give no light, as in a game engine; the
// environment is looked up (light/maps.glsl).
LightSample light_punctual(LightChoice choice, vec3 origin) {
    LightSample s = light_no_sample();
#if HAS_POINT_LIGHT
    if (choice.kind == LIGHT_POINT) s = point_light_sample(point_light_load(choice.record), origin);
#endif
#if HAS_SPOT_LIGHT
    if (choice.kind == LIGHT_SPOT) s = spot_light_sample(spot_light_load(choice.record), origin);
#endif
#if HAS_DIRECTIONAL_LIGHT
    if (choice.kind == LIGHT_DIRECTIONAL) s = directional_light_sample(directional_light_load(choice.record));
#endif
#if HAS_SPHERE_LIGHT
    if (choice.kind == LIGHT_SPHERE) s = sphere_light_punctual(sphere_light_load(choice.record), origin);
#endif
#if HAS_AREA_LIGHT
    if (choice.kind == LIGHT_AREA) s = area_light_punctual(area_light_load(choice.record), origin);
#endif
#if HAS_SUN
    if (choice.kind == LIGHT_SUN) s = sun_light_punctual(sun_light_load(choice.record));
#endif
    return s;
}
