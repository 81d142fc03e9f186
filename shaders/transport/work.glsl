// What one dispatch does: src/estimator/vulkan/work.rs pushes it.
#ifndef TRANSPORT_WORK
#define TRANSPORT_WORK

#include "moments/moments.glsl"
#include "transport/tracer.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer Masks { uint64_t at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Counter { uint value; };

layout(push_constant, scalar) uniform Work {
    TracerAt tracer;
    // Leaves of this dispatch: [block][pixel][channel].
    Leaves leaves;
    // Stacks of block-tree nodes: [slot][pixel of the film][channel].
    MomentsAt nodes;
    // Which samples of a block had a non-finite channel: [block][pixel].
    Masks masks;
    // How many blocks have one.
    Counter bad;
    // Samples from … to − 1, of all of which this dispatch does `blocks` blocks from `first_block` on.
    uint64_t from;
    uint64_t to;
    uint64_t first_block;
    // Samples of the whole run.
    uint64_t run_length;
    uvec2 key;
    uint first_pixel;
    uint pixels;
    uint blocks;
    // Pixels of the film.
    uint film_pixels;
} work;
#endif
