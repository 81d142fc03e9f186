// Twin of src/sampling/sequence/permutation.rs.
#ifndef SAMPLING_SEQUENCE_PERMUTATION
#define SAMPLING_SEQUENCE_PERMUTATION

#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

const uint PERMUTATION_STEPS = 6u;

// A bijection of the numbers of `bits` bits.
uint mixed(uint i, uint bits, uint64_t keys) {
    uint mask = uint(1ul << bits) - 1u;
    uint half_bits = (bits + 1u) / 2u;
    uint shift = half_bits, other = half_bits > 2u ? half_bits - 1u : 1u;
    for (uint step = 0u; step < PERMUTATION_STEPS; ++step) {
        keys *= 0xD1342543DE82EF95ul;
        i = ((i ^ uint(keys >> 32)) * (uint(keys >> 11) | 1u)) & mask;
        i ^= i >> ((step & 1u) == 0u ? shift : other);
    }
    return i;
}

// `index` < `length`. A power of two needs no walk.
uint permute(uint index, uint length, uint seed) {
    uint bits = uint(findMSB(length - 1u) + 1);
    uint64_t product = (uint64_t(seed) | 0x100000000ul) * 0x9E3779B97F4A7C15ul;
    uint64_t first = product ^ (product >> 32);
    uint i = mixed(index, bits, first);
    while (i >= length) i = mixed(i, bits, first);
    uint key = uint(first), turn, unused;
    umulExtended((key << 7) | (key >> 25), length, turn, unused);
    // i + turn may exceed a word.
    uint rest = length - turn;
    return i >= rest ? i - rest : i + turn;
}
#endif
