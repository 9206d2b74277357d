// SPDX-License-Identifier: MIT
// The index of a sample says which stream it belongs to, in its upper 6 bits, and its number in that stream.
// Streams are independent randomisations.
const uint SAMPLER_STREAM_SAMPLES = 1u << 26u;

uint sampler_stream_index(uint stream, uint number) { return stream * SAMPLER_STREAM_SAMPLES + number % SAMPLER_STREAM_SAMPLES; }

// The index of part `part` of a sample that takes `parts` points of one dimension, in the same stream.
uint sampler_part_index(uint index, uint parts, uint part) {
    return sampler_stream_index(index / SAMPLER_STREAM_SAMPLES, index % SAMPLER_STREAM_SAMPLES * parts + part);
}
