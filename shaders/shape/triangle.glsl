// SPDX-License-Identifier: MIT

// u_row and v_row map a point to the weights of the second and third vertex (Baldwin and Weber
// 2016, Fast Ray-Triangle Intersections by Coordinate Transformation).
float triangle_intersect(vec4 plane, vec4 u_row, vec4 v_row, Ray ray) {
    float distance = plane_intersect(plane.xyz, plane.w, ray);
    vec3 p = ray.origin + distance * ray.direction;
    float u = dot(u_row.xyz, p) + u_row.w;
    float v = dot(v_row.xyz, p) + v_row.w;
    return min(min(u, v), 1.0 - u - v) >= 0.0 ? distance : INFINITE_DISTANCE;
}
