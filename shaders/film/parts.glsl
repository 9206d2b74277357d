// SPDX-License-Identifier: MIT
// The light of a pixel in parts, whose sum it is: what is seen to emit, and what is scattered, by the first scattering
// event of its path: by the diffuse part of a BSDF or a medium, or by anything else (glossy, mirrored, refracted); once
// (direct) or more often (indirect). So do Cycles and Arnold divide it.
#include "film/layers.glsl"

// What the film gets: all light, all light and its parts, or what light tracing leaves of it
// (integrator/light_traced.glsl).
#define FILM_LIGHT_ALL 0
#define FILM_LIGHT_PARTS 1
#define FILM_LIGHT_UNTRACED 2
#ifndef FILM_LIGHT
#define FILM_LIGHT FILM_LIGHT_ALL
#endif

#if FILM_LIGHT == FILM_LIGHT_PARTS
struct Parts {
    vec3 emission;
    vec3 direct_diffuse;
    vec3 direct_specular;
    vec3 indirect_diffuse;
    vec3 indirect_specular;
};

Parts film_parts;  // the running means of the fragment's pixel

Parts parts_begin() { return Parts(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)); }

void parts_load(ivec2 texel) {
    film_parts = Parts(layers_load(texel, 0).rgb, layers_load(texel, 1).rgb, layers_load(texel, 2).rgb,
        layers_load(texel, 3).rgb, layers_load(texel, 4).rgb);
}

// Adds radiance that was scattered so many times; of it `diffuse` by the diffuse part at the first.
void parts_receive(inout Parts parts, int events, vec3 radiance, vec3 diffuse) {
    vec3 specular = radiance - diffuse;
    parts.emission += events == 0 ? radiance : vec3(0.0);
    parts.direct_diffuse += events == 1 ? diffuse : vec3(0.0);
    parts.direct_specular += events == 1 ? specular : vec3(0.0);
    parts.indirect_diffuse += events > 1 ? diffuse : vec3(0.0);
    parts.indirect_specular += events > 1 ? specular : vec3(0.0);
}

// A sample, of which there are now 1 / share.
void parts_add(Parts parts, float share) {
    film_parts.emission += (parts.emission - film_parts.emission) * share;
    film_parts.direct_diffuse += (parts.direct_diffuse - film_parts.direct_diffuse) * share;
    film_parts.direct_specular += (parts.direct_specular - film_parts.direct_specular) * share;
    film_parts.indirect_diffuse += (parts.indirect_diffuse - film_parts.indirect_diffuse) * share;
    film_parts.indirect_specular += (parts.indirect_specular - film_parts.indirect_specular) * share;
}
#endif
