// SPDX-License-Identifier: MIT
// Tables that a program reads texel by texel, and what it draws: textures and color outputs, or images in the language that
// has them. llvmpipe reads images in 0.4 to 0.6 of the time, and with vectors of 512 bits it compiles no program with color
// outputs (docs/performance.md). Each image has a unit of its own: outputs from 0 on, tables from 8 on.
#if defined(HAS_IMAGES)
#define TEXELS(unit) layout(rgba32f, binding = unit) readonly uniform highp image2D
#define UTEXELS(unit) layout(rgba32ui, binding = unit) readonly uniform highp uimage2D
#define TEXELS_3D(unit) layout(rgba32f, binding = unit) readonly uniform highp image3D
#define OUTPUT(unit) layout(rgba32f, binding = unit) writeonly uniform highp image2D
#define texel_read(texels, place) imageLoad(texels, place)
#define texel_read_3d(texels, place) imageLoad(texels, place)
#define output_write(output, value) imageStore(output, ivec2(gl_FragCoord.xy), value)
#else
#define TEXELS(unit) uniform highp sampler2D
#define UTEXELS(unit) uniform highp usampler2D
#define TEXELS_3D(unit) uniform highp sampler3D
#define OUTPUT(unit) layout(location = unit) out vec4
// At the centers of texels: for texelFetch llvmpipe, of a browser say, looks up the level for each of its lanes.
#define texel_read(texels, place) textureLod(texels, (vec2(place) + 0.5) / vec2(textureSize(texels, 0)), 0.0)
#define texel_read_3d(texels, place) textureLod(texels, (vec3(place) + 0.5) / vec3(textureSize(texels, 0)), 0.0)
#define output_write(output, value) output = value
#endif
