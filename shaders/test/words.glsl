// What a test reads and writes: 24 words in, 16 words out per invocation, and tables.
#ifndef TEST_WORDS
#define TEST_WORDS

#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint FUNCTION = 0;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Inputs { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Outputs { uint at[]; };

layout(push_constant, scalar) uniform Test {
    Inputs inputs;
    Outputs outputs;
    uint count;
    uint pad;
    uint64_t tables;
} test;

bool start() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= test.count) return false;
    for (uint k = 0u; k < 16u; ++k) test.outputs.at[i * 16u + k] = 0u;
    return true;
}

uint in_word(uint k) {
    return test.inputs.at[gl_GlobalInvocationID.x * 28u + k];
}

void out_word(uint k, uint word) {
    test.outputs.at[gl_GlobalInvocationID.x * 16u + k] = word;
}
#endif
