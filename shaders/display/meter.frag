// SPDX-License-Identifier: MIT
// The mean luminance of each cell of 4 x 4 pixels of the film, -1 where none is finite (display/exposure.py).
#include "core/constants.glsl"
#include "core/math.glsl"

uniform highp sampler2D u_film_mean;

layout(location = 0) out vec4 out_luminance;

void main() {
    ivec2 size = textureSize(u_film_mean, 0);
    ivec2 first = 4 * ivec2(gl_FragCoord.xy);
    float sum = 0.0;
    float count = 0.0;
    for (int y = 0; y < 4; y++) {
        for (int x = 0; x < 4; x++) {
            ivec2 pixel = first + ivec2(x, y);
            vec3 radiance = texelFetch(u_film_mean, min(pixel, size - 1), 0).rgb;
            if (pixel.x < size.x && pixel.y < size.y && is_finite(radiance)) {
                sum += luminance(clamp(radiance, 0.0, 1e30));
                count += 1.0;
            }
        }
    }
    out_luminance = vec4(count > 0.0 ? sum / count : -1.0);
}
