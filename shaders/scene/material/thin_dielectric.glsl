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
        s = Scattered(vec3(-wo.x, -wo.y, wo.z), r, reflectance * r, true, 1.0);
    } else {
        float t = 1.0 - r;
        s = Scattered(-wo, t, transmittance * t, true, 1.0);
    }
    return true;
}
#endif
