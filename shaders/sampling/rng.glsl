// Twin of src/sampling/rng.rs.
#ifndef SAMPLING_RNG
#define SAMPLING_RNG

uvec4 philox4x32(uvec4 c, uvec2 key) {
    for (uint round = 0u; round < 10u; ++round) {
        uint hi0, lo0, hi1, lo1;
        umulExtended(c.x, 0xD2511F53u, hi0, lo0);
        umulExtended(c.z, 0xCD9E8D57u, hi1, lo1);
        c = uvec4(hi1 ^ c.y ^ key.x, lo1, hi0 ^ c.w ^ key.y, lo0);
        key.x += 0x9E3779B9u;
        key.y += 0xBB67AE85u;
    }
    return c;
}

float unit_f32(uint word) {
    return float(word >> 8) * (1.0 / 16777216.0);
}

bool happens(uint word, float p) {
    return p >= 1.0 || word < uint(p * 4294967296.0);
}
#endif
