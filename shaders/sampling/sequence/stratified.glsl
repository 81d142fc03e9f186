// Twin of src/sampling/sequence/stratified.rs.
#ifndef SAMPLING_SEQUENCE_STRATIFIED
#define SAMPLING_SEQUENCE_STRATIFIED

#include "sampling/sequence/draw.glsl"
#include "sampling/sequence/permutation.glsl"

uint stratified_rows(uint length) {
    if (is_power_of_two(length)) return 1u << (findLSB(length) / 2);
    // ⌊√length⌋ = 65535 at most; the float is off by one at most.
    uint root = min(uint(sqrt(float(length))), 65535u);
    if (root * root > length) return root - 1u;
    return length - root * root > 2u * root ? root + 1u : root;
}

// A word in the column and one in the row of a cell.
uvec2 stratified_cell(uint cell, uint length, uvec2 jitter) {
    uint rows = stratified_rows(length);
    uint start, end;
    if (is_power_of_two(length)) {
        uint columns = length >> findLSB(rows);
        start = cell & ~(columns - 1u);
        end = start + columns;
    } else {
        uint64_t n = uint64_t(length), r = uint64_t(rows);
        uint64_t row = uint64_t(cell) * r / n;
        start = uint((row * n + r - 1ul) / r);
        end = uint(((row + 1ul) * n + r - 1ul) / r);
    }
    return uvec2(jittered(cell - start, end - start, jitter.x), span(start, end, length, jitter.y));
}

uvec4 stratified_place(uint index, uint length, uvec4 seeds, uvec4 j) {
    uvec2 xy = stratified_cell(permute(index, length, seeds.x), length, j.xy);
    uint z = jittered(permute(index, length, seeds.y), length, j.z);
    uint w = jittered(permute(index, length, seeds.z), length, j.w);
    return uvec4(xy, z, w);
}
#endif
