// Twin of src/scene/light/point.rs.
#ifndef SCENE_LIGHT_POINT
#define SCENE_LIGHT_POINT

#include "accel/surface.glsl"
#include "math/vector.glsl"

bool point_sample(vec3 position, vec3 intensity, vec3 p, out Endpoint to, out vec3 emitted) {
    to = endpoint_free(position);
    emitted = vec3(0.0);
    float distance2 = length_squared3(position - p);
    if (!(distance2 > 0.0)) return false;
    emitted = intensity / distance2;
    return true;
}
#endif
