// SPDX-License-Identifier: MIT
// Tone curves and the sRGB transfer function: those of display/tone.py.

#define TONE_LINEAR 0
#define TONE_REINHARD 1
#define TONE_ACES 2
#define TONE_AGX 3
#ifndef TONE_CURVE
#define TONE_CURVE TONE_LINEAR
#endif

// Narkowicz 2015, ACES Filmic Tone Mapping Curve.
vec3 tone_aces(vec3 x) {
    x = min(x, 1e6);
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
}

// Sobotka's AgX in the fit of Wrensch 2023, Minimal AgX Implementation: an inset, a curve over 16.5
// stops, and the outset; a power of 2.2 makes the result linear again.
vec3 tone_agx(vec3 x) {
    const mat3 inset = mat3(
        0.842479062253094, 0.0423282422610123, 0.0423756549057051,
        0.0784335999999992, 0.878468636469772, 0.0784336,
        0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    const mat3 outset = mat3(
        1.19687900512017, -0.0528968517574562, -0.0529716355144438,
        -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
        -0.0990297440797205, -0.0989611768448433, 1.15107367264116);
    vec3 stops = clamp(log2(max(inset * x, 1e-10)), -12.47393, 4.026069);
    x = (stops + 12.47393) / 16.5;
    x = ((((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x) + 0.1191) * x - 0.00232;
    return pow(max(outset * x, 0.0), vec3(2.2));
}

vec3 tone_curve(vec3 x) {
#if TONE_CURVE == TONE_REINHARD
    return x / (1.0 + x);
#elif TONE_CURVE == TONE_ACES
    return tone_aces(x);
#elif TONE_CURVE == TONE_AGX
    return tone_agx(x);
#else
    return x;
#endif
}

// IEC 61966-2-1.
vec3 srgb_encode(vec3 x) {
    vec3 curve = 1.055 * pow(max(x, 1e-6), vec3(1.0 / 2.4)) - 0.055;
    return mix(curve, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
}
