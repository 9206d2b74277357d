// SPDX-License-Identifier: MIT

// Schlick 1994, An Inexpensive BRDF Model for Physically-Based Rendering, eq. 15, with the
// reflectance at grazing incidence f90 (1 for every bare surface).
vec3 fresnel_schlick(vec3 f0, float f90, float cos_theta) {
    float m = clamp(1.0 - cos_theta, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (vec3(f90) - f0) * (m2 * m2 * m);
}
