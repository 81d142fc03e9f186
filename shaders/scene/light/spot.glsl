// Twin of src/scene/light/spot.rs.
#ifndef SCENE_LIGHT_SPOT
#define SCENE_LIGHT_SPOT

#include "math/trig.glsl"
#include "math/vector.glsl"

float spot_falloff(vec3 axis, float cutoff, float width, vec3 w) {
    float angle = atan2(length3(cross3(axis, w)), dot3(axis, w));
    if (angle <= width) return 1.0;
    return angle < cutoff ? (cutoff - angle) / (cutoff - width) : 0.0;
}
#endif
