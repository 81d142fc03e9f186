// Twin of src/scene/material/transmittance.rs: the lookup.
#ifndef SCENE_MATERIAL_TRANSMITTANCE
#define SCENE_MATERIAL_TRANSMITTANCE

#include "scene/scene.glsl"

const uint TRANSMITTANCE_CELLS = 63u;

float transmittance_at(Floats tables, uint table, float cos) {
    float x = cos * float(TRANSMITTANCE_CELLS);
    uint i = min(uint(x), TRANSMITTANCE_CELLS - 1u);
    uint at = table * (TRANSMITTANCE_CELLS + 1u) + i;
    float below = tables.at[at];
    return below + (tables.at[at + 1u] - below) * (x - float(i));
}
#endif
