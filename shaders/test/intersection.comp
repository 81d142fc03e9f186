#version 460
// The functions of accel one by one, for comparison with the processor.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

layout(constant_id = 0) const uint FUNCTION = 0;

#include "accel/surface.glsl"
#include "accel/triangle.glsl"

const uint FUNCTION_TRIANGLE_CLOSEST = 0u;
const uint FUNCTION_TRIANGLE_ANY = 1u;
const uint FUNCTION_QUADRIC = 2u;
const uint FUNCTION_LEAVE = 3u;
const uint FUNCTION_SEGMENT = 4u;

layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Inputs { uint at[24]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Outputs { uint at[16]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Tables {
    Quadrics quadrics;
    vec3 lo;
    vec3 hi;
};

layout(push_constant, scalar) uniform Push {
    uint64_t inputs;
    uint64_t outputs;
    uint count;
    uint pad;
    uint64_t tables;
} push;

float read_float(Inputs x, uint i) {
    return uintBitsToFloat(x.at[i]);
}

vec3 read_vec3(Inputs x, uint i) {
    return vec3(read_float(x, i), read_float(x, i + 1u), read_float(x, i + 2u));
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
    Tables tables = Tables(push.tables);
    uint y[16];
    for (uint k = 0u; k < 16u; ++k) y[k] = 0u;
    if (FUNCTION == FUNCTION_TRIANGLE_CLOSEST || FUNCTION == FUNCTION_TRIANGLE_ANY) {
        Ray ray = Ray(read_vec3(x, 0u), read_vec3(x, 3u), read_float(x, 6u), x.at[7], x.at[8]);
        Slabs slabs = slabs_new(ray, tables.lo, tables.hi);
        Shear shear = shear_new(ray);
        vec3 v0 = read_vec3(x, 9u), v1 = read_vec3(x, 12u), v2 = read_vec3(x, 15u);
        float t = 0.0;
        vec2 uv = vec2(0.0);
        bool ok;
        if (FUNCTION == FUNCTION_TRIANGLE_CLOSEST) {
            ok = triangle_closest(ray, shear, slabs, v0, v1, v2, x.at[18], read_float(x, 19u), t, uv);
        } else {
            ok = triangle_any(ray, shear, slabs, v0, v1, v2, x.at[18]);
        }
        if (ok) {
            y[0] = 1u;
            write_vec3(y, 1u, vec3(t, uv));
        }
    } else if (FUNCTION == FUNCTION_QUADRIC) {
        Ray ray = ray_new(read_vec3(x, 0u), read_vec3(x, 3u), read_float(x, 6u));
        Slabs slabs = slabs_new(ray, tables.lo, tables.hi);
        Quadric quadric = tables.quadrics.at[x.at[7]];
        float t;
        if (quadric_intersect(quadric, ray, slabs, t)) {
            SurfacePoint at = surface_point_quadric(quadric, ray, Hit(t, quadric.primitive, 0.0, 0.0), 0u);
            y[0] = 1u;
            y[1] = floatBitsToUint(t);
            write_vec3(y, 2u, at.p);
            write_vec3(y, 5u, at.ng);
        }
    } else if (FUNCTION == FUNCTION_LEAVE) {
        Endpoint from = Endpoint(read_vec3(x, 0u), read_vec3(x, 3u), read_vec3(x, 6u), NONE);
        write_vec3(y, 0u, leave(from, read_vec3(x, 9u)).origin);
    } else if (FUNCTION == FUNCTION_SEGMENT) {
        Endpoint from = Endpoint(read_vec3(x, 0u), read_vec3(x, 3u), read_vec3(x, 6u), NONE);
        Endpoint to = Endpoint(read_vec3(x, 9u), read_vec3(x, 12u), read_vec3(x, 15u), NONE);
        Ray ray = segment(from, to);
        write_vec3(y, 0u, ray.origin);
        write_vec3(y, 3u, ray.direction);
    }
    Outputs(push.outputs + uint64_t(i) * 64ul).at = y;
}
