// Twin of src/scene/material/diffuse.rs.
#ifndef SCENE_MATERIAL_DIFFUSE
#define SCENE_MATERIAL_DIFFUSE

#include "math/warp.glsl"
#include "sampling/rng.glsl"
#include "sampling/strategy.glsl"
#include "scene/material/scattered.glsl"

float diffuse_pdf(uint directions, vec3 wo, vec3 wi) {
    float pdf = directions == DIRECTIONS_UNIFORM ? uniform_hemisphere_pdf() : cosine_hemisphere_pdf(wi.z);
    return wo.z > 0.0 && wi.z > 0.0 ? pdf : 0.0;
}

vec3 diffuse_eval(uint directions, vec3 reflectance, vec3 wo, vec3 wi, out float pdf) {
    float cos = wo.z > 0.0 && wi.z > 0.0 ? wi.z : 0.0;
    pdf = diffuse_pdf(directions, wo, wi);
    return reflectance * (cos * FRAC_1_PI);
}

vec3 diffuse_direction(uint directions, uvec4 words) {
    vec2 u = vec2(unit_f32(words.x), unit_f32(words.y));
    if (directions == DIRECTIONS_UNIFORM) return sample_uniform_hemisphere(u);
    return sample_cosine_hemisphere(u);
}
#endif
