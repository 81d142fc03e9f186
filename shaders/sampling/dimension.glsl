// Twin of src/sampling/dimension.rs.
#ifndef SAMPLING_DIMENSION
#define SAMPLING_DIMENSION

const uint DECISION_DIRECTION = 0u;
const uint DECISION_LIGHT = 1u;
// At vertex 0.
const uint DECISION_LENS = 1u;
const uint FIRST_LAYER = 1u << 30;
const uint DECISION_SLOTS = 2u;

uint group(uint vertex, uint decision) {
    return vertex * DECISION_SLOTS + decision;
}
#endif
