// SPDX-License-Identifier: MIT
// Records of materials: their constant values, what textures and the colours of vertices change of them, what is
// peculiar to dielectrics, conductors and plastics, their coats, sheen and films, what they transmit diffusely, their
// opacity, what they are blended with.
#include "scene/storage.glsl"

uniform int u_first_material;  // texels of u_scene where the tables begin
uniform int u_first_maps;
uniform int u_first_dielectric;
uniform int u_first_conductor;
uniform int u_first_plastic;
uniform int u_first_coat;
uniform int u_first_clear_coat;
uniform int u_first_sheen;
uniform int u_first_iridescence;
uniform int u_first_translucency;
uniform int u_first_anisotropy;
uniform int u_first_opacity;
uniform int u_first_blend;
uniform int u_has_maps;        // 0: materials are constant
uniform int u_has_blends;      // 0: none is blended with another
uniform int u_has_black_backs;  // 0: none has one

const int ALPHA_OPAQUE = 0;
const int ALPHA_MASK = 1;
const int ALPHA_BLEND = 2;

const int MATERIAL_UNLIT = 1;   // emits to every ray, and scatters nothing
const int MATERIAL_MAPPED = 2;  // textures or the colours of vertices change it: it has Maps
const int MATERIAL_BLACK_BACK = 4;  // scatters nothing from behind
const int MATERIAL_INTERFACE = 8;  // of two dielectrics, whatever a path is inside of

struct Material {
    vec3 diffuse;  // albedo of the diffuse part
    float alpha;  // GGX width
    vec3 f0;  // specular reflectance at normal incidence
    int bsdf;  // BSDF_... of bsdf/bsdf.glsl
    vec3 f90;  // specular reflectance at grazing incidence
    int flags;  // MATERIAL_...
    vec3 emission;  // radiance from the front
    // Number of that of a dielectric, conductor, plastic, clear coat or translucency; of others 1: the factor of the half vector.
    int record;
};
Material material_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3) {
    return Material(
        uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), int(t1.w),
        uintBitsToFloat(t2.xyz), int(t2.w), uintBitsToFloat(t3.xyz), int(t3.w));
}
Material material_load(int index) {
    int first = u_first_material + 4 * index;
    return material_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2), scene_texel(first + 3));
}

bool material_is_unlit(Material material) { return (material.flags & MATERIAL_UNLIT) != 0; }
bool material_is_black(Material material, bool is_front) {
    return u_has_black_backs != 0 && !is_front && (material.flags & MATERIAL_BLACK_BACK) != 0;
}
bool material_is_interface(Material material) { return (material.flags & MATERIAL_INTERFACE) != 0; }
bool material_is_mapped(Material material) { return u_has_maps != 0 && (material.flags & MATERIAL_MAPPED) != 0; }

// Constant factors, and the numbers of textures that multiply them; -1: there is none.
struct Maps {
    vec3 albedo;
    float roughness;
    vec3 dielectric_f0;
    float metallic;
    vec3 dielectric_f90;
    float normal_scale;
    int albedo_texture;
    int roughness_texture;
    int metallic_texture;  // only if it is not another channel of the roughness texture
    int metallic_channel;  // of the value of the roughness texture; -1: there is none
    int normal_texture;
    int emission_texture;
    int occlusion_texture;
    float occlusion_strength;
};
Maps maps_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3, uvec4 t4) {
    return Maps(
        uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), uintBitsToFloat(t1.w),
        uintBitsToFloat(t2.xyz), uintBitsToFloat(t2.w), int(t3.x), int(t3.y), int(t3.z), int(t3.w),
        int(t4.x), int(t4.y), int(t4.z), uintBitsToFloat(t4.w));
}
Maps maps_load(int index) {
    int first = u_first_maps + 5 * index;
    return maps_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2), scene_texel(first + 3), scene_texel(first + 4));
}

// What only dielectrics have; the record with the highest number has the highest priority.
struct Dielectric {
    vec3 transmittance;  // colour of what passes the surface
    float eta;  // index of refraction
    vec3 absorption;  // 1/m, behind the surface
    float dispersion;  // 1 / Abbe number
};
Dielectric dielectric_of(uvec4 t0, uvec4 t1) {
    return Dielectric(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), uintBitsToFloat(t1.xyz), uintBitsToFloat(t1.w));
}
Dielectric dielectric_load(int index) {
    int first = u_first_dielectric + 2 * index;
    return dielectric_of(scene_texel(first), scene_texel(first + 1));
}

// What only conductors have.
struct Conductor {
    vec3 index;  // of refraction
    vec3 extinction;  // k, its imaginary part
};
Conductor conductor_of(uvec4 t0, uvec4 t1) {
    return Conductor(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.xyz));
}
Conductor conductor_load(int index) {
    int first = u_first_conductor + 2 * index;
    return conductor_of(scene_texel(first), scene_texel(first + 1));
}

// What only plastics have: a coat over a base.
struct Plastic {
    float eta;  // index of refraction of the coat
    float leaving;  // share of diffuse light from within that the coat does not reflect back to the base
    int nonlinear;  // 1: what is reflected back and scattered again takes the colour of the base each time
    int coat;  // of a rough one: number of the record of its coat, or of the first of several
    int coats;  // so many, of roughnesses evenly from 0 to 1
};
Plastic plastic_of(uvec4 t0, uvec4 t1) {
    return Plastic(uintBitsToFloat(t0.x), uintBitsToFloat(t0.y), int(t0.z), int(t0.w), int(t1.x));
}
Plastic plastic_load(int index) {
    int first = u_first_plastic + 2 * index;
    return plastic_of(scene_texel(first), scene_texel(first + 1));
}

