// SPDX-License-Identifier: MIT
// Textures of any size out of two arrays, in whose layers of 4096 x 256 texels those of all images follow each other
// (packing/atlas.py). Filtered by hand: a texel is decoded to linear values before it is mixed with its neighbours, as
// glTF 2.0 asks (section 3.9.2), and the neighbours are those of the image, wherever they lie.
#include "scene/texture.glsl"

#ifndef HAS_TEXTURES
#define HAS_TEXTURES 0
#endif
#if HAS_TEXTURES

uniform highp sampler2DArray u_byte_texels;
uniform highp sampler2DArray u_float_texels;
uniform int u_has_float_texels;

// IEC 61966-2-1 for values in [0, 1]. The power 2.4 by a polynomial in the root, minimax to 7e-7 of the value and exact
// at 1: pow() is slow on a software renderer, and may be less precise.
vec3 texture_decode_srgb(vec3 v) {
    vec3 w = v * (1.0 / 1.055) + 0.055 / 1.055;
    vec3 s = sqrt(w);
    vec3 q = 0.8174209 + s * (-1.2003639 + s * (1.1506213 + s * (-0.6264695 + s * 0.14617476)));
    q = 0.97207797 + s * (-0.45941234 + s * q);
    return mix(v * (1.0 / 12.92), w * w * (1.0 + (s - 1.0) * q), greaterThanEqual(v, vec3(0.04045)));
}

// The linear value of a texel; (0, 0) is the upper left one.
vec4 texture_texel(Texture t, int x, int y) {
    int i = t.first + y * t.width + x;
    vec2 center = vec2(i & 4095, (i >> 12) & 255) + 0.5;
    float layer = float(i >> 20);
    if (u_has_float_texels != 0 && (t.flags & TEXTURE_FLOAT) != 0) {
        vec2 size = vec2(textureSize(u_float_texels, 0).xy);
        return textureLod(u_float_texels, vec3(center * (1.0 / size), layer), 0.0);
    }
    vec2 size = vec2(textureSize(u_byte_texels, 0).xy);
    vec4 value = textureLod(u_byte_texels, vec3(center * (1.0 / size), layer), 0.0);
    if ((t.flags & TEXTURE_SRGB) != 0) value.rgb = texture_decode_srgb(value.rgb);
    return value;
}

// A coordinate brought to [0, 1]. Of float32 it is as exact as the coordinate itself: the differences are exact.
float texture_wrap(float u, int mode) {
    if (mode == WRAP_CLAMP) return clamp(u, 0.0, 1.0);
    if (mode == WRAP_REPEAT) return u - floor(u);
    float turn = u - 2.0 * floor(0.5 * u);
    return min(turn, 2.0 - turn);
}

// The texel at `i` from -1 to `size`: beyond the edge lies the other end, a mirror image, or the edge again.
int texture_neighbor(int i, int size, int mode) {
    if (mode == WRAP_REPEAT) return i < 0 ? size - 1 : (i < size ? i : 0);
    return clamp(i, 0, size - 1);
}

// The value at transformed coordinates; row 0 is at v = 0.
vec4 texture_lookup(Texture t, vec2 uv) {
    vec2 position = vec2(texture_wrap(uv.x, t.wrap_u), texture_wrap(uv.y, t.wrap_v)) * vec2(float(t.width), float(t.height));
    if ((t.flags & TEXTURE_NEAREST) != 0) {
        int x = texture_neighbor(int(position.x), t.width, t.wrap_u);
        int y = texture_neighbor(int(position.y), t.height, t.wrap_v);
        return texture_texel(t, x, y);
    }
    vec2 corner = floor(position - 0.5);
    vec2 weight = position - 0.5 - corner;
    int left = texture_neighbor(int(corner.x), t.width, t.wrap_u);
    int right = texture_neighbor(int(corner.x) + 1, t.width, t.wrap_u);
    int upper = texture_neighbor(int(corner.y), t.height, t.wrap_v);
    int lower = texture_neighbor(int(corner.y) + 1, t.height, t.wrap_v);
    vec4 above = mix(texture_texel(t, left, upper), texture_texel(t, right, upper), weight.x);
    vec4 below = mix(texture_texel(t, left, lower), texture_texel(t, right, lower), weight.x);
    return mix(above, below, weight.y);
}

// The value at a point with the two sets of coordinates uv.xy and uv.zw.
vec4 texture_value(Texture t, vec4 uv) {
    vec3 set = vec3(t.coordinates == 0 ? uv.xy : uv.zw, 1.0);
    return texture_lookup(t, vec2(dot(t.u_row, set), dot(t.v_row, set)));
}

float texture_pick(int channel, vec4 value) {
    return channel == 0 ? value.r : (channel == 1 ? value.g : (channel == 2 ? value.b : value.a));
}

// The one channel that the texture is wanted for.
float texture_channel(Texture t, vec4 uv) { return texture_pick(t.channel, texture_value(t, uv)); }

#endif
