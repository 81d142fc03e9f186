// Twin of src/math/special.rs.
#ifndef MATH_SPECIAL
#define MATH_SPECIAL

#include "math/vector.glsl"

const float FRAC_1_SQRT_PI = 0.564189612865447998046875;

float exp_neg(float x) {
    if (!(x < 87.0)) return 0.0;
    int k = int(x * 1.44269504 + 0.5);
    float n = float(k);
    float r = (x - n * 0.6933594) + n * 2.1219444e-4;
    float high = 0.041668225 + r * (-0.008374822 + r * 0.0013836838);
    float e = 1.0 + r * (-1.0 + r * (0.4999999 + r * (-0.1666642 + r * high)));
    return e * uintBitsToFloat(uint(127 - k) << 23);
}

float ln(float x) {
    uint bits = floatBitsToUint(x) - 0x3F3504F3u;
    int exponent = int(bits) >> 23;
    float m = uintBitsToFloat((bits & 0x007FFFFFu) + 0x3F3504F3u);
    float s = (m - 1.0) / (m + 1.0);
    float z = s * s;
    float q = 1.0 + z * (0.3333341 + z * (0.19987372 + z * 0.14963466));
    return float(exponent) * 0.693147181 + 2.0 * s * q;
}

float erfcx(float x) {
    float t = 1.0 / (1.0 + 0.39 * x);
    float high = 0.6495583 + t * (-0.6353989 + t * (0.88666356 + t * -0.22753692));
    return t * (0.23532514 + t * (0.09138885 + t * high));
}

float erf(float x) {
    float a = abs(x);
    return copysign1(1.0 - erfcx(a) * exp_neg(a * a), x);
}

float erf_inv(float x) {
    float w = -ln((1.0 - x) * (1.0 + x));
    bool central = w < 5.0;
    float v = central ? w - 2.5 : sqrt(w) - 3.0;
    float low = central ? -3.5288629e-6 + v * (3.437274e-7 + v * 2.8535056e-8)
                        : 0.0012789841 + v * (7.594396e-5 + v * -1.5035169e-4);
    float high = (central ? -4.3967852e-6 : -0.0036498085) + v * low;
    float upper = (central ? 2.186022e-4 : 0.005771808) + v * high;
    float middle = (central ? -0.0041777077 : 0.00943404) + v * ((central ? -0.0012537075 : -0.007628063) + v * upper);
    return x * ((central ? 1.5014094 : 2.832977) + v * ((central ? 0.24664073 : 1.0016743) + v * middle));
}
#endif
