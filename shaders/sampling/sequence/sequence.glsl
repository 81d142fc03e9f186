// Twin of src/sampling/sequence/mod.rs: the words of a group.
#ifndef SAMPLING_SEQUENCE_SEQUENCE
#define SAMPLING_SEQUENCE_SEQUENCE

#include "sampling/sequence/draw.glsl"
#include "sampling/sequence/independent.glsl"
#include "sampling/sequence/latin_hypercube.glsl"
#include "sampling/sequence/sobol.glsl"
#include "sampling/sequence/stratified.glsl"
#include "sampling/strategy.glsl"

uvec4 strata_words(uint sequence, Draw draw, uint group) {
    uint64_t block;
    uint index;
    uint length = draw_strata(draw, block, index);
    uvec4 seeds = draw_seeds(draw, block, group), jitter = independent_words(draw, group);
    if (sequence == SEQUENCE_STRATIFIED) return stratified_place(index, length, seeds, jitter);
    return latin_hypercube_place(index, length, seeds, jitter);
}

uvec4 draw_words(uint sequence, Draw draw, uint group) {
    if (sequence == SEQUENCE_INDEPENDENT) return independent_words(draw, group);
    if (sequence == SEQUENCE_SOBOL) return sobol_words(draw, group);
    return strata_words(sequence, draw, group);
}
#endif
