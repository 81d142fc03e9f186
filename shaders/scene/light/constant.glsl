// Twin of src/scene/light/constant.rs.
#ifndef SCENE_LIGHT_CONSTANT
#define SCENE_LIGHT_CONSTANT

#include "math/warp.glsl"
#include "sampling/rng.glsl"

vec3 constant_sample(uvec4 words) {
    return sample_uniform_sphere(vec2(unit_f32(words.x), unit_f32(words.y)));
}

float constant_pdf() {
    return uniform_sphere_pdf();
}
#endif
