// Twin of src/scene/material/plastic.rs.
#ifndef SCENE_MATERIAL_PLASTIC
#define SCENE_MATERIAL_PLASTIC

#include "sampling/rng.glsl"
#include "scene/material/diffuse.glsl"
#include "scene/material/fresnel.glsl"
#include "scene/material/transmittance.glsl"

struct Coat {
    float eta;
    float internal;
    bool nonlinear;
    float specular_weight;
};

vec3 coat_base(Coat coat, vec3 reflectance) {
    vec3 inside = coat.nonlinear ? reflectance * coat.internal : vec3(coat.internal);
    return reflectance / ((vec3(1.0) - inside) * (coat.eta * coat.eta));
}

float coat_choice(Coat coat, float r) {
    float above = r * coat.specular_weight, below = (1.0 - r) * (1.0 - coat.specular_weight);
    return above + below > 0.0 ? above / (above + below) : 1.0;
}

// What passes the coat, in the direction with this cosine: by a table where the coat is rough.
float coat_transmittance(Coat coat, bool rough, Floats tables, uint table, float cos) {
    if (rough) return transmittance_at(tables, table, cos);
    float refracted;
    return 1.0 - fresnel_dielectric(cos, coat.eta, refracted);
}
#endif
