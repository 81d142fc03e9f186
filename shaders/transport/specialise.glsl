// What is fixed when the kernel is made: only the effects that the scene calls for, only what the strategy does. The macro
// FULL brings the code for effects that few scenes call for: drivers take long for it even where constants switch it off.
#ifndef TRANSPORT_SPECIALISE
#define TRANSPORT_SPECIALISE

layout(constant_id = 2) const uint EFFECTS = 0xFFFFFFFFu;
layout(constant_id = 3) const uint LIGHT_KINDS = 0xFFFFFFFFu;
layout(constant_id = 4) const uint DIRECTIONS = 0;
layout(constant_id = 5) const uint LIGHTS = 0;
layout(constant_id = 6) const uint HEURISTIC = 0;
layout(constant_id = 7) const uint SEQUENCE = 0;
layout(constant_id = 8) const uint MAX_DEPTH = 0;
layout(constant_id = 9) const uint ROULETTE_DEPTH = 0;

// Twins of src/scene/effects.rs.
const uint EFFECT_TRIANGLES = 1u;
const uint EFFECT_QUADRICS = 2u;
const uint EFFECT_SMOOTH_NORMALS = 4u;
const uint EFFECT_EMITTING_SURFACES = 8u;
const uint EFFECT_ENVIRONMENT = 16u;
const uint EFFECT_SAMPLED_LIGHTS = 32u;
const uint EFFECT_DIFFUSE = 64u;
const uint EFFECT_CONDUCTORS = 128u;
const uint EFFECT_DIELECTRICS = 256u;
const uint EFFECT_THIN_DIELECTRICS = 512u;
const uint EFFECT_NULL = 1024u;
const uint EFFECT_TEXTURES = 1u << 11;
const uint EFFECT_TANGENTS = 1u << 12;
const uint EFFECT_RELIEFS = 1u << 13;
const uint EFFECT_MIXTURES = 1u << 14;
const uint EFFECT_ENVIRONMENT_MAP = 1u << 15;
const uint EFFECT_LENS = 1u << 16;
const uint EFFECT_ORTHOGRAPHIC = 1u << 17;
const uint EFFECT_ROUGH_CONDUCTORS = 1u << 18;
const uint EFFECT_ROUGH_DIELECTRICS = 1u << 19;
const uint EFFECT_PLASTICS = 1u << 20;
const uint EFFECT_ROUGH_PLASTICS = 1u << 21;
const uint EFFECT_BECKMANN = 1u << 22;
const uint EFFECT_SPOTS = 1u << 23;
const uint EFFECT_DIRECTIONAL = 1u << 24;
// Materials with delta lobes.
const uint EFFECT_DELTA =
    EFFECT_CONDUCTORS | EFFECT_DIELECTRICS | EFFECT_THIN_DIELECTRICS | EFFECT_NULL | EFFECT_PLASTICS;
// Materials that refract.
const uint EFFECT_REFRACTION = EFFECT_DIELECTRICS | EFFECT_ROUGH_DIELECTRICS;
// Materials of microfacets.
const uint EFFECT_ROUGH = EFFECT_ROUGH_CONDUCTORS | EFFECT_ROUGH_DIELECTRICS | EFFECT_ROUGH_PLASTICS;
// Materials that only the variant FULL of the kernels has.
const uint EFFECT_COATED = EFFECT_ROUGH | EFFECT_PLASTICS;

// Any of them.
bool has(uint effect) {
    return (EFFECTS & effect) != 0u;
}
#endif
