// SPDX-License-Identifier: MIT
// What guiding is worth: the variance of a sample, and the second moment that it would have without guiding, both from
// paths that guiding has drawn. A part c of the radiance, found where the path so far has been drawn r times as often as
// without guiding, counts c r there; and the path comes up 1 / r times as often. And how long the paths are.
#include "core/math.glsl"
#include "guiding/lobes.glsl"

struct Moments {
    float odds;             // density of the path so far over that without guiding
    float found;            // luminance so far
    float unguided;         // and what it would be without guiding
    float unguided_moment;  // its square, times how much more often it would have been drawn
    float rays;             // so far
};

Moments moments_begin() { return Moments(1.0, 0.0, 0.0, 0.0, 1.0); }

void moments_find(inout Moments moments, vec3 radiance) {
    float part = luminance(radiance) - moments.found;
    moments.unguided_moment += part * (part * moments.odds + 2.0 * moments.unguided);
    moments.unguided += part * moments.odds;
    moments.found += part;
}

// After a vertex where the path has found `radiance` in all, and gone on in a direction with `odds`.
void moments_scatter(inout Moments moments, vec3 radiance, float odds) {
#if GUIDING == GUIDING_MEASURED
    moments_find(moments, radiance);
    moments.odds *= odds;
    moments.rays += 1.0;
#endif
}

// What the film gets of a path that has found `radiance`.
vec3 moments_of_path(Moments moments, vec3 radiance) {
#if GUIDING == GUIDING_MEASURED
    moments_find(moments, radiance);
    return vec3(moments.found, moments.unguided_moment, moments.rays);
#else
    return radiance;
#endif
}
