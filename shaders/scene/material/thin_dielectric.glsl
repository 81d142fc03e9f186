// Twin of src/scene/material/thin_dielectric.rs.
#ifndef SCENE_MATERIAL_THIN_DIELECTRIC
#define SCENE_MATERIAL_THIN_DIELECTRIC

#include "sampling/rng.glsl"
#include "scene/material/fresnel.glsl"
#include "scene/material/scattered.glsl"

bool thin_dielectric_sample(float eta, vec3 reflectance, vec3 transmittance, vec3 wo, uint word, out Scattered s) {
    if (wo.z <= 0.0) return false;
    float cos;
    float once = fresnel_dielectric(wo.z, eta, cos);
    float r = 2.0 * once / (1.0 + once);
    if (happens(word, r)) {
        s = reflected(wo, r, reflectance);
    } else {
        s = straight(wo, 1.0 - r, transmittance);
    }
    return true;
}
#endif
