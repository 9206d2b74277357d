// SPDX-License-Identifier: MIT
// The irradiance map, divided by pi: what a white Lambert surface of each normal reflects. The sum over all
// texels of one level of the environment.
#include "core/constants.glsl"
#include "core/texels.glsl"
#include "texture/cube.glsl"

uniform highp sampler2D u_environment;
uniform int u_environment_size;  // of a face, at level 0
uniform int u_level;
uniform int u_size;              // of a face of the irradiance map

OUTPUT(0) out_irradiance;

void main() {
    vec3 normal = cube_direction(ivec2(gl_FragCoord.xy), u_size);
    int width = u_environment_size >> u_level;
    int row = cube_first_row(u_environment_size, u_level) + 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < width; y++) {
        vec4 of_row = vec4(0.0);  // in two steps, for the sake of float32
        for (int x = 0; x < width; x++) {
            vec2 st = (2.0 * vec2(x, y) + 1.0) / float(width) - 1.0;
            float length2 = 1.0 + dot(st, st);
            float weight = 1.0 / (length2 * length2);  // the solid angle, and 1 / the length of the point below
            for (int face = 0; face < 6; face++) {
                float cos_theta = max(0.0, dot(normal, cube_point(CubePlace(face, st), 1.0)));
                vec3 radiance = texelFetch(u_environment, ivec2(face * (width + 2) + 1 + x, row + y), 0).rgb;
                of_row += weight * cos_theta * vec4(radiance, 1.0);
            }
        }
        sum += of_row;
    }
    output_write(out_irradiance, vec4(sum.rgb / sum.a, 1.0));
}
