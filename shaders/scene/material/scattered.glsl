// Twin of Scattered in src/scene/material/mod.rs.
#ifndef SCENE_MATERIAL_SCATTERED
#define SCENE_MATERIAL_SCATTERED

struct Scattered {
    vec3 wi;
    float pdf;
    vec3 value;
    bool delta;
    float eta;
};

Scattered reflected(vec3 wo, float share, vec3 factor) {
    return Scattered(vec3(-wo.x, -wo.y, wo.z), share, factor * share, true, 1.0);
}

Scattered straight(vec3 wo, float share, vec3 factor) {
    return Scattered(-wo, share, factor * share, true, 1.0);
}
#endif
