// Traces the samples of blocks: one invocation per pixel and block, path after path.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "accel/compute.glsl"
#include "transport/block.glsl"

layout(local_size_x = 64) in;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < work.pixels * work.blocks) trace_block(i);
}
