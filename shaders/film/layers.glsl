// SPDX-License-Identifier: MIT
// Running means of a pixel besides those of the film: up to five textures, which a pass reads as the slices of one array,
// since samplers are scarce, and draws as so many targets after those of the film (gpu/layers.py copies them back).
uniform highp sampler2DArray u_layers;

vec4 layers_load(ivec2 texel, int layer) { return texelFetch(u_layers, ivec3(texel, layer), 0); }
