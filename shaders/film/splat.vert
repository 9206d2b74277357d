// SPDX-License-Identifier: MIT
// A point for each photon that light_tracing.frag has drawn, on the pixel that sees it.
uniform highp sampler2D u_splats;  // out_splat and out_place of that program
uniform highp sampler2D u_places;
uniform highp vec2 u_size;         // of what is drawn on, in pixels; its highest row is not of the picture

flat out highp vec3 splat_radiance;

void main() {
    int width = textureSize(u_splats, 0).x;
    ivec2 texel = ivec2(gl_VertexID % width, gl_VertexID / width);
    vec4 splat = texelFetch(u_splats, texel, 0);
    vec2 pixel = texelFetch(u_places, texel, 0).xy;
    splat_radiance = splat.rgb;
    if (splat.a < 0.0) {  // counted: in red if it is not finite, in green if the driver has ended its way
        pixel = vec2(0.0, u_size.y - 1.0);
        splat_radiance = splat.a > -1.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
    }
    gl_Position = splat.a == 0.0 ? vec4(2.0, 2.0, 0.0, 1.0) : vec4(2.0 * (pixel + 0.5) / u_size - 1.0, 0.0, 1.0);
}
