// SPDX-License-Identifier: MIT
// Four uniform numbers in [0, 1) for one pixel, sample index and dimension. A dimension is one use
// of randomness along a path (the lens, the light of vertex 3, ...), four numbers wide.

// What the paths of this program use dimensions for; `vertex` counts from 0.
int dimension_camera() { return 0; }
int dimension_light(int vertex) { return 1 + 2 * vertex; }
int dimension_bsdf(int vertex) { return 2 + 2 * vertex; }
int dimension_ambient(int vertex) { return 1024 + vertex; }

#if SAMPLER == SAMPLER_TEXTURE
#include "sampler/texture.glsl"
#else
#include "sampler/hash.glsl"
#endif
