// SPDX-License-Identifier: MIT
// A small picture, already as the screen shows it, over a larger rectangle of the window.
uniform highp sampler2D u_picture;
uniform vec4 u_rectangle;  // in the window: left, bottom, width, height

layout(location = 0) out vec4 out_color;

void main() { out_color = texture(u_picture, (gl_FragCoord.xy - u_rectangle.xy) / u_rectangle.zw); }
