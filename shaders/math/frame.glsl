// Twin of src/math/frame.rs.
#ifndef MATH_FRAME
#define MATH_FRAME

#include "math/vector.glsl"

struct Frame {
    vec3 s;
    vec3 t;
    // The normal: local z.
    vec3 n;
};

Frame frame_new(vec3 n) {
    float sign = copysign1(1.0, n.z);
    float a = -1.0 / (sign + n.z);
    float b = n.x * n.y * a;
    return Frame(vec3(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), vec3(b, sign + n.y * n.y * a, -n.y), n);
}

vec3 frame_to_world(Frame frame, vec3 v) { return frame.s * v.x + frame.t * v.y + frame.n * v.z; }

vec3 frame_to_local(Frame frame, vec3 v) { return vec3(dot3(frame.s, v), dot3(frame.t, v), dot3(frame.n, v)); }
#endif
