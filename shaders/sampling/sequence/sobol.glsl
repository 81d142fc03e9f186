// Twin of src/sampling/sequence/sobol.rs.
#ifndef SAMPLING_SEQUENCE_SOBOL
#define SAMPLING_SEQUENCE_SOBOL

#extension GL_EXT_control_flow_attributes : require

#include "sampling/sequence/draw.glsl"

// Dimensions 0 and 1 of a point, with reversed bits.
uvec2 sobol_low_reversed(uint index) {
    uint p = index;
    p ^= (p & 0xAAAAAAAAu) >> 1;
    p ^= (p & 0xCCCCCCCCu) >> 2;
    p ^= (p & 0xF0F0F0F0u) >> 4;
    p ^= (p & 0xFF00FF00u) >> 8;
    p ^= (p & 0xFFFF0000u) >> 16;
    return uvec2(index, p);
}

// The same of dimensions 2 and 3. The direction numbers come from their recurrences (v = x² + x + 1, w = x³ + x + 1), which an
// unrolled loop turns into constants.
uvec2 sobol_high_reversed(uint index) {
    uint v0 = 1u, v1 = 3u, w0 = 1u, w1 = 3u, w2 = 4u;
    uvec2 p = uvec2(0u);
    [[unroll]] for (int bit = 0; bit < 32; ++bit) {
        uint chosen = uint(bitfieldExtract(int(index), bit, 1));
        p.x ^= v0 & chosen;
        p.y ^= w0 & chosen;
        uint v2 = v0 ^ (v0 << 2) ^ v1;
        uint w3 = w0 ^ (w0 << 3) ^ w1;
        v0 = v1;
        v1 = v2;
        w0 = w1;
        w1 = w2;
        w2 = w3;
    }
    return p;
}

// Point `index` of the unscrambled sequence, as fractions of 2³².
uvec4 sobol(uint index) {
    return bitfieldReverse(uvec4(sobol_low_reversed(index), sobol_high_reversed(index)));
}

uint owen_reversed(uint x, uint seed) {
    x ^= x * 0x3D20ADEAu;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526C56u;
    return x ^ (x * 0x53A22864u);
}

struct SobolSet {
    uint shuffle;
    uvec4 scramble;
};
const uint SOBOL_SETS = 1u << 30;

SobolSet sobol_set_new(uvec4 s) {
    uint b = (s.y << 8) | (s.y >> 24), c = (s.z << 16) | (s.z >> 16), d = (s.w << 24) | (s.w >> 8);
    return SobolSet(s.x ^ b ^ c ^ d, s);
}

// Dimensions 0 and 1 of a sample, or 2 and 3 if `high`.
uvec2 sobol_set_pair(SobolSet set, bool high, uint64_t index) {
    uint shuffled = bitfieldReverse(owen_reversed(bitfieldReverse(uint(index)), set.shuffle));
    uvec2 p, s;
    if (high) {
        p = sobol_high_reversed(shuffled);
        s = set.scramble.zw;
    } else {
        p = sobol_low_reversed(shuffled);
        s = set.scramble.xy;
    }
    return bitfieldReverse(uvec2(owen_reversed(p.x, s.x), owen_reversed(p.y, s.y)));
}

// Names of the two sets of a group; whether its words are dimensions 2 and 3 of them.
uvec2 sobol_sets(uint group, out bool high) {
    uint vertex = group / 2u, light = group % 2u;
    uint set = SOBOL_SETS | (2u * (vertex + 1u - light));
    high = light == 1u;
    return uvec2(set, set + 1u);
}

uvec4 sobol_words(Draw draw, uint group) {
    bool high;
    uvec2 sets = sobol_sets(group, high);
    uint64_t block = draw.index >> 32;
    SobolSet a = sobol_set_new(draw_seeds(draw, block, sets.x));
    SobolSet b = sobol_set_new(draw_seeds(draw, block, sets.y));
    return uvec4(sobol_set_pair(a, high, draw.index), sobol_set_pair(b, high, draw.index));
}
#endif
