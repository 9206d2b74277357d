// SPDX-License-Identifier: MIT
// An equirectangular map as a cube map: each texel the mean of lookups spread over it, so that small bright
// lights keep their energy. Of scene/environment.py: u = 1/2 is -z, u = 3/4 is +x, v = 0 is up.
#include "core/math.glsl"
#include "core/texels.glsl"
#include "texture/cube.glsl"

uniform highp sampler2D u_map;
uniform int u_size;  // of a face
uniform int u_taps;  // along each side of a texel

OUTPUT(0) out_radiance;

vec3 equirect_lookup(vec3 d) {
    vec2 uv = vec2(0.5 + turns_of(vec2(-d.z, d.x)), 2.0 * turns_of(vec2(d.y, length(d.xz))));
    return textureLod(u_map, uv, 0.0).rgb;
}

void main() {
    CubePlace middle = cube_place(cube_direction(ivec2(gl_FragCoord.xy), u_size));
    vec4 sum = vec4(0.0);
    for (int i = 0; i < u_taps * u_taps; i++) {
        vec2 offset = (vec2(i % u_taps, i / u_taps) + 0.5) / float(u_taps) - 0.5;
        CubePlace place = CubePlace(middle.face, middle.st + offset * (2.0 / float(u_size)));
        float weight = cube_solid_angle(place.st);
        sum += weight * vec4(equirect_lookup(cube_point(place, 1.0)), 1.0);
    }
    output_write(out_radiance, vec4(sum.rgb / sum.a, 1.0));
}
