// path.comp with the driver's ray queries.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "accel/ray_query.glsl"
#include "transport/block.glsl"

layout(local_size_x = 64) in;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < work.pixels * work.blocks) trace_block(i);
}
