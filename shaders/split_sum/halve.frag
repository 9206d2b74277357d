// SPDX-License-Identifier: MIT
// The next level of a cube map: each texel the mean of four, weighted by their solid angle.
#include "core/texels.glsl"
#include "texture/cube.glsl"

uniform highp sampler2D u_cube;  // a single level
uniform int u_size;              // of its faces

OUTPUT(0) out_radiance;

void main() {
    int size = u_size / 2;
    CubePlace place = cube_place(cube_direction(ivec2(gl_FragCoord.xy), size));
    ivec2 corner = cube_texel(place, size, 0) - ivec2(place.face * (size + 2), 0) - 1;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; i++) {
        ivec2 texel = 2 * corner + ivec2(i % 2, i / 2);
        float weight = cube_solid_angle((2.0 * vec2(texel) + 1.0) / float(u_size) - 1.0);
        sum += weight * vec4(texelFetch(u_cube, texel + ivec2(place.face * (u_size + 2), 0) + 1, 0).rgb, 1.0);
    }
    output_write(out_radiance, vec4(sum.rgb / sum.a, 1.0));
}
