// SPDX-License-Identifier: MIT

// Point `index` of `count` of the Hammersley set in [0, 1)^2: evenly spaced, and the van der Corput radical
// inverse (Dammertz 2012, Hammersley Points on the Hemisphere); its upper 24 bits, so that it stays below 1.
vec2 hammersley_point(uint index, uint count) {
    uint bits = (index << 16u) | (index >> 16u);
    bits = ((bits & 0x55555555u) << 1u) | ((bits & 0xaaaaaaaau) >> 1u);
    bits = ((bits & 0x33333333u) << 2u) | ((bits & 0xccccccccu) >> 2u);
    bits = ((bits & 0x0f0f0f0fu) << 4u) | ((bits & 0xf0f0f0f0u) >> 4u);
    bits = ((bits & 0x00ff00ffu) << 8u) | ((bits & 0xff00ff00u) >> 8u);
    return vec2(float(index) / float(count), float(bits >> 8u) / 16777216.0);
}