// A rough coat of one roughness.
struct Coat {
    vec4 facets;  // coefficients of what it passes (bsdf/rough_plastic.glsl)
    vec3 angles;
    float leaving;  // share of diffuse light from within that it does not reflect
};
Coat coat_of(uvec4 t0, uvec4 t1) {
    return Coat(uintBitsToFloat(t0), uintBitsToFloat(t1.xyz), uintBitsToFloat(t1.w));
}
Coat coat_load(int index) {
    int first = u_first_coat + 2 * index;
    return coat_of(scene_texel(first), scene_texel(first + 1));
}

// Over a metallic-roughness material.
struct ClearCoat {
    float weight;
    float roughness;
    float f0;  // reflectance at normal incidence
    int half_vector;  // 1: the base has the factor of the half vector
    int weight_texture;  // -1: there is none
    int roughness_texture;
    int normal_texture;
    float normal_scale;
};
ClearCoat clear_coat_of(uvec4 t0, uvec4 t1) {
    return ClearCoat(
        uintBitsToFloat(t0.x), uintBitsToFloat(t0.y), uintBitsToFloat(t0.z), int(t0.w), int(t1.x), int(t1.y), int(t1.z),
        uintBitsToFloat(t1.w));
}
ClearCoat clear_coat_load(int index) {
    int first = u_first_clear_coat + 2 * index;
    return clear_coat_of(scene_texel(first), scene_texel(first + 1));
}

// Over what a metallic-roughness material is without it, below a coat; of every material, where any has it.
struct Sheen {
    vec3 color;  // black: there is none
    float roughness;
    int color_texture;  // -1: there is none
    int roughness_texture;
};
Sheen sheen_of(uvec4 t0, uvec4 t1) {
    return Sheen(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), int(t1.x), int(t1.y));
}
Sheen sheen_load(int index) {
    int first = u_first_sheen + 2 * index;
    return sheen_of(scene_texel(first), scene_texel(first + 1));
}

// Of a thin film on the facets of a metallic-roughness material; of every material, where any has it.
struct Iridescence {
    float weight;  // 0: there is none
    float ior;
    float thickness_minimum;  // nm, where its texture is 0
    float thickness;  // nm, where that is 1, or there is none
    int weight_texture;  // -1: there is none
    int thickness_texture;
};
Iridescence iridescence_of(uvec4 t0, uvec4 t1) {
    return Iridescence(
        uintBitsToFloat(t0.x), uintBitsToFloat(t0.y), uintBitsToFloat(t0.z), uintBitsToFloat(t0.w), int(t1.x), int(t1.y));
}
Iridescence iridescence_load(int index) {
    int first = u_first_iridescence + 2 * index;
    return iridescence_of(scene_texel(first), scene_texel(first + 1));
}

// What the base of a metallic-roughness material transmits diffusely, so that it reflects the rest.
struct Translucency {
    vec3 color;
    float factor;  // the share of the base that is transmitted
    int color_texture;  // -1: there is none
    int factor_texture;
    float metallic;  // the share of the material that has no base
    int metallic_texture;
};
Translucency translucency_of(uvec4 t0, uvec4 t1) {
    return Translucency(
        uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), int(t1.x), int(t1.y), uintBitsToFloat(t1.z), int(t1.w));
}
Translucency translucency_load(int index) {
    int first = u_first_translucency + 2 * index;
    return translucency_of(scene_texel(first), scene_texel(first + 1));
}

// Of facets that are wider along a tangent; of every material, where any has them.
struct Anisotropy {
    float strength;  // 0: as wide across it
    float cosine;    // of the angle from the tangent of the surface, counter-clockwise
    float sine;
    int texture_index;  // -1: there is none
};
Anisotropy anisotropy_of(uvec4 t0) {
    return Anisotropy(uintBitsToFloat(t0.x), uintBitsToFloat(t0.y), uintBitsToFloat(t0.z), int(t0.w));
}
Anisotropy anisotropy_load(int index) {
    int first = u_first_anisotropy + 1 * index;
    return anisotropy_of(scene_texel(first));
}

struct Opacity {
    float opacity;
    int mode;  // ALPHA_...
    float cutoff;  // of ALPHA_MASK
    int texture_index;  // whose alpha channel multiplies it; -1: there is none
};
Opacity opacity_of(uvec4 t0) {
    return Opacity(uintBitsToFloat(t0.x), int(t0.y), uintBitsToFloat(t0.z), int(t0.w));
}
Opacity opacity_load(int index) {
    int first = u_first_opacity + 1 * index;
    return opacity_of(scene_texel(first));
}

// With which other material one is blended; of every material, where any is.
struct Blend {
    float weight;  // of the other one
    int texture_index;  // whose channel multiplies it; -1: there is none
    int other;  // number of that material
};
Blend blend_of(uvec4 t0) {
    return Blend(uintBitsToFloat(t0.x), int(t0.y), int(t0.z));
}
Blend blend_load(int index) {
    int first = u_first_blend + 1 * index;
    return blend_of(scene_texel(first));
}
