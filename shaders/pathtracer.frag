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
#include "bsdf/shading_normal.glsl"

#include "generated/scene_layout.glsl"
#include "texture/texture.glsl"

#include "shape/ray.glsl"
#include "shape/sphere.glsl"
#include "shape/plane.glsl"
#include "shape/rectangle.glsl"
#include "shape/triangle.glsl"
#include "shape/mesh.glsl"
#include "shape/intersect.glsl"
#include "shape/surface.glsl"
#include "shape/material.glsl"
#include "shape/alpha.glsl"

#include "emitter/sphere_light.glsl"
#include "emitter/area_light.glsl"
#include "emitter/mesh_light.glsl"
#include "emitter/sun_light.glsl"
#include "emitter/environment.glsl"
#include "emitter/light.glsl"

#include "camera/thin_lens.glsl"
#include "film/pixel_filter.glsl"
#include "film/film.glsl"
#include "split_sum/cube.glsl"
#include "split_sum/maps.glsl"
#include "integrator/path.glsl"
#include "integrator/split_sum.glsl"
#include "integrator/auxiliary.glsl"

layout(location = 0) out vec4 out_mean;      // rgb: mean radiance, a: number of finite samples
layout(location = 1) out vec4 out_variance;  // rgb: sample variance, a: number of non-finite samples

uniform int u_rays;  // paths per pixel in this pass

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Film film = film_load(pixel);
    uint index = film_sample_index(film);
    uint end = index + uint(u_rays);
    float spare;
#if AUXILIARY
    for (; index < end; index++) {
        film_add(film, auxiliary_value(path_begin(pixel, sampler_vec4(pixel, index, dimension_camera(), spare))));
    }
#elif INTEGRATOR == INTEGRATOR_SPLIT_SUM
    for (; index < end; index++) {
        film_add(film, split_sum_value(path_begin(pixel, sampler_vec4(pixel, index, dimension_camera(), spare)), pixel, index));
    }
#else
    Path path = path_begin(pixel, sampler_vec4(pixel, index, dimension_camera(), spare));
    // The loop tests at its end: a software renderer runs a body once more than a leading test lets pass.
    do {
        Vertex vertex = path_extend(path);
#if !PATH_REGENERATION
        while (vertex.scatters) {
            vec4 u = sampler_vec4(pixel, index, dimension_vertex(path.vertex), spare);
            path_gather_direct(path, vertex, pixel, index, u.zw);
            path_scatter(path, vertex, u.xy, spare);
            vertex = path_extend(path);
        }
#endif
        if (!vertex.scatters) {
#if COUNT_WORK
            path.radiance = path_work;
            path_work = vec3(0.0);
#endif
            film_add(film, path.radiance);
            index++;
        }
        // One draw of random numbers serves the path that goes on and the one that begins.
        vec4 u = sampler_vec4(pixel, index, vertex.scatters ? dimension_vertex(path.vertex) : dimension_camera(), spare);
        if (vertex.scatters) {
            path_gather_direct(path, vertex, pixel, index, u.zw);
            path_scatter(path, vertex, u.xy, spare);
        } else {
            path = path_begin(pixel, u);
        }
    } while (index < end);
#endif
#if HAS_MESHES || HAS_ALPHA
    if (scene_is_cut_short) film.count = film.non_finite = -1.0;  // not the samples that were asked for
#endif
    out_mean = vec4(film.mean, film.count);
    out_variance = vec4(film.variance, film.non_finite);
}
