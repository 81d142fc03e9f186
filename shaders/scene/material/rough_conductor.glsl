// Twin of src/scene/material/rough_conductor.rs: what follows from the half vector.
#ifndef SCENE_MATERIAL_ROUGH_CONDUCTOR
#define SCENE_MATERIAL_ROUGH_CONDUCTOR

#include "scene/material/fresnel.glsl"
#include "scene/material/microfacet.glsl"

vec3 rough_conductor_eval(vec3 eta, vec3 k, vec3 reflectance, Half h, out float pdf) {
    float quarter = 0.25 * h.d * h.visible_o;
    pdf = quarter;
    return reflectance * fresnel_conductor(h.cos_o, eta, k) * (quarter * h.g_i);
}
#endif
