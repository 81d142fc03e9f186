// Twin of src/sampling/heuristic.rs.
#ifndef SAMPLING_HEURISTIC
#define SAMPLING_HEURISTIC

#include "math/vector.glsl"
#include "sampling/strategy.glsl"

const float HEURISTIC_CUTOFF_SHARE = 0.1;
const float HEURISTIC_TIE = 1.0 - 1.0 / 1024.0;

float heuristic_weight(uint heuristic, float p, float q) {
    // Equal densities first: 0/0 and ∞/∞ have no ratio.
    float r = p == q ? 1.0 : q / p;
    if (heuristic == HEURISTIC_NONE) return 1.0;
    if (heuristic == HEURISTIC_BALANCE) return 1.0 / (1.0 + r);
    if (heuristic == HEURISTIC_POWER) return 1.0 / (1.0 + r * r);
    if (heuristic == HEURISTIC_CUTOFF) {
        if (p < HEURISTIC_CUTOFF_SHARE * q) return 0.0;
        if (q < HEURISTIC_CUTOFF_SHARE * p) return 1.0;
        return 1.0 / (1.0 + r);
    }
    if (min1(p, q) >= HEURISTIC_TIE * max1(p, q)) return 0.5;
    return p > q ? 1.0 : 0.0;
}
#endif
