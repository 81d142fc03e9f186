// Twin of src/scene/material/mod.rs.
#ifndef SCENE_MATERIAL_MATERIAL
#define SCENE_MATERIAL_MATERIAL

#include "scene/material/conductor.glsl"
#include "scene/material/dielectric.glsl"
#include "scene/material/diffuse.glsl"
#include "scene/material/scattered.glsl"
#include "scene/material/thin_dielectric.glsl"
#include "transport/specialise.glsl"

const uint MATERIAL_BLACK = 0u;
const uint MATERIAL_DIFFUSE = 1u;
const uint MATERIAL_CONDUCTOR = 2u;
const uint MATERIAL_DIELECTRIC = 3u;
const uint MATERIAL_THIN_DIELECTRIC = 4u;
const uint MATERIAL_NULL = 5u;

// Fields that a kind has no use for are 0.
struct Material {
    vec3 reflectance;
    uint kind;
    // Transmittance of dielectrics, index of refraction of conductors.
    vec3 second;
    // Index of refraction of dielectrics.
    float eta;
    // k of conductors.
    vec3 k;
};

// Whether a material is of this kind, in kernels that know it.
bool is(Material material, uint effect, uint kind) {
    return has(effect) && material.kind == kind;
}

vec3 material_eval(Material material, vec3 wo, vec3 wi) {
    if (is(material, EFFECT_DIFFUSE, MATERIAL_DIFFUSE)) return diffuse_eval(material.reflectance, wo, wi);
    return vec3(0.0);
}

float material_pdf(Material material, uint directions, vec3 wo, vec3 wi) {
    if (is(material, EFFECT_DIFFUSE, MATERIAL_DIFFUSE)) return diffuse_pdf(directions, wo, wi);
    return 0.0;
}

bool material_sample(Material material, uint directions, vec3 wo, uvec4 words, out Scattered s) {
    s = Scattered(vec3(0.0), 0.0, vec3(0.0), false, 1.0);
    if (is(material, EFFECT_DIFFUSE, MATERIAL_DIFFUSE)) {
        return diffuse_sample(directions, material.reflectance, wo, words, s);
    }
    if (is(material, EFFECT_CONDUCTORS, MATERIAL_CONDUCTOR)) {
        return conductor_sample(material.second, material.k, material.reflectance, wo, s);
    }
    if (is(material, EFFECT_DIELECTRICS, MATERIAL_DIELECTRIC)) {
        return dielectric_sample(material.eta, material.reflectance, material.second, wo, words.z, s);
    }
    if (is(material, EFFECT_THIN_DIELECTRICS, MATERIAL_THIN_DIELECTRIC)) {
        return thin_dielectric_sample(material.eta, material.reflectance, material.second, wo, words.z, s);
    }
    if (is(material, EFFECT_NULL, MATERIAL_NULL)) {
        s = straight(wo, 1.0, vec3(1.0));
        return true;
    }
    return false;
}
#endif
