// The quadric that was hit first.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "accel/ray_pipeline.glsl"
#include "transport/work.glsl"

layout(location = 0) rayPayloadInEXT Traced traced;

void main() {
    traced.t = gl_HitTEXT;
    traced.primitive = work.tracer.it.quadrics.at[gl_PrimitiveID].primitive;
    traced.u = 0.0;
    traced.v = 0.0;
}
