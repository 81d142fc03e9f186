// Calls one function of sampling/ per specialisation; the host compares with the Rust.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "sampling/discrete.glsl"
#include "sampling/heuristic.glsl"
#include "sampling/rng.glsl"
#include "sampling/sequence/sequence.glsl"
#include "sampling/strategy.glsl"
#include "scene/scene.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint FUNCTION = 0;

const uint PHILOX4X32 = 0u;
const uint UNIT_F32 = 1u;
const uint PERMUTE = 2u;
const uint WORDS_INDEPENDENT = 3u;
const uint WORDS_STRATIFIED = 4u;
const uint WORDS_LATIN_HYPERCUBE = 5u;
const uint WORDS_SOBOL = 6u;
const uint SOBOL = 7u;
const uint DISCRETE = 8u;
const uint HEURISTIC_WEIGHT = 9u;

layout(buffer_reference, scalar, buffer_reference_align = 16) writeonly buffer Results { uint at[]; };

layout(push_constant, scalar) uniform Test {
    // 24 words per invocation.
    uint64_t inputs;
    // 8 words per invocation.
    uint64_t outputs;
    uint count;
} test;

uint words[24];
uint results[8];

uint64_t u64(uint k) { return uint64_t(words[k]) | uint64_t(words[k + 1u]) << 32; }

void put(uint k, float x) { results[k] = floatBitsToUint(x); }
void put(uint k, uint x) { results[k] = x; }

void put(uint k, uvec4 x) {
    for (uint i = 0u; i < 4u; ++i) put(k + i, x[i]);
}

uvec4 words_of(uint sequence) {
    return draw_words(sequence, Draw(uvec2(words[0], words[1]), words[2], u64(3u), u64(5u)), words[7]);
}

void call() {
    switch (FUNCTION) {
        case PHILOX4X32:
            put(0u, philox4x32(uvec4(words[0], words[1], words[2], words[3]), uvec2(words[4], words[5])));
            break;
        case UNIT_F32: put(0u, unit_f32(words[0])); break;
        case PERMUTE: put(0u, permute(words[0], words[1], words[2])); break;
        case WORDS_INDEPENDENT: put(0u, words_of(SEQUENCE_INDEPENDENT)); break;
        case WORDS_STRATIFIED: put(0u, words_of(SEQUENCE_STRATIFIED)); break;
        case WORDS_LATIN_HYPERCUBE: put(0u, words_of(SEQUENCE_LATIN_HYPERCUBE)); break;
        case WORDS_SOBOL: put(0u, words_of(SEQUENCE_SOBOL)); break;
        case SOBOL: put(0u, sobol(words[0])); break;
        case DISCRETE: {
            Words first = Words(u64(0u));
            uint outcome = discrete_pick(first, words[2], words[3], words[4]);
            put(0u, outcome);
            put(1u, discrete_pmf(first, words[2], words[3], outcome));
            break;
        }
        case HEURISTIC_WEIGHT:
            put(0u, heuristic_weight(words[0], uintBitsToFloat(words[1]), uintBitsToFloat(words[2])));
            break;
    }
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= test.count) return;
    Words inputs = Words(test.inputs + uint64_t(i) * 96ul);
    for (uint k = 0u; k < 24u; ++k) words[k] = inputs.at[k];
    for (uint k = 0u; k < 8u; ++k) results[k] = 0u;
    call();
    Results outputs = Results(test.outputs + uint64_t(i) * 32ul);
    for (uint k = 0u; k < 8u; ++k) outputs.at[k] = results[k];
}
