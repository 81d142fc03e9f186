// Twin of src/accel/surface.rs.
#ifndef ACCEL_SURFACE
#define ACCEL_SURFACE

#include "accel/quadric.glsl"
#include "accel/ray.glsl"
#include "math/robust.glsl"
#include "math/vector.glsl"
#include "scene/scene.glsl"

struct Endpoint {
    vec3 p;
    vec3 p_error;
    // Zero where there is no surface.
    vec3 ng;
    // Or NONE.
    uint triangle;
};

Endpoint endpoint_free(vec3 p) {
    return Endpoint(p, vec3(0.0), vec3(0.0), NONE);
}

Endpoint endpoint_of(SurfacePoint s) {
    return Endpoint(s.p, s.p_error, s.ng, s.triangle);
}

Ray leave(Endpoint from, vec3 direction) {
    vec3 origin = offset_origin(from.p, from.p_error, from.ng, direction);
    return Ray(origin, direction, INFINITE, from.triangle, NONE);
}

Ray segment(Endpoint from, Endpoint to) {
    vec3 across = to.p - from.p;
    vec3 origin = offset_origin(from.p, from.p_error, from.ng, across);
    vec3 to_error = to.p_error + abs(across) * (4.0 * UNIT_ROUNDOFF);
    vec3 end = offset_origin(to.p, to_error, to.ng, -across);
    return Ray(origin, end - origin, 1.0, from.triangle, to.triangle);
}

void on_plane(vec3 p0, vec3 e1, vec3 e2, float u, float v, out vec3 p, out vec3 p_error) {
    vec3 along1 = e1 * u, along2 = e2 * v;
    p = p0 + (along1 + along2);
    p_error = (abs(along1) + abs(along2)) * gamma(4) + abs(p) * gamma(1);
}

vec3 interpolated_normal(UVec3s vertices, Vec3s normals, Hit hit, vec3 ng) {
    uvec3 corner = vertices.at[hit.primitive];
    vec3 n0 = normals.at[corner.x], n1 = normals.at[corner.y], n2 = normals.at[corner.z];
    vec3 mixed = normalize_or3(n0 * (1.0 - hit.u - hit.v) + n1 * hit.u + n2 * hit.v, ng);
    return dot3(mixed, ng) < 0.0 ? -mixed : mixed;
}

SurfacePoint surface_point_triangle(Surface surface, Hit hit, bool smooth_allowed, UVec3s vertices, Vec3s normals) {
    vec3 p, p_error;
    on_plane(surface.p0, surface.e1, surface.e2, hit.u, hit.v, p, p_error);
    vec3 ns = surface.ng;
    if (smooth_allowed && (surface.flags & SURFACE_SMOOTH) != 0u) {
        ns = interpolated_normal(vertices, normals, hit, surface.ng);
    }
    return SurfacePoint(p, p_error, surface.ng, ns, surface.shape, hit.primitive);
}

SurfacePoint surface_point_quadric(Quadric quadric, Ray ray, Hit hit, uint shape) {
    double t;
    if (!quadric_distance(quadric, ray, t)) t = double(hit.t);
    dvec3 exact_p, exact_n;
    quadric_surface(quadric, ray, t, exact_p, exact_n);
    vec3 p = vec3(exact_p), ng = vec3(exact_n);
    return SurfacePoint(p, abs(p) * gamma(2), ng, ng, shape, NONE);
}
#endif
