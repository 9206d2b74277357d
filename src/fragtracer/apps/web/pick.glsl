// SPDX-License-Identifier: MIT
// What lies in a place of the picture: the number of its material, or -1. In place of the outputs and main() of
// pathtracer.frag.
layout(location = 0) out vec4 out_picked;

uniform vec2 u_place;  // in [-1, 1]^2, y up

void main() {
    Ray ray = camera_ray_at(u_place, vec2(0.5));
    Hit hit = closest_hit(ray, 0u);
    out_picked = vec4(-1.0);
    if (hit.primitive != NO_PRIMITIVE) out_picked.x = float(surface_at(ray, hit).material);
}
