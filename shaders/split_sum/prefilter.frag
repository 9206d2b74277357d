// SPDX-License-Identifier: MIT
// One level of the prefiltered environment (Karis 2013, Real Shading in Unreal Engine 4): the mean radiance
// over the specular lobe of one roughness, seen along the normal and weighted by the cosine. Each sample looks
// up the level whose texels are as large as the sample's share of the lobe (Křivánek and Colbert 2008,
// Real-time Shading with Filtered Importance Sampling), so that bright spots do not show as dots.
#include "core/constants.glsl"
#include "core/math.glsl"
#include "core/frame.glsl"
#include "core/hammersley.glsl"
#include "core/texels.glsl"
#include "bsdf/ggx.glsl"
#include "texture/cube.glsl"

uniform highp sampler2D u_environment;
uniform int u_environment_size;    // of a face, at level 0
uniform int u_environment_levels;
uniform int u_size;                // of a face of this level
uniform float u_alpha;             // 0: the environment itself
uniform int u_samples;

OUTPUT(0) out_radiance;

// Of the environment, for a sample of density pdf in 1/sr.
float prefilter_level(float pdf) {
    float sample_angle = 1.0 / (float(u_samples) * pdf);
    float texel_angle = 4.0 * PI / (6.0 * square(float(u_environment_size)));
    return 0.5 * log2(sample_angle / texel_angle);
}

void main() {
    vec3 normal = cube_direction(ivec2(gl_FragCoord.xy), u_size);
    if (u_alpha == 0.0) {
        float level = log2(float(u_environment_size) / float(u_size));
        output_write(out_radiance, vec4(cube_lookup(u_environment, u_environment_size, u_environment_levels, normal, level), 1.0));
        return;
    }
    Frame frame = frame_from_normal(normal);
    vec3 wo = vec3(0.0, 0.0, 1.0);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < u_samples; i++) {
        vec3 wh = ggx_sample_vndf(u_alpha, wo, hammersley_point(uint(i), uint(u_samples)));
        vec3 wi = reflect(-wo, wh);
        if (wi.z > 0.0) {
            float level = prefilter_level(ggx_sample_vndf_pdf(u_alpha, wo, wh) / (4.0 * dot(wo, wh)));
            vec3 direction = frame_to_world(frame, wi);
            vec3 radiance = cube_lookup(u_environment, u_environment_size, u_environment_levels, direction, level);
            sum += wi.z * vec4(radiance, 1.0);
        }
    }
    output_write(out_radiance, vec4(sum.rgb / sum.a, 1.0));
}
