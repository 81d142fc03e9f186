// Twin of src/scene/material/mod.rs. What rough materials share is in here once: drivers copy every call into place.
#ifndef SCENE_MATERIAL_MATERIAL
#define SCENE_MATERIAL_MATERIAL

#include "scene/material/conductor.glsl"
#include "scene/material/dielectric.glsl"
#include "scene/material/diffuse.glsl"
#include "scene/material/scattered.glsl"
#include "scene/material/thin_dielectric.glsl"
#include "scene/scene.glsl"
#include "transport/specialise.glsl"
#ifdef FULL
#include "scene/material/plastic.glsl"
#include "scene/material/rough_conductor.glsl"
#include "scene/material/rough_dielectric.glsl"
#endif

const uint MATERIAL_BLACK = 0u;
const uint MATERIAL_DIFFUSE = 1u;
const uint MATERIAL_CONDUCTOR = 2u;
const uint MATERIAL_DIELECTRIC = 3u;
const uint MATERIAL_THIN_DIELECTRIC = 4u;
const uint MATERIAL_NULL = 5u;
const uint MATERIAL_ROUGH_CONDUCTOR = 6u;
const uint MATERIAL_ROUGH_DIELECTRIC = 7u;
const uint MATERIAL_PLASTIC = 8u;
const uint MATERIAL_ROUGH_PLASTIC = 9u;
const uint MATERIAL_MIXTURE = 10u;
const uint MIXTURE_DEPTH = 4u;
// Of roughness.
const float SMALLEST_ALPHA = 1e-4, LARGEST_ALPHA = 100.0;

// Fields that a kind has no use for are 0.
struct Material {
    vec3 reflectance;
    uint kind;
    // Transmittance of dielectrics, index of refraction of conductors, what coats reflect.
    vec3 second;
    // Index of refraction of dielectrics and coats.
    float eta;
    // k of conductors.
    vec3 k;
    // Of microfacets.
    uint distribution;
    vec2 alpha;
    // Of coats.
    uint table;
    uint nonlinear;
    float internal;
    float specular_weight;
    // Of reflectance, second and alpha; NONE where they are the same everywhere.
    uvec4 textures;
    // What a mixture is made of; alpha.x is the weight of the second.
    uvec2 materials;
    // Scale of a bump map, or the colour of a constant normal map.
    vec3 relief;
    // 0 none, 1 bump map, 2 normal map; and RELIEF_…
    uint relief_mode;
    // Or NONE.
    uint relief_texture;
};

// Whether a material is of this kind, in kernels that know it.
bool is(Material material, uint effect, uint kind) {
    return has(effect) && material.kind == kind;
}

#ifdef FULL
Coat coat_of(Material material) {
    return Coat(material.eta, material.internal, material.nonlinear != 0u, material.specular_weight);
}

vec3 coated_eval(Material material, Floats tables, uint directions, vec3 wo, vec3 wi, out float pdf) {
    pdf = 0.0;
    bool rough_conductor = is(material, EFFECT_ROUGH_CONDUCTORS, MATERIAL_ROUGH_CONDUCTOR);
    bool rough_dielectric = is(material, EFFECT_ROUGH_DIELECTRICS, MATERIAL_ROUGH_DIELECTRIC);
    bool rough_plastic = is(material, EFFECT_ROUGH_PLASTICS, MATERIAL_ROUGH_PLASTIC);
    bool plastic = is(material, EFFECT_PLASTICS, MATERIAL_PLASTIC);
    if (!(wo.z > 0.0 && (rough_dielectric ? wi.z != 0.0 : wi.z > 0.0))) return vec3(0.0);
    vec3 value = vec3(0.0);
    float p = 1.0, below = 0.0;
    if (plastic || rough_plastic) {
        Coat coat = coat_of(material);
        float t[2];
        for (int k = 0; k < 2; ++k) {
            t[k] = coat_transmittance(coat, rough_plastic, tables, material.table, k == 0 ? wo.z : wi.z);
        }
        value = coat_base(coat, material.reflectance) * (t[0] * t[1] * wi.z * FRAC_1_PI);
        p = coat_choice(coat, 1.0 - t[0]);
        below = (1.0 - p) * diffuse_pdf(directions, wo, wi);
        pdf = below;
    }
    if (rough_conductor || rough_dielectric || rough_plastic) {
        bool reflects = wi.z > 0.0;
        Half h;
        if (!microfacet_half(material.distribution, material.alpha, wo, wi, reflects ? 1.0 : material.eta, h)) {
            if (!rough_dielectric) return value;
        } else if (rough_conductor) {
            value = rough_conductor_eval(material.second, material.k, material.reflectance, h, pdf);
        } else if (rough_dielectric) {
            value = rough_dielectric_eval(material.eta, material.reflectance, material.second, reflects, h, pdf);
        } else {
            float quarter = 0.25 * h.d * h.visible_o;
            float refracted;
            float r = fresnel_dielectric(h.cos_o, material.eta, refracted);
            value = material.second * (r * quarter * h.g_i) + value;
            pdf = p * quarter + below;
        }
        if (directions != DIRECTIONS_BSDF) pdf = other_pdf(directions, wi, rough_dielectric);
    }
    return value;
}

