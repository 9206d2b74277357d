// SPDX-License-Identifier: MIT
// Points as the camera sees them: the inverse of camera/camera.glsl.
#include "camera/camera.glsl"
#include "core/math.glsl"

// A point seen from one of the lens.
struct CameraView {
    vec3 origin;      // on the lens
    vec3 direction;   // unit, from there to the point
    float distance;
    vec2 position;    // in the picture, in pixels from its lower left corner
    float weight;     // 1/m^2: by it radiance that leaves an element of area across the ray adds to the mean of a pixel;
                      // 0 where the point is behind the camera
};

// u chooses the point of the lens.
CameraView camera_view(vec3 point, vec2 u) {
    mat3 axes = mat3(u_inverse_view);
    vec3 to_point = (point - u_inverse_view[3].xyz) * axes;
    vec3 origin = u_lens_radius > 0.0 ? vec3(u_lens_radius * square_to_disk(u), 0.0) : vec3(0.0);
    vec3 direction = to_point - origin;
    float depth = -direction.z;
    float distance = length(direction);
    CameraView view;
    view.origin = (u_inverse_view * vec4(origin, 1.0)).xyz;
    view.direction = axes * (direction / distance);
    view.distance = distance;
    // In the plane of focus, and from there as through a pinhole.
    vec2 place = direction.xy / depth;
    if (u_lens_radius > 0.0) place += origin.xy / u_focus_distance;
    vec4 middle = u_inverse_projection * vec4(0.0, 0.0, -1.0, 1.0);
    vec4 corner = u_inverse_projection * vec4(1.0, 1.0, -1.0, 1.0);
    vec2 low = middle.xy / -middle.z;
    vec2 half_size = corner.xy / -corner.z - low;
    view.position = (0.5 + 0.5 * (place - low) / half_size) / u_inverse_image_size;
    // A pixel has this area in the plane at distance 1, whose element is cos^3 of a solid angle.
    vec2 pixel = 2.0 * half_size * u_inverse_image_size;
    float cos_theta = depth / distance;
    view.weight = depth > 0.0 ? 1.0 / (square(distance) * cos_theta * square(cos_theta) * pixel.x * pixel.y) : 0.0;
    return view;
}
