// Nothing was hit.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "accel/ray_pipeline.glsl"
#include "scene/scene.glsl"

layout(location = 0) rayPayloadInEXT Traced traced;

void main() {
    traced.primitive = NONE;
}
