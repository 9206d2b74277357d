// SPDX-License-Identifier: MIT

// Schlick 1994, An Inexpensive BRDF Model for Physically-Based Rendering, eq. 15, with the
// reflectance at grazing incidence f90 (1 for every bare surface).
vec3 fresnel_schlick(vec3 f0, vec3 f90, float cos_theta) {
    float m = clamp(1.0 - cos_theta, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (f90 - f0) * (m2 * m2 * m);
}

// An estimate of what a rough surface reflects at the angle to its mean normal: at grazing angles less than
// a smooth one, since its facets tilt. The form of Lagarde 2011, Adopting a Physically Based Shading Model,
// with alpha in the place of roughness, which is enough for a base that passes the rest twice never to
// reflect more, together with a GGX lobe of that width, than both receive.
vec3 fresnel_schlick_rough(vec3 f0, vec3 f90, float alpha, float cos_theta) {
    return fresnel_schlick(f0, max((1.0 - alpha) * f90, f0), cos_theta);
}
