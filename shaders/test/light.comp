#version 460
// The functions of scene/light one by one, for comparison with the processor.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

layout(constant_id = 0) const uint FUNCTION = 0;
layout(constant_id = 1) const uint LIGHT_KINDS = 0xFFFFFFFFu;

#include "scene/light/choice.glsl"
#include "scene/scene.glsl"

const uint FUNCTION_LIGHT_SAMPLE = 0u;
const uint FUNCTION_LIGHT_PDF = 1u;

layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Inputs { uint at[24]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Outputs { uint at[16]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Tables {
    LightSampler lights;
    Surfaces surfaces;
};

layout(push_constant, scalar) uniform Push {
    uint64_t inputs;
    uint64_t outputs;
    uint count;
    uint pad;
    uint64_t tables;
} push;

vec3 read_vec3(Inputs x, uint i) {
    return vec3(uintBitsToFloat(x.at[i]), uintBitsToFloat(x.at[i + 1u]), uintBitsToFloat(x.at[i + 2u]));
}

void write_vec3(inout uint y[16], uint i, vec3 v) {
    y[i] = floatBitsToUint(v.x);
    y[i + 1u] = floatBitsToUint(v.y);
    y[i + 2u] = floatBitsToUint(v.z);
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    Inputs x = Inputs(push.inputs + uint64_t(i) * 96ul);
    LightSampler lights = Tables(push.tables).lights;
    Surfaces surfaces = Tables(push.tables).surfaces;
    uint y[16];
    for (uint k = 0u; k < 16u; ++k) y[k] = 0u;
    if (FUNCTION == FUNCTION_LIGHT_SAMPLE) {
        LightSample s;
        uvec4 words = uvec4(x.at[3], x.at[4], x.at[5], x.at[6]);
        if (light_sampler_sample(lights, surfaces, x.at[7], read_vec3(x, 0u), words, s)) {
            y[0] = 1u;
            y[1] = s.direction_only ? 1u : 0u;
            write_vec3(y, 2u, s.to.p);
            write_vec3(y, 5u, s.wi);
            write_vec3(y, 8u, s.emitted);
            y[11] = floatBitsToUint(s.pdf);
            y[12] = s.delta ? 1u : 0u;
        }
    } else if (FUNCTION == FUNCTION_LIGHT_PDF) {
        vec3 ng = read_vec3(x, 10u);
        SurfacePoint hit = SurfacePoint(read_vec3(x, 7u), vec3(0.0), ng, ng, x.at[13], x.at[14]);
        y[0] = floatBitsToUint(light_sampler_pdf(lights, surfaces, x.at[6], read_vec3(x, 0u), read_vec3(x, 3u), hit, x.at[14]));
    }
    Outputs(push.outputs + uint64_t(i) * 64ul).at = y;
}
