// The samples of one block of one pixel, path after path, and their moments.
#ifndef TRANSPORT_BLOCK
#define TRANSPORT_BLOCK

#include "moments/moments.glsl"
#include "transport/path.glsl"
#include "transport/work.glsl"

void trace_block(uint i) {
    uint pixel = work.first_pixel + i % work.pixels;
    uint64_t first = (work.first_block + uint64_t(i / work.pixels)) * 64ul;
    uint64_t start = max(first, work.from), end = min(first + 64ul, work.to);
    Leaf leaves[3];
    // A partial leaf lies on top of the full nodes.
    uint64_t blocks = work.first_block;
    uint partial = ((bitCount(uint(blocks)) + bitCount(uint(blocks >> 32))) * work.film_pixels + pixel) * 3u;
    for (uint c = 0u; c < 3u; ++c) {
        if (start > first) {
            leaves[c] = leaf_of(work.nodes.at[partial + c], first);
        } else {
            leaves[c] = leaf_new();
        }
    }
    uint64_t bad = 0ul;
    Draw draw = Draw(work.key, pixel, start, work.run_length);
    Path path;
    bool live = false;
    // One loop over edges, not one over samples around one over edges: invocations whose path has ended go on with the next.
    while (true) {
        if (!live) {
            if (draw.index >= end) break;
            path_start(work.tracer, draw, path);
            live = true;
        }
        live = MAX_DEPTH > 0u && path_advance(work.tracer, draw, path);
        if (!live) {
            uint index = uint(draw.index - first);
            bool finite = true;
            for (uint c = 0u; c < 3u; ++c) finite = leaf_push(leaves[c], path.radiance[c], index) && finite;
            bad |= finite ? 0ul : 1ul << index;
            draw.index += 1ul;
        }
    }
    for (uint c = 0u; c < 3u; ++c) work.leaves.at[i * 3u + c] = leaves[c];
    work.masks.at[i] = bad;
    if (bad != 0ul) atomicAdd(work.bad.value, 1u);
}
#endif
