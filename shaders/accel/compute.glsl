// Tracing by our own trees: runs everywhere, gives what src/accel/bvh.rs gives.
#ifndef ACCEL_COMPUTE
#define ACCEL_COMPUTE

#include "accel/tree.glsl"
#include "transport/specialise.glsl"
#include "transport/tracer.glsl"

bool trace_closest(TracerAt tracer, Ray ray, out Hit hit) {
    hit = Hit(next_down(ray.t_max), NONE, 0.0, 0.0);
    if (has(EFFECT_TRIANGLES)) closest_triangle(tracer.it.triangle_tree, tracer.it.triangles, ray, hit);
    if (has(EFFECT_QUADRICS)) closest_quadric(tracer.it.quadric_tree, tracer.it.quadrics, ray, hit);
    return hit.primitive != NONE;
}

bool trace_occluded(TracerAt tracer, Ray ray) {
    if (has(EFFECT_TRIANGLES) && any_triangle(tracer.it.triangle_tree, tracer.it.triangles, ray)) return true;
    return has(EFFECT_QUADRICS) && any_quadric(tracer.it.quadric_tree, tracer.it.quadrics, ray);
}
#endif
