// Twin of src/sampling/sequence/independent.rs.
#ifndef SAMPLING_SEQUENCE_INDEPENDENT
#define SAMPLING_SEQUENCE_INDEPENDENT

#include "sampling/rng.glsl"
#include "sampling/sequence/draw.glsl"

uvec4 independent_words(Draw draw, uint group) {
    return philox4x32(uvec4(draw.pixel, uint(draw.index), uint(draw.index >> 32), group), draw.key);
}
#endif
