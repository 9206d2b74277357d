// SPDX-License-Identifier: MIT
// The BRDF integration map (Karis 2013): what the specular lobe reflects of white light from everywhere,
// F0 x + F90 y, by the cosine to the normal (s) and the roughness (t). z is the integral of the lobe of
// split_sum/lobe.glsl, which only the measurement of the approximation needs.
#include "core/constants.glsl"
#include "core/math.glsl"
#include "core/hammersley.glsl"
#include "core/texels.glsl"
#include "bsdf/ggx.glsl"

uniform vec2 u_inverse_size;
uniform int u_samples;

OUTPUT(0) out_map;

void main() {
    vec2 place = gl_FragCoord.xy * u_inverse_size;
    float alpha = place.y * place.y;
    vec3 wo = vec3(sqrt(1.0 - place.x * place.x), 0.0, place.x);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < u_samples; i++) {
        vec2 u = hammersley_point(uint(i), uint(u_samples));
        vec3 wh = ggx_sample_vndf(alpha, wo, u);
        vec3 wi = reflect(-wo, wh);
        if (wi.z > 0.0) {
            float grazing = pow(1.0 - clamp(dot(wo, wh), 0.0, 1.0), 5.0);
            sum.xy += vec2(1.0 - grazing, grazing) * ggx_shadowing(vec2(alpha), wo, wi);
        }
        // Half vectors by D cos alone, as those of the prefiltered map.
        sum.z += max(0.0, reflect(-wo, ggx_sample_vndf(alpha, vec3(0.0, 0.0, 1.0), u)).z);
    }
    output_write(out_map, vec4(sum / float(u_samples), 1.0));
}
