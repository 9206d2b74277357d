// SPDX-License-Identifier: MIT

// u_row and v_row map a point to the rectangle's own coordinates: inside where both lie in [0, 1].
float rectangle_intersect(vec4 plane, vec4 u_row, vec4 v_row, Ray ray) {
    float distance = plane_intersect(plane.xyz, plane.w, ray);
    vec3 p = ray.origin + distance * ray.direction;
    float u = dot(u_row.xyz, p) + u_row.w;
    float v = dot(v_row.xyz, p) + v_row.w;
    bool inside = abs(u - 0.5) <= 0.5 && abs(v - 0.5) <= 0.5;
    return inside ? distance : INFINITE_DISTANCE;
}
