// Tracing by the driver's ray-tracing pipeline: what its stages tell one another.
#ifndef ACCEL_RAY_PIPELINE
#define ACCEL_RAY_PIPELINE

#extension GL_EXT_ray_tracing : require

struct Traced {
    float t;
    // NONE: nothing was hit.
    uint primitive;
    float u;
    float v;
    // Triangles that the ray starts and ends on.
    uint from;
    uint to;
};
#endif
