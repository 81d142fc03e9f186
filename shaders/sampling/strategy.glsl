// Twin of src/sampling/strategy.rs and sampling/sequence: the axes as numbers.
#ifndef SAMPLING_STRATEGY
#define SAMPLING_STRATEGY

const uint DIRECTIONS_UNIFORM = 0u;
const uint DIRECTIONS_COSINE = 1u;
const uint DIRECTIONS_BSDF = 2u;

const uint LIGHTS_NONE = 0u;
const uint LIGHTS_AREA = 1u;
const uint LIGHTS_SOLID_ANGLE = 2u;

const uint HEURISTIC_NONE = 0u;
const uint HEURISTIC_BALANCE = 1u;
const uint HEURISTIC_POWER = 2u;
const uint HEURISTIC_CUTOFF = 3u;
const uint HEURISTIC_MAXIMUM = 4u;

const uint SEQUENCE_INDEPENDENT = 0u;
const uint SEQUENCE_STRATIFIED = 1u;
const uint SEQUENCE_LATIN_HYPERCUBE = 2u;
const uint SEQUENCE_SOBOL = 3u;
#endif
