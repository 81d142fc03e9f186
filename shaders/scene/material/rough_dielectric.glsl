// Twin of src/scene/material/rough_dielectric.rs: what follows from the half vector.
#ifndef SCENE_MATERIAL_ROUGH_DIELECTRIC
#define SCENE_MATERIAL_ROUGH_DIELECTRIC

#include "sampling/rng.glsl"
#include "scene/material/fresnel.glsl"
#include "scene/material/microfacet.glsl"

vec3 rough_dielectric_eval(float eta, vec3 reflectance, vec3 transmittance, bool reflects, Half h, out float pdf) {
    float refracted;
    float r = fresnel_dielectric(h.cos_o, eta, refracted);
    if (reflects) {
        float quarter = r * 0.25 * h.d * h.visible_o;
        pdf = quarter;
        return reflectance * (quarter * h.g_i);
    }
    float through = (1.0 - r) * h.d * h.visible_o * (h.cos_o * -h.cos_i) / h.length2;
    pdf = through * (eta * eta);
    return transmittance * (through * h.g_i);
}

bool rough_dielectric_sample(float eta, vec3 m, vec3 wo, uint word, out vec3 wi) {
    float cos_o = dot3(wo, m);
    float cos_t;
    float r = fresnel_dielectric(cos_o, eta, cos_t);
    bool reflects = happens(word, r);
    float inverse = 1.0 / eta;
    wi = reflects ? mirrored(wo, m) : m * (cos_o * inverse - cos_t) - wo * inverse;
    return reflects == (wi.z > 0.0);
}
#endif
