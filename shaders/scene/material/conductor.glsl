// Twin of src/scene/material/conductor.rs.
#ifndef SCENE_MATERIAL_CONDUCTOR
#define SCENE_MATERIAL_CONDUCTOR

#include "scene/material/fresnel.glsl"
#include "scene/material/scattered.glsl"

bool conductor_sample(vec3 eta, vec3 k, vec3 reflectance, vec3 wo, out Scattered s) {
    if (wo.z <= 0.0) return false;
    s = reflected(wo, 1.0, reflectance * fresnel_conductor(wo.z, eta, k));
    return true;
}
#endif
