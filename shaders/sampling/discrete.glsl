// Twin of src/sampling/discrete.rs: a table lies at first.at[offset] … first.at[offset + count − 1].
#ifndef SAMPLING_DISCRETE
#define SAMPLING_DISCRETE

#include "scene/scene.glsl"

// The table must not be empty.
uint discrete_pick(Words first, uint offset, uint count, uint word) {
    // The first threshold is 0: never above the word.
    uint below = 0u, above = count;
    while (above - below > 1u) {
        uint middle = below + (above - below) / 2u;
        if (first.at[offset + middle] <= word) {
            below = middle;
        } else {
            above = middle;
        }
    }
    return below;
}

float discrete_pmf(Words first, uint offset, uint count, uint outcome) {
    uint start = first.at[offset + outcome];
    bool last = outcome + 1u >= count;
    // 2³² does not fit a word.
    if (last && start == 0u) return 1.0;
    uint end = last ? 0u : first.at[offset + outcome + 1u];
    return float(end - start) * (1.0 / 4294967296.0);
}
#endif
