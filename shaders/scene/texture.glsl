// SPDX-License-Identifier: MIT
// Records of textures: where the image lies in the atlas, and how coordinates find their place in it.
#include "scene/storage.glsl"

uniform int u_first_texture;  // texel of u_scene where the table begins
uniform int u_texture_uses;   // what textures of this scene change:
const int TEXTURE_ALBEDO = 1;
const int TEXTURE_ROUGHNESS = 2;
const int TEXTURE_METALLIC = 4;
const int TEXTURE_NORMAL = 8;
const int TEXTURE_OCCLUSION = 16;
const int TEXTURE_EMISSION = 32;
const int TEXTURE_ANISOTROPY = 64;
const int TEXTURE_BLEND_WEIGHT = 128;
const int TEXTURE_COAT = 256;
const int TEXTURE_COAT_ROUGHNESS = 512;
const int TEXTURE_COAT_NORMAL = 1024;
const int TEXTURE_SHEEN_COLOR = 2048;
const int TEXTURE_SHEEN_ROUGHNESS = 4096;
const int TEXTURE_IRIDESCENCE = 8192;
const int TEXTURE_IRIDESCENCE_THICKNESS = 16384;
const int TEXTURE_DIFFUSE_TRANSMISSION = 32768;
const int TEXTURE_DIFFUSE_TRANSMISSION_COLOR = 65536;

const int TEXTURE_SRGB = 1;  // flags of a texture
const int TEXTURE_FLOAT = 2;
const int TEXTURE_NEAREST = 4;
const int WRAP_REPEAT = 0;
const int WRAP_MIRROR = 1;
const int WRAP_CLAMP = 2;

bool textures_change(int use) { return (u_texture_uses & use) != 0; }

struct Texture {
    vec3 u_row;  // u = u_row . (u, v, 1) of the set `coordinates`
    int coordinates;
    vec3 v_row;
    int channel;  // that a single number is read from
    int first;  // texel of the atlas
    int width;
    int height;
    int flags;
    int wrap_u;
    int wrap_v;
};
Texture texture_of(uvec4 t0, uvec4 t1, uvec4 t2, uvec4 t3) {
    return Texture(
        uintBitsToFloat(t0.xyz), int(t0.w), uintBitsToFloat(t1.xyz), int(t1.w), int(t2.x), int(t2.y),
        int(t2.z), int(t2.w), int(t3.x), int(t3.y));
}
Texture texture_load(int index) {
    int first = u_first_texture + 4 * index;
    return texture_of(scene_texel(first), scene_texel(first + 1), scene_texel(first + 2), scene_texel(first + 3));
}
