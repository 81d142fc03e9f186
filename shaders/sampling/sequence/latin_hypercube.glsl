// Twin of src/sampling/sequence/latin_hypercube.rs.
#ifndef SAMPLING_SEQUENCE_LATIN_HYPERCUBE
#define SAMPLING_SEQUENCE_LATIN_HYPERCUBE

#include "sampling/sequence/draw.glsl"
#include "sampling/sequence/permutation.glsl"

uvec4 latin_hypercube_place(uint index, uint length, uvec4 seeds, uvec4 jitter) {
    uvec4 words;
    for (uint i = 0u; i < 4u; ++i) words[i] = jittered(permute(index, length, seeds[i]), length, jitter[i]);
    return words;
}
#endif
