// SPDX-License-Identifier: MIT
// Iridescence of the facets of Cook-Torrance by a thin film on them, in which light goes to and fro and interferes with
// itself (Belcour and Barla 2017, A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence; Khronos
// Group 2022, KHR_materials_iridescence).
//   F_film = 1 - (1 - F) (1 - A(thickness)) / (1 - A(0)) where the film adds, F A(thickness) / A(0) where it takes away
// F is Schlick's term of the bare material, and A what air, film and a base of the index that F0 says reflect of white light
// by the exact terms, in Rec. 709.
#include "bsdf/fresnel.glsl"
#include "bsdf/model.glsl"
#include "core/math.glsl"

uniform int u_without_iridescence;  // 1: no material has any, which then needs no code

const float IRIDESCENCE_LEAST_COSINE = 1e-4;    // below it a film changes less, in proportion, and nothing at 0
const float IRIDESCENCE_LARGEST_ROOT = 0.9999;  // of F0, of an index of 20000

// The Fourier transform of what red, green and blue see of white light (D65, CIE 1931) over 1 / wavelength is, after an
// optical path x, about the real part of the sum of weight exp(2 pi i k x), with complex k: a fit of our own, within 0.009
// (docs/material.md). What is a power series of exp(2 pi i x / wavelength) thus has the sum of its values at these k.
const int IRIDESCENCE_WAVES = 6;
const vec2 IRIDESCENCE_WAVE[6] = vec2[6](  // real and imaginary part of k in 1/um
    vec2(1.5212, 0.0846), vec2(1.6256, 0.0850), vec2(1.7471, 0.1210),
    vec2(1.9150, 0.1196), vec2(2.1533, 0.1245), vec2(2.3327, 0.1200));
const vec3 IRIDESCENCE_REAL[6] = vec3[6](  // parts of the weights, the real ones with the sum 1
    vec3(-0.1278, 0.0014, 0.0083), vec3(1.3779, -0.2440, -0.0049), vec3(0.5537, 0.6127, -0.1248),
    vec3(-0.8949, 0.7738, -0.1306), vec3(0.0418, -0.1125, 1.1362), vec3(0.0493, -0.0314, 0.1158));
const vec3 IRIDESCENCE_IMAGINARY[6] = vec3[6](
    vec3(0.3158, -0.0337, 0.0009), vec3(0.7028, -0.0040, 0.0024), vec3(-1.4271, 0.8555, -0.0926),
    vec3(0.2605, -0.7294, 0.0790), vec3(0.2716, -0.1968, 0.7786), vec3(-0.1213, 0.1073, -0.7631));

bool iridescence_is_there(Bsdf b) {
    return HAS_EXACT_FRESNEL == 1 && u_without_iridescence == 0 && b.iridescence > 0.0;
}

// What the film adds to the reflectance of one polarisation, with the optical path to and fro in it in um, by the admittances
// of air, film and base. Of amplitudes r and s at the two interfaces the film transmits, with z = exp(2 pi i path / wavelength)
// and rho = r s, (1 - r^2) (1 - s^2) / (1 - rho^2) times the real part of 1 - 2 rho z / (1 + rho z).
vec3 iridescence_polarised_change(float air, float film, vec3 base, float path) {
    vec3 rho = (air - film) / (air + film) * (film - base) / (film + base);
    vec3 sum = (film - air) * (film - base) / (2.0 * film * (air + base));  // -rho / (1 + rho), without an optical path
    for (int i = 0; i < IRIDESCENCE_WAVES; i++) {
        vec2 wave = IRIDESCENCE_WAVE[i] * path;
        vec2 z = exp(-2.0 * PI * wave.y) * cos_sin_turns(fract(wave.x));
        vec3 real = rho * z.x, imaginary = rho * z.y;
        vec3 size = real * real + imaginary * imaginary;
        sum += (IRIDESCENCE_REAL[i] * (real + size) - IRIDESCENCE_IMAGINARY[i] * imaginary) / (1.0 + 2.0 * real + size);
    }
    return 8.0 * air * film * base / ((air + base) * (air * base + film * film)) * sum;
}

// What an interface without a film transmits of one polarisation.
vec3 iridescence_bare(float air, vec3 base) { return 4.0 * air * base / ((air + base) * (air + base)); }

// What the film adds to the reflectance at an angle.
vec3 iridescence_change(Bsdf b, float cos_theta) {
    float air = clamp(cos_theta, IRIDESCENCE_LEAST_COSINE, 1.0);
    vec3 root = min(sqrt(b.f0), IRIDESCENCE_LARGEST_ROOT);
    vec3 less_one = 4.0 * root / ((1.0 - root) * (1.0 - root));  // of the square of the index
    float film2 = square(b.iridescence_ior);
    float film = sqrt(film2 - 1.0 + air * air);  // index times cosine
    vec3 base = sqrt(less_one + air * air);
    vec3 base_p = base / (1.0 + less_one);
    float path = 0.002 * b.iridescence_thickness * film;
    vec3 transmitted = 0.5 * (iridescence_bare(air, base) + iridescence_bare(air, base_p));
    vec3 change = iridescence_polarised_change(air, film, base, path)
        + iridescence_polarised_change(air, film / film2, base_p, path);
    change *= 0.5;
    vec3 fresnel = fresnel_schlick(b.f0, b.f90, air);
    vec3 more = (1.0 - fresnel) / max(transmitted, vec3(1e-6));
    vec3 less = fresnel / max(1.0 - transmitted, vec3(1e-6));
    float share = b.iridescence * clamp(cos_theta / IRIDESCENCE_LEAST_COSINE, 0.0, 1.0);
    return share * clamp(change * mix(more, less, lessThan(change, vec3(0.0))), -fresnel, 1.0 - fresnel);
}

// The Fresnel term of facets, with a film or without.
vec3 iridescence_fresnel(Bsdf b, float cos_theta) {
    vec3 fresnel = fresnel_schlick(b.f0, b.f90, cos_theta);
    if (!iridescence_is_there(b)) return fresnel;
    return clamp(fresnel + iridescence_change(b, cos_theta), 0.0, 1.0);
}

// At normal incidence.
vec3 iridescence_f0(Bsdf b) { return iridescence_is_there(b) ? iridescence_fresnel(b, 1.0) : b.f0; }

// An estimate of what a film adds to what a rough surface reflects at the angle to its mean normal: the larger one of what it
// adds at two angles between which most visible facets are met, and less of what it takes away. That is enough for a base
// that passes the rest twice never to reflect more, together with the facets, than both receive.
vec3 iridescence_rough_change(Bsdf b, float cos_theta) {
    float facing = 0.5 * (cos_theta + sqrt(mix(square(cos_theta), 1.0, square(b.alpha))));
    vec3 change = max(iridescence_change(b, cos_theta * (1.0 - 0.9 * b.alpha)), iridescence_change(b, facing));
    return mix(change, (1.0 - b.alpha) * change, lessThan(change, vec3(0.0)));
}
