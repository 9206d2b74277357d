// SPDX-License-Identifier: MIT
// A sphere that emits outwards, sampled uniformly over the cone it subtends (Shirley et al. 1996,
// Monte Carlo Techniques for Direct Lighting Calculations, section 3.2.2).

// 1 - cos of the half angle under which the sphere is seen; 0 from inside, where nothing is emitted.
// Written as sin^2 / (1 + cos) to stay precise for distant lights.
float sphere_light_one_minus_cos(vec3 center, float radius, vec3 origin) {
    vec3 to_center = center - origin;
    float sin2 = radius * radius / dot(to_center, to_center);
    return sin2 < 1.0 ? sin2 / (1.0 + sqrt(1.0 - sin2)) : 0.0;
}

// Density over solid angle at `origin` of every direction that meets the sphere.
float sphere_light_pdf(vec3 center, float radius, vec3 origin) {
    float one_minus_cos = sphere_light_one_minus_cos(center, radius, origin);
    return one_minus_cos > 0.0 ? square_to_uniform_cone_pdf(one_minus_cos) : 0.0;
}

// Direction towards the sphere in xyz and the distance to its near side in w; w = 0 from inside.
vec4 sphere_light_sample(vec3 center, float radius, vec3 origin, vec2 u) {
    float one_minus_cos_max = sphere_light_one_minus_cos(center, radius, origin);
    if (one_minus_cos_max <= 0.0) return vec4(0.0);
    vec3 to_center = center - origin;
    float center_distance = length(to_center);
    vec3 local = square_to_uniform_cone(u, one_minus_cos_max);
    vec3 direction = frame_to_world(frame_from_normal(to_center / center_distance), local);
    float half_chord = sqrt(max(0.0, square(radius) - square(center_distance) * dot(local.xy, local.xy)));
    return vec4(direction, center_distance * local.z - half_chord);
}
