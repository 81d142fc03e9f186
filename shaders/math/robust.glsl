// Twin of src/math/robust.rs.
#ifndef MATH_ROBUST
#define MATH_ROBUST

#include "math/vector.glsl"

const float UNIT_ROUNDOFF = 1.0 / 16777216.0;

// Smallest normal float.
const float MIN_POSITIVE = 1.1754943508222875079687365372222456778e-38;

float gamma(uint n) {
    float nu = float(n) * UNIT_ROUNDOFF;
    return nu / (1.0 - nu);
}

// The float next to a finite x on the side of the sign of `away`.
float outwards(float x, float away) {
    int step = int(away > 0.0) - int(away < 0.0);
    int bits = floatBitsToInt(x);
    int place = bits ^ int(uint(bits >> 31) >> 1);
    // −0 is −1 and 0 is 0, so a step across zero is one longer.
    int crosses = int(place == 0 && step < 0) - int(place == -1 && step > 0);
    place = place + step - crosses;
    return intBitsToFloat(place ^ int(uint(place >> 31) >> 1));
}

vec3 offset_origin(vec3 p, vec3 p_error, vec3 n, vec3 direction) {
    float distance = dot3(abs(n), p_error) + MIN_POSITIVE;
    float side = dot3(n, direction) < 0.0 ? -1.0 : 1.0;
    vec3 away = n * side;
    vec3 moved = p + away * distance;
    return vec3(outwards(moved.x, away.x), outwards(moved.y, away.y), outwards(moved.z, away.z));
}
#endif
