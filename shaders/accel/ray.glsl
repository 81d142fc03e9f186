// Twin of src/accel/mod.rs.
#ifndef ACCEL_RAY
#define ACCEL_RAY

#include "scene/scene.glsl"

#define INFINITE uintBitsToFloat(0x7F800000u)

struct Ray {
    vec3 origin;
    vec3 direction;
    float t_max;
    // Triangles that it starts and ends on, or NONE.
    uint from;
    uint to;
};

Ray ray_new(vec3 origin, vec3 direction, float t_max) {
    return Ray(origin, direction, t_max, NONE, NONE);
}

struct Hit {
    float t;
    uint primitive;
    float u;
    float v;
};

struct SurfacePoint {
    vec3 p;
    vec3 p_error;
    vec3 ng;
    vec3 ns;
    uint shape;
    uint triangle;
};

// Of a positive x, ∞ included.
float next_down(float x) {
    return uintBitsToFloat(floatBitsToUint(x) - 1u);
}
#endif
