// Twin of src/scene/material/diffuse.rs.
#ifndef SCENE_MATERIAL_DIFFUSE
#define SCENE_MATERIAL_DIFFUSE

#include "math/warp.glsl"
#include "sampling/rng.glsl"
#include "sampling/strategy.glsl"
#include "scene/material/scattered.glsl"

vec3 diffuse_eval(vec3 reflectance, vec3 wo, vec3 wi) {
    float cos = wo.z > 0.0 && wi.z > 0.0 ? wi.z : 0.0;
    return reflectance * (cos * FRAC_1_PI);
}

float diffuse_pdf(uint directions, vec3 wo, vec3 wi) {
    float pdf = directions == DIRECTIONS_UNIFORM ? uniform_hemisphere_pdf() : cosine_hemisphere_pdf(wi.z);
    return wo.z > 0.0 && wi.z > 0.0 ? pdf : 0.0;
}

bool diffuse_sample(uint directions, vec3 reflectance, vec3 wo, uvec4 words, out Scattered s) {
    vec2 u = vec2(unit_f32(words.x), unit_f32(words.y));
    vec3 wi;
    if (directions == DIRECTIONS_UNIFORM) {
        wi = sample_uniform_hemisphere(u);
    } else {
        wi = sample_cosine_hemisphere(u);
    }
    s = Scattered(wi, diffuse_pdf(directions, wo, wi), diffuse_eval(reflectance, wo, wi), false, 1.0);
    return s.pdf > 0.0;
}
#endif
