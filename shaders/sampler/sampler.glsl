// SPDX-License-Identifier: MIT
// Four uniform numbers in [0, 1) for one pixel, sample index and dimension, and a fifth, `rr_sample`, that is independent
// of them and not stratified, for Russian roulette. A dimension is one use of randomness along a path, four numbers wide.
#include "core/hash.glsl"
#include "core/texels.glsl"
#include "sampler/roulette.glsl"
#include "sampler/stream.glsl"

#define SAMPLER_TEXTURE 0
#define SAMPLER_HASH 1
#ifndef SAMPLER
#define SAMPLER SAMPLER_TEXTURE
#endif

// What the paths of this program use dimensions for; `vertex` counts from 0.
int dimension_camera() { return 0; }                            // xy: place in the pixel, zw: lens
int dimension_vertex(int vertex) { return 1 + vertex; }         // xy: BSDF, zw: light
int dimension_light(int vertex) { return 0x10000 + vertex; }    // where a vertex takes several samples
int dimension_ambient(int vertex) { return 0x20000 + vertex; }
int dimension_medium(int vertex) { return 0x30000 + vertex; }   // xy: free flight through a medium, z: light, w: point to take it from
int dimension_photon(int use) { return 0x40000 + use; }         // of light_tracing.frag

#if SAMPLER == SAMPLER_TEXTURE
#include "sampler/texture.glsl"
#else
#include "sampler/hash.glsl"
#endif
