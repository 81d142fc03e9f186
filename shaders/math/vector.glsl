// Twins of the f32 and f64 functions of std and glam that the tracer uses, operation by operation.
#ifndef MATH_VECTOR
#define MATH_VECTOR

// By bits: a compiler may assume that no value is NaN.
bool is_nan1(float x) { return (floatBitsToUint(x) & 0x7FFFFFFFu) > 0x7F800000u; }

bool is_finite1(float x) { return (floatBitsToUint(x) & 0x7F800000u) != 0x7F800000u; }

float copysign1(float magnitude, float sign) {
    return uintBitsToFloat((floatBitsToUint(magnitude) & 0x7FFFFFFFu) | (floatBitsToUint(sign) & 0x80000000u));
}

// f32::min and max: a NaN gives the other argument.
float min1(float a, float b) { return is_nan1(a) || b < a ? b : a; }

float max1(float a, float b) { return is_nan1(a) || b > a ? b : a; }

// f32::clamp: NaN stays NaN.
float clamp1(float x, float lo, float hi) {
    if (x < lo) x = lo;
    if (x > hi) x = hi;
    return x;
}

float dot3(vec3 a, vec3 b) { return (a.x * b.x) + (a.y * b.y) + (a.z * b.z); }

vec3 cross3(vec3 a, vec3 b) { return vec3(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y); }

float length_squared3(vec3 v) { return dot3(v, v); }

float length3(vec3 v) { return sqrt(dot3(v, v)); }

float length_recip3(vec3 v) { return 1.0 / length3(v); }

vec3 normalize3(vec3 v) { return v * length_recip3(v); }

bool try_normalize3(vec3 v, out vec3 normalized) {
    float rcp = length_recip3(v);
    normalized = v * rcp;
    return is_finite1(rcp) && rcp > 0.0;
}

vec3 normalize_or3(vec3 v, vec3 fallback) {
    vec3 normalized;
    return try_normalize3(v, normalized) ? normalized : fallback;
}

float min_element3(vec3 v) {
    float a = v.y < v.z ? v.y : v.z;
    return v.x < a ? v.x : a;
}

float max_element3(vec3 v) {
    float a = v.y > v.z ? v.y : v.z;
    return v.x > a ? v.x : a;
}

double dot3d(dvec3 a, dvec3 b) { return (a.x * b.x) + (a.y * b.y) + (a.z * b.z); }

dvec3 cross3d(dvec3 a, dvec3 b) { return dvec3(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y); }

double length3d(dvec3 v) { return sqrt(dot3d(v, v)); }
#endif
