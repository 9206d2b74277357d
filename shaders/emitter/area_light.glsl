// SPDX-License-Identifier: MIT
// Rectangles and triangles that emit from their front, sampled uniformly over their area.

// Density over solid angle at distance `distance` under the angle `cos_theta` to the light's normal;
// 0 from behind.
float area_light_pdf(float area, float distance, float cos_theta) {
    return cos_theta > 0.0 ? square(distance) / (cos_theta * area) : 0.0;
}

// Direction towards the point corner + coordinates . edges in xyz and the distance to it in w.
vec4 area_light_sample(vec3 corner, vec3 edge_u, vec3 edge_v, vec3 origin, vec2 coordinates) {
    vec3 to_light = corner + coordinates.x * edge_u + coordinates.y * edge_v - origin;
    float distance = length(to_light);
    return vec4(to_light / distance, distance);
}
