// Calls one function of sampling/ per specialisation; the host compares with the Rust.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "sampling/discrete.glsl"
#include "sampling/heuristic.glsl"
#include "sampling/rng.glsl"
#include "sampling/sequence/sequence.glsl"
#include "sampling/strategy.glsl"
#include "scene/scene.glsl"
#include "test/words.glsl"

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

uint64_t u64(uint k) { return uint64_t(in_word(k)) | uint64_t(in_word(k + 1u)) << 32; }

void put(uint k, float x) { out_word(k, floatBitsToUint(x)); }
void put(uint k, uint x) { out_word(k, x); }

void put(uint k, uvec4 x) {
    for (uint i = 0u; i < 4u; ++i) put(k + i, x[i]);
}

uvec4 words_of(uint sequence) {
    return draw_words(sequence, Draw(uvec2(in_word(0u), in_word(1u)), in_word(2u), u64(3u), u64(5u)), in_word(7u));
}

void main() {
    if (!start()) return;
    switch (FUNCTION) {
        case PHILOX4X32:
            put(0u, philox4x32(uvec4(in_word(0u), in_word(1u), in_word(2u), in_word(3u)), uvec2(in_word(4u), in_word(5u))));
            break;
        case UNIT_F32: put(0u, unit_f32(in_word(0u))); break;
        case PERMUTE: put(0u, permute(in_word(0u), in_word(1u), in_word(2u))); break;
        case WORDS_INDEPENDENT: put(0u, words_of(SEQUENCE_INDEPENDENT)); break;
        case WORDS_STRATIFIED: put(0u, words_of(SEQUENCE_STRATIFIED)); break;
        case WORDS_LATIN_HYPERCUBE: put(0u, words_of(SEQUENCE_LATIN_HYPERCUBE)); break;
        case WORDS_SOBOL: put(0u, words_of(SEQUENCE_SOBOL)); break;
        case SOBOL: put(0u, sobol(in_word(0u))); break;
        case DISCRETE: {
            Words first = Words(test.tables);
            uint outcome = discrete_pick(first, in_word(2u), in_word(3u), in_word(4u));
            put(0u, outcome);
            put(1u, discrete_pmf(first, in_word(2u), in_word(3u), outcome));
            break;
        }
        case HEURISTIC_WEIGHT:
            put(0u, heuristic_weight(in_word(0u), uintBitsToFloat(in_word(1u)), uintBitsToFloat(in_word(2u))));
            break;
    }
}
