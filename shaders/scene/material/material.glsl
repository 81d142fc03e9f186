// Twin of src/scene/material/mod.rs.
#ifndef SCENE_MATERIAL_MATERIAL
#define SCENE_MATERIAL_MATERIAL

#include "scene/material/diffuse.glsl"

const uint MATERIAL_BLACK = 0u;
const uint MATERIAL_DIFFUSE = 1u;

struct Material {
    vec3 reflectance;
    uint kind;
};

vec3 material_eval(Material material, vec3 wo, vec3 wi) {
    return material.kind == MATERIAL_DIFFUSE ? diffuse_eval(material.reflectance, wo, wi) : vec3(0.0);
}

float material_pdf(Material material, uint directions, vec3 wo, vec3 wi) {
    return material.kind == MATERIAL_DIFFUSE ? diffuse_pdf(directions, wo, wi) : 0.0;
}

bool material_sample(Material material, uint directions, vec3 wo, uvec4 words, out vec3 wi, out float pdf) {
    wi = vec3(0.0);
    pdf = 0.0;
    return material.kind == MATERIAL_DIFFUSE && diffuse_sample(directions, wo, words, wi, pdf);
}
#endif