// A direction; or a complete sample of the smooth coat's delta lobe.
bool coated_sample(Material material, Floats tables, uint directions, vec3 wo, uvec4 words, inout Scattered s) {
    if (wo.z <= 0.0) return false;
    bool rough_dielectric = is(material, EFFECT_ROUGH_DIELECTRICS, MATERIAL_ROUGH_DIELECTRIC);
    bool rough_plastic = is(material, EFFECT_ROUGH_PLASTICS, MATERIAL_ROUGH_PLASTIC);
    bool plastic = is(material, EFFECT_PLASTICS, MATERIAL_PLASTIC);
    bool facets = has(EFFECT_ROUGH) && !plastic && directions == DIRECTIONS_BSDF;
    if (plastic || (facets && rough_plastic)) {
        Coat coat = coat_of(material);
        float t = coat_transmittance(coat, rough_plastic, tables, material.table, wo.z);
        float r = 1.0 - t;
        float p = coat_choice(coat, r);
        bool coated = happens(words.z, p);
        facets = facets && coated;
        if (plastic && coated) {
            s = reflected(wo, r, material.second);
            s.pdf = p;
            return true;
        }
    }
    if (!facets) {
        s.wi = diffuse_direction(directions, words);
        if (rough_dielectric && words.z >> 31 != 0u) s.wi.z = -s.wi.z;
        return true;
    }
    vec3 m = microfacet_sample_visible(material.distribution, material.alpha, wo, words);
    if (rough_dielectric) return rough_dielectric_sample(material.eta, m, wo, words.z, s.wi);
    s.wi = mirrored(wo, m);
    return true;
}
#endif

vec3 material_eval(Material material, Floats tables, uint directions, vec3 wo, vec3 wi, out float pdf) {
    pdf = 0.0;
    if (is(material, EFFECT_DIFFUSE, MATERIAL_DIFFUSE)) return diffuse_eval(directions, material.reflectance, wo, wi, pdf);
#ifdef FULL
    if (has(EFFECT_COATED) && material.kind >= MATERIAL_ROUGH_CONDUCTOR) {
        return coated_eval(material, tables, directions, wo, wi, pdf);
    }
#endif
    return vec3(0.0);
}

bool material_sample(Material material, Floats tables, uint directions, vec3 wo, uvec4 words, out Scattered s) {
    s = Scattered(vec3(0.0), 0.0, vec3(0.0), false, 1.0);
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
    if (is(material, EFFECT_DIFFUSE, MATERIAL_DIFFUSE)) {
        s.wi = diffuse_direction(directions, words);
#ifdef FULL
    } else if (has(EFFECT_COATED) && material.kind >= MATERIAL_ROUGH_CONDUCTOR) {
        if (!coated_sample(material, tables, directions, wo, words, s)) return false;
        if (s.delta) return true;
#endif
    } else {
        return false;
    }
    s.value = material_eval(material, tables, directions, wo, s.wi, s.pdf);
    if (is(material, EFFECT_ROUGH_DIELECTRICS, MATERIAL_ROUGH_DIELECTRIC) && s.wi.z < 0.0) s.eta = material.eta;
    return s.pdf > 0.0;
}
#endif
