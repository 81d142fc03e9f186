// What was hit first.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "accel/ray_pipeline.glsl"
#include "transport/work.glsl"

layout(location = 0) rayPayloadInEXT Traced traced;
hitAttributeEXT vec2 uv;

void main() {
    bool triangle = gl_HitKindEXT == gl_HitKindFrontFacingTriangleEXT || gl_HitKindEXT == gl_HitKindBackFacingTriangleEXT;
    traced.t = gl_HitTEXT;
    traced.primitive = uint(gl_PrimitiveID);
    traced.u = triangle ? uv.x : 0.0;
    traced.v = triangle ? uv.y : 0.0;
    if (!triangle) traced.primitive = work.tracer.it.quadrics.at[traced.primitive].primitive;
}
