// SPDX-License-Identifier: MIT
// Lobes of light that arrives from few directions, learned from photons for cells of space (fragtracer.guiding). A lobe
// aims at a point, so that it turns with the place that it is seen from, and has a width there. Its density falls like
// that of GGX: nothing near it is met too seldom.
#include "core/constants.glsl"
#include "core/frame.glsl"
#include "core/math.glsl"
#include "core/warp.glsl"
#include "scene/storage.glsl"

#define GUIDING_OFF 0
#define GUIDING_ON 1
#define GUIDING_MEASURED 2  // what paths add are moments in place of radiance: of a sample, and of one without guiding
#ifndef GUIDING
#define GUIDING GUIDING_OFF
#endif
#if GUIDING

const int GUIDING_LOBES = 4;  // of a cell
const float GUIDING_LEAST_ALPHA = 0.01;

UTEXELS(15) u_guiding;          // of each coarse cell where its own begin, and how many there are along an edge; then,
                                // from a multiple of that on, the lobes of those, GUIDING_LOBES texels each
uniform ivec3 u_guiding_size;   // coarse cells
uniform vec3 u_guiding_low;     // where they begin
uniform float u_guiding_scale;  // coarse cells in a metre

struct Lobe {
    vec3 direction;  // unit, of the world
    float alpha;     // width, tan of the angle within which is half of it
    float ratio;     // of the irradiance by this lobe to that by diffuse reflection, for a receiver that faces it
};

uvec4 guiding_texel(int index) { return texel_read(u_guiding, storage_place(index)); }

// Texel of the first lobe of the cell that is nearest to a point.
int guiding_cell(vec3 position) {
    vec3 place = clamp((position - u_guiding_low) * u_guiding_scale, vec3(0.0), vec3(u_guiding_size) - 1e-4);
    ivec3 coarse = ivec3(place);
    uvec4 t = guiding_texel((coarse.z * u_guiding_size.y + coarse.y) * u_guiding_size.x + coarse.x);
    int edge = int(t.y);
    ivec3 fine = ivec3(fract(place) * float(edge));
    return int(t.x) + GUIDING_LOBES * ((fine.z * edge + fine.y) * edge + fine.x);
}

// The lobe `number` of the cell whose lobes begin with texel `first`.
Lobe lobe_load(int first, int number, vec3 position) {
    uvec4 t = guiding_texel(first + number);
    vec3 to_target = uintBitsToFloat(t.xyz) - position;
    float inverse = inversesqrt(dot(to_target, to_target) + 1e-20);
    // The last word is two floats without their lower halves.
    float width = uintBitsToFloat(t.w << 16u);
    float ratio = uintBitsToFloat(t.w & 0xffff0000u);
    return Lobe(to_target * inverse, clamp(width * inverse, GUIDING_LEAST_ALPHA, 1.0), ratio);
}

vec3 lobe_sample(Lobe lobe, vec2 u) {
    float r = lobe.alpha * sqrt(u.y / (1.0 - u.y));
    return normalize(frame_to_world(frame_from_normal(lobe.direction), vec3(r * cos_sin_turns(u.x), 1.0)));
}

// The slope tan(theta) has the density of that of GGX normals, over the solid angle of wi.
float lobe_pdf(Lobe lobe, vec3 wi) {
    float z = dot(lobe.direction, wi);
    float a2 = square(lobe.alpha);
    vec3 off = wi - z * lobe.direction;
    float t = dot(off, off) + a2 * z * z;
    return z > 0.0 ? z * a2 * INVERSE_PI / (t * t) : 0.0;
}

#endif
