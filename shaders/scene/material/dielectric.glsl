// Twin of src/scene/material/dielectric.rs.
#ifndef SCENE_MATERIAL_DIELECTRIC
#define SCENE_MATERIAL_DIELECTRIC

#include "sampling/rng.glsl"
#include "scene/material/fresnel.glsl"
#include "scene/material/scattered.glsl"

bool dielectric_sample(float eta, vec3 reflectance, vec3 transmittance, vec3 wo, uint word, out Scattered s) {
    if (wo.z <= 0.0) return false;
    float cos;
    float r = fresnel_dielectric(wo.z, eta, cos);
    if (happens(word, r)) {
        s = reflected(wo, r, reflectance);
    } else {
        float t = 1.0 - r, inverse = 1.0 / eta;
        s = Scattered(vec3(-wo.x * inverse, -wo.y * inverse, -cos), t, transmittance * (t * inverse * inverse), true, eta);
    }
    return true;
}
#endif
