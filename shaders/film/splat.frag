// SPDX-License-Identifier: MIT
// The radiance of a photon and its square, to be added to the sums of its pixel by blending.
flat in highp vec3 splat_radiance;

layout(location = 0) out vec4 out_radiance;
layout(location = 1) out vec4 out_square;

void main() {
    out_radiance = vec4(splat_radiance, 0.0);
    out_square = vec4(splat_radiance * splat_radiance, 0.0);
}
