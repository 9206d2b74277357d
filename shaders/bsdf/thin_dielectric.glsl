// SPDX-License-Identifier: MIT
// A pane of a dielectric, so thin that its two smooth interfaces are one surface. It is there where HAS_EXACT_FRESNEL is.
#include "bsdf/fresnel.glsl"
#include "bsdf/model.glsl"
#include "core/math.glsl"

// All orders of reflection between the two interfaces: 2 F / (1 + F) is reflected, and the rest goes straight on (Pharr,
// Jakob and Humphreys 2023, section 9.5.1).
BsdfSample thin_dielectric_sample(Bsdf b, vec3 wo, vec2 u) {
    if (wo.z <= 0.0) return bsdf_no_sample();
    float fresnel = fresnel_dielectric(wo.z, b.eta);
    float reflectance = 2.0 * fresnel / (1.0 + fresnel);
    if (choose_first(reflectance, u.x)) {
        return BsdfSample(vec3(-wo.xy, wo.z), vec3(1.0), reflectance, 1.0, EVENT_REFLECTION | EVENT_DELTA);
    }
    return BsdfSample(-wo, b.transmittance, 1.0 - reflectance, 1.0, EVENT_TRANSMISSION | EVENT_DELTA | EVENT_NULL);
}
