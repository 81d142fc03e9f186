// Twin of src/math/trig.rs.
#ifndef MATH_TRIG
#define MATH_TRIG

#include "math/vector.glsl"

// The f32 values to the last digit: glslang folds constants in f64 and would start from unrounded ones.
const float PI = 3.1415927410125732421875;
const float TAU = 6.283185482025146484375;
const float FRAC_PI_2 = 1.57079637050628662109375;
const float FRAC_1_PI = 0.3183098733425140380859375;

// (sin, cos) of 2π·t for |t| ≤ 1/8.
void sin_cos_eighth(float t, out float s, out float c) {
    float z = t * t;
    s = t * (TAU + z * (-41.34166 + z * (81.592354 + z * -75.39356)));
    c = 1.0 + z * (-19.739209 + z * (64.93931 + z * (-85.4423 + z * 59.202797)));
}

// (sin, cos) of 2π·t for 0 ≤ t ≤ 1.
void sin_cos_turns(float t, out float s, out float c) {
    int quarter = int(4.0 * t + 0.5);
    float sine, cosine;
    sin_cos_eighth(t - 0.25 * float(quarter), sine, cosine);
    float a = (quarter & 1) == 0 ? sine : cosine;
    float b = (quarter & 1) == 0 ? cosine : sine;
    s = (quarter & 2) == 0 ? a : -a;
    c = ((quarter + 1) & 2) == 0 ? b : -b;
}

float atan_unit(float x) {
    float z = x * x;
    float high = 0.10640934 + z * (-0.07504294 + z * (0.04269151 + z * (-0.016068623 + z * 0.0028498882)));
    return x + x * (z * (-0.33333073 + z * (0.19992619 + z * (-0.14203644 + z * high))));
}

// Both zero gives NaN.
float atan2(float y, float x) {
    float ax = abs(x), ay = abs(y);
    bool steep = ay > ax;
    float a = atan_unit(steep ? ax / ay : ay / ax);
    a = steep ? FRAC_PI_2 - a : a;
    a = x < 0.0 ? PI - a : a;
    return copysign1(a, y);
}
#endif
