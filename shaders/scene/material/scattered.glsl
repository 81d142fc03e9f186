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
#endif
