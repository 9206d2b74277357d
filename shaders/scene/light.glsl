// SPDX-License-Identifier: MIT
// Records of lights: a table to choose among all of them, and one for each kind that has records.
#include "scene/storage.glsl"

uniform int u_light_count;
uniform int u_first_light_choice;  // texels of u_scene where the tables begin
uniform int u_first_point_light;
uniform int u_first_spot_light;
uniform int u_first_directional_light;
uniform int u_first_sphere_light;
uniform int u_first_area_light;
uniform int u_first_sun_light;
uniform int u_mesh_light_count;    // triangles of meshes that emit
uniform highp usampler2D u_mesh_lights;

const int LIGHT_POINT = 0;
const int LIGHT_SPOT = 1;
const int LIGHT_DIRECTIONAL = 2;
const int LIGHT_SPHERE = 3;
const int LIGHT_AREA = 4;         // rectangles, disks and triangles of no mesh
const int LIGHT_MESH = 5;         // all triangles of meshes that emit
const int LIGHT_SUN = 6;
const int LIGHT_ENVIRONMENT = 7;

// A light, and a row of the guide table that finds it (light/light.glsl).
struct LightChoice {
    float cumulative;  // probability of all lights before this one
    float probability;
    int kind;
    int record;  // of its kind's table
    int guide_first;  // row i: the lights that u from i / count to (i + 1) / count chooses
    int guide_last;
};
LightChoice light_choice_of(uvec4 t0, uvec4 t1) {
    return LightChoice(uintBitsToFloat(t0.x), uintBitsToFloat(t0.y), int(t0.z), int(t0.w), int(t1.x), int(t1.y));
}
LightChoice light_choice_load(int index) {
    int first = u_first_light_choice + 2 * index;
    return light_choice_of(scene_texel(first), scene_texel(first + 1));
}

struct PointLight {
    vec3 position;
    vec3 intensity;  // W/sr
};
PointLight point_light_of(uvec4 t0, uvec4 t1) {
    return PointLight(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.xyz));
}
PointLight point_light_load(int index) {
    int first = u_first_point_light + 2 * index;
    return point_light_of(scene_texel(first), scene_texel(first + 1));
}

struct SpotLight {
    vec3 position;
    float cos_scale;
    vec3 direction;  // unit, of the axis, away from the light
    float cos_offset;
    vec3 intensity;  // on the axis
};
SpotLight spot_light_of(uvec4 t0, uvec4 t1, uvec4 t2) {
    return SpotLight(
        uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), uintBitsToFloat(t1.w),
        uintBitsToFloat(t2.xyz));
}
SpotLight spot_light_load(int index) {
    int first = u_first_spot_light + 3 * index;
    return spot_light_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2));
}

struct DirectionalLight {
    vec3 wi;  // unit, to the light
    vec3 irradiance;  // at normal incidence
};
DirectionalLight directional_light_of(uvec4 t0, uvec4 t1) {
    return DirectionalLight(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.xyz));
}
DirectionalLight directional_light_load(int index) {
    int first = u_first_directional_light + 2 * index;
    return directional_light_of(scene_texel(first), scene_texel(first + 1));
}

struct SphereLight {
    vec3 center;
    float radius;
    vec3 radiance;
    int primitive;  // the record of its shape
};
SphereLight sphere_light_of(uvec4 t0, uvec4 t1) {
    return SphereLight(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), int(t1.w));
}
SphereLight sphere_light_load(int index) {
    int first = u_first_sphere_light + 2 * index;
    return sphere_light_of(scene_texel(first), scene_texel(first + 1));
}

struct AreaLight {
    vec3 a;
    float area;
    vec3 edge_u;
    uint kind;  // KIND_... of its shape
    vec3 edge_v;
    int primitive;  // the record of its shape
    vec3 normal;  // unit, on the front
    vec3 radiance;
};
AreaLight area_light_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3, uvec4 t4) {
    return AreaLight(
        uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), t1.w,
        uintBitsToFloat(t2.xyz), int(t2.w), uintBitsToFloat(t3.xyz), uintBitsToFloat(t4.xyz));
}
AreaLight area_light_load(int index) {
    int first = u_first_area_light + 5 * index;
    return area_light_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2), scene_texel(first + 3), scene_texel(first + 4));
}

struct SunLight {
    vec3 direction;  // unit, to its centre
    float one_minus_cos;  // of its angular radius
    vec3 radiance;
};
SunLight sun_light_of(uvec4 t0, uvec4 t1) {
    return SunLight(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz));
}
SunLight sun_light_load(int index) {
    int first = u_first_sun_light + 2 * index;
    return sun_light_of(scene_texel(first), scene_texel(first + 1));
}

// A row of the alias table over all triangles of meshes that emit.
struct MeshLight {
    float threshold;
    int record;  // of the triangle that is chosen below the threshold
    int other;  // of the one chosen above it
};
MeshLight mesh_light_of(uvec4 t0) {
    return MeshLight(uintBitsToFloat(t0.x), int(t0.y), int(t0.z));
}
MeshLight mesh_light_load(int index) {
    vec2 place = vec2(index & 4095, index >> 12) + 0.5;
    return mesh_light_of(textureLod(u_mesh_lights, place / vec2(textureSize(u_mesh_lights, 0)), 0.0));
}
