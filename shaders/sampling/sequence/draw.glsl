// Twin of src/sampling/sequence/mod.rs: what the sequences share.
#ifndef SAMPLING_SEQUENCE_DRAW
#define SAMPLING_SEQUENCE_DRAW

#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

#include "sampling/rng.glsl"

struct Draw {
    uvec2 key;
    uint pixel;
    // Of the sample.
    uint64_t index;
    // Samples in the whole run (`.length` would be the built-in method).
    uint64_t run_length;
};

uvec4 draw_seeds(Draw draw, uint64_t block, uint group) {
    return philox4x32(uvec4(draw.pixel, uint(block), uint(block >> 32), group | 0x80000000u), draw.key);
}

// Samples per block, block and index within it.
uint draw_strata(Draw draw, out uint64_t block, out uint index) {
    uint64_t length = draw.run_length > 0xFFFFFFFFul ? 0x80000000ul : max(draw.run_length, 1ul);
    if (draw.index < length) {
        block = 0ul;
        index = uint(draw.index);
    } else {
        block = draw.index / length;
        index = uint(draw.index % length);
    }
    return uint(length);
}

bool is_power_of_two(uint x) {
    return (x & (x - 1u)) == 0u;
}

// The word at `jitter`·2⁻³² of the way from `from/of` to `to/of`; never outside.
uint span(uint from, uint to, uint of, uint jitter) {
    uint64_t start = uint64_t(from) << 32;
    uint64_t position = start + uint64_t(to - from) * uint64_t(jitter);
    if (is_power_of_two(of)) return uint(position >> findLSB(of));
    uint64_t word = position / uint64_t(of);
    // Rounding down must not cross the lower edge.
    return uint(word) + uint(word * uint64_t(of) < start);
}

uint jittered(uint stratum, uint strata, uint jitter) {
    return span(stratum, stratum + 1u, strata, jitter);
}
#endif
