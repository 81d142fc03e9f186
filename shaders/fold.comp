// Puts the leaves of a dispatch onto the stacks of block-tree nodes: one invocation per pixel and channel.
// Twin of Stack in src/moments/tree.rs.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "moments/moments.glsl"
#include "transport/work.glsl"

layout(local_size_x = 64) in;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= work.pixels * 3u) return;
    uint pixel = i / 3u, channel = i % 3u;
    uint first = (work.first_pixel + pixel) * 3u + channel, stride = work.film_pixels * 3u;
    // Nodes in use before this dispatch; a partial leaf among them is replaced.
    uint64_t block = work.first_block;
    uint top = bitCount(uint(block)) + bitCount(uint(block >> 32));
    for (uint b = 0u; b < work.blocks; ++b) {
        Moments node = moments_of(work.leaves.at[(b * work.pixels + pixel) * 3u + channel], block * 64ul);
        uint64_t end = (block + 1ul) * 64ul;
        if (end <= work.to) {
            // A full leaf: merged with equal neighbours, as many as the block count has trailing zeros.
            for (uint64_t count = block + 1ul; (count & 1ul) == 0ul; count >>= 1) {
                top -= 1u;
                node = moments_merge(work.nodes.at[first + top * stride], node);
            }
        }
        work.nodes.at[first + top * stride] = node;
        top += 1u;
        block += 1ul;
    }
}
