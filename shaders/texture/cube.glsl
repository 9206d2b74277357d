// SPDX-License-Identifier: MIT
// Cube maps in one flat texture: the six faces in a row, the levels one above the other, each half as wide as
// the one before. Every face has a rim of one texel, a copy of what lies beyond its edge on the neighbour, so
// bilinear filtering is seamless and needs neither a cube sampler nor a mip chain of the driver.
//
// Faces are numbered +x, -x, +y, -y, +z, -z. Seen from inside, s runs to the right and t upwards; above and
// below, the edge next to -z is the lower and the upper one.

struct CubePlace { int face; vec2 st; };  // st in [-1, 1]^2

CubePlace cube_place(vec3 direction) {
    vec3 a = abs(direction);
    vec3 side = vec3(direction.x < 0.0 ? -1.0 : 1.0, direction.y < 0.0 ? -1.0 : 1.0, direction.z < 0.0 ? -1.0 : 1.0);
    if (a.x >= a.y && a.x >= a.z) return CubePlace(side.x < 0.0 ? 1 : 0, vec2(side.x * direction.z, direction.y) / a.x);
    if (a.y >= a.z) return CubePlace(side.y < 0.0 ? 3 : 2, vec2(direction.x, side.y * direction.z) / a.y);
    return CubePlace(side.z < 0.0 ? 5 : 4, vec2(-side.z * direction.x, direction.y) / a.z);
}

// The point of the face at (st, depth), depth 1 being the face itself; not of unit length.
vec3 cube_point(CubePlace place, float depth) {
    float side = place.face % 2 == 0 ? 1.0 : -1.0;
    if (place.face < 2) return vec3(side * depth, place.st.y, side * place.st.x);
    if (place.face < 4) return vec3(place.st.x, side * depth, side * place.st.y);
    return vec3(-side * place.st.x, place.st.y, side * depth);
}

// What a texel of a level of faces `size` wide stands for. `texel` counts from the lower left of the level,
// rims included: those have the direction of the neighbour's texel next to the edge, corners their own.
vec3 cube_direction(ivec2 texel, int size) {
    int face = texel.x / (size + 2);
    vec2 st = vec2(2 * (texel - ivec2(face * (size + 2), 0)) - 1) / float(size) - 1.0;
    vec2 beyond = max(abs(st) - 1.0, 0.0);
    float depth = beyond.x > 0.0 && beyond.y > 0.0 ? 1.0 : 1.0 - beyond.x - beyond.y;
    return normalize(cube_point(CubePlace(face, clamp(st, -1.0, 1.0)), depth));
}

// Solid angle per area of st.
float cube_solid_angle(vec2 st) { return pow(1.0 + dot(st, st), -1.5); }

// The first row of a level, where those of level 0 are `size` wide, a power of two.
int cube_first_row(int size, int level) { return 2 * size - ((2 * size) >> level) + 2 * level; }

// The texel of a level that holds the place.
ivec2 cube_texel(CubePlace place, int size, int level) {
    int width = size >> level;
    ivec2 inside = clamp(ivec2((0.5 * place.st + 0.5) * float(width)), ivec2(0), ivec2(width - 1));
    return ivec2(place.face * (width + 2), cube_first_row(size, level)) + 1 + inside;
}

vec3 cube_bilinear(highp sampler2D cube, CubePlace place, int size, int level) {
    float width = float(size >> level);
    vec2 corner = vec2(float(place.face) * (width + 2.0), float(cube_first_row(size, level))) + 1.0;
    return textureLod(cube, (corner + (0.5 * place.st + 0.5) * width) / vec2(textureSize(cube, 0)), 0.0).rgb;
}

// Between the texels and between the levels, of which there are `levels`.
vec3 cube_lookup(highp sampler2D cube, int size, int levels, vec3 direction, float level) {
    CubePlace place = cube_place(direction);
    level = clamp(level, 0.0, float(levels - 1));
    int lower = min(int(level), max(levels - 2, 0));
    vec3 value = cube_bilinear(cube, place, size, lower);
    if (levels == 1) return value;
    return mix(value, cube_bilinear(cube, place, size, lower + 1), level - float(lower));
}
