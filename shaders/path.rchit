// The triangle that was hit first.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "accel/ray_pipeline.glsl"

layout(location = 0) rayPayloadInEXT Traced traced;
hitAttributeEXT vec2 uv;

void main() {
    traced.t = gl_HitTEXT;
    traced.primitive = uint(gl_PrimitiveID);
    traced.u = uv.x;
    traced.v = uv.y;
}
