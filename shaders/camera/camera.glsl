// SPDX-License-Identifier: MIT
// Primary rays from the inverse projection and inverse view matrices, through a thin lens (Cook et
// al. 1984, Distributed Ray Tracing). A lens of radius 0 is the pinhole.
#include "core/math.glsl"
#include "core/warp.glsl"
#include "film/pixel_filter.glsl"
#include "shape/ray.glsl"

uniform mat4 u_inverse_view;
uniform mat4 u_inverse_projection;
uniform float u_lens_radius;     // metres
uniform float u_focus_distance;  // metres along the optical axis
uniform vec2 u_inverse_image_size;

// `ndc` in [-1, 1]^2 with y up; `lens` uniform in [0, 1)^2.
Ray camera_ray_at(vec2 ndc, vec2 lens) {
    vec4 target = u_inverse_projection * vec4(ndc, -1.0, 1.0);
    vec3 direction = target.xyz / target.w;
    vec3 origin = vec3(0.0);
    if (u_lens_radius > 0.0) {
        vec3 in_focus = direction * (u_focus_distance / -direction.z);
        origin = vec3(u_lens_radius * square_to_disk(lens), 0.0);
        direction = in_focus - origin;
    }
    return Ray((u_inverse_view * vec4(origin, 1.0)).xyz, normalize(mat3(u_inverse_view) * direction));
}

// Through the pixel; u.xy is the place in it, u.zw on the lens.
Ray camera_ray(ivec2 pixel, vec4 u) {
    vec2 position = vec2(pixel) + 0.5 + pixel_filter_sample(u.xy);
    return camera_ray_at(2.0 * position * u_inverse_image_size - 1.0, u.zw);
}
