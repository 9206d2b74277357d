// SPDX-License-Identifier: MIT
// The path tracer: the whole of light transport in one fragment shader. The list below is its
// architecture, bottom up; each file uses only those above it.

#include "core/constants.glsl"
#include "core/math.glsl"
#include "core/frame.glsl"
#include "core/hash.glsl"
#include "core/warp.glsl"

#include "sampler/sampler.glsl"

#include "bsdf/fresnel.glsl"
#include "bsdf/ggx.glsl"
#include "bsdf/cook_torrance.glsl"

#include "generated/scene_layout.glsl"
#include "shape/ray.glsl"
#include "shape/sphere.glsl"
#include "shape/plane.glsl"
#include "shape/rectangle.glsl"
#include "shape/triangle.glsl"
#include "shape/intersect.glsl"
#include "shape/surface.glsl"

#include "emitter/sphere_light.glsl"
#include "emitter/area_light.glsl"
#include "emitter/light.glsl"

#include "camera/thin_lens.glsl"
#include "film/pixel_filter.glsl"
#include "film/film.glsl"
#include "integrator/path.glsl"

layout(location = 0) out vec4 out_mean;      // rgb: mean radiance, a: number of finite samples
layout(location = 1) out vec4 out_variance;  // rgb: sample variance, a: number of non-finite samples

uniform int u_rays;  // paths per pixel in this pass

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Film film = film_load(pixel);
    uint index = film_sample_index(film);
    Path path = path_begin(pixel, index);
    for (int remaining = u_rays; remaining > 0;) {
#if PATH_REGENERATION
        bool alive = path_extend(path);
#else
        while (path_extend(path)) {}
        bool alive = false;
#endif
        if (!alive) {
            film_add(film, path.radiance);
            remaining--;
            index++;
            path = path_begin(pixel, index);
        }
    }
    out_mean = vec4(film.mean, film.count);
    out_variance = vec4(film.variance, film.non_finite);
}
