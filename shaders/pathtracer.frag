// SPDX-License-Identifier: MIT
// The path tracer: the whole of light transport in one fragment shader. The list below is its
// architecture, bottom up; each file uses only those above it.
#include "core/constants.glsl"
#include "core/texels.glsl"
#include "sampler/sampler.glsl"
#include "film/film.glsl"
#include "film/parts.glsl"
#include "film/work.glsl"
#include "bsdf/bsdf.glsl"
#include "scene/storage.glsl"
#include "texture/texture.glsl"
#include "shape/intersect.glsl"
#include "medium/medium.glsl"
#include "camera/camera.glsl"
#include "material/material.glsl"
#include "light/light.glsl"
#include "guiding/guide.glsl"
#include "integrator/path.glsl"

OUTPUT(0) out_mean;
OUTPUT(1) out_variance;
OUTPUT(2) out_half_difference;
#if FILM_LIGHT == FILM_LIGHT_PARTS
OUTPUT(3) out_emission;
OUTPUT(4) out_direct_diffuse;
OUTPUT(5) out_direct_specular;
OUTPUT(6) out_indirect_diffuse;
OUTPUT(7) out_indirect_specular;
#endif

uniform int u_rays;  // paths per fragment in this pass

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    Work work = work_load(texel);
    Film film = film_load(texel, work.first_sample);
#if FILM_LIGHT == FILM_LIGHT_PARTS
    parts_load(texel);
#endif
    path_trace(film, work.pixel, work.numbers, u_rays);
    if (traversal_was_cut) film_invalidate(film);
    output_write(out_mean, film_mean(film));
    output_write(out_variance, film_variance(film));
    output_write(out_half_difference, film_half_difference(film));
#if FILM_LIGHT == FILM_LIGHT_PARTS
    output_write(out_emission, vec4(film_parts.emission, 0.0));
    output_write(out_direct_diffuse, vec4(film_parts.direct_diffuse, 0.0));
    output_write(out_direct_specular, vec4(film_parts.direct_specular, 0.0));
    output_write(out_indirect_diffuse, vec4(film_parts.indirect_diffuse, 0.0));
    output_write(out_indirect_specular, vec4(film_parts.indirect_specular, 0.0));
#endif
}
