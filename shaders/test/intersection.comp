#version 460
// The functions of accel one by one, for comparison with the processor.
#extension GL_GOOGLE_include_directive : require

#include "accel/surface.glsl"
#include "accel/triangle.glsl"
#include "test/words.glsl"

const uint FUNCTION_TRIANGLE_CLOSEST = 0u;
const uint FUNCTION_TRIANGLE_ANY = 1u;
const uint FUNCTION_QUADRIC = 2u;
const uint FUNCTION_LEAVE = 3u;
const uint FUNCTION_SEGMENT = 4u;
const uint FUNCTION_TRIANGLE_POINT = 5u;

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Tables {
    Quadrics quadrics;
    vec3 lo;
    vec3 hi;
    Surfaces surfaces;
    UVec3s vertices;
    Vec3s normals;
};

float in_float(uint k) {
    return uintBitsToFloat(in_word(k));
}

vec3 in_vec3(uint k) {
    return vec3(in_float(k), in_float(k + 1u), in_float(k + 2u));
}

void out_float(uint k, float x) {
    out_word(k, floatBitsToUint(x));
}

void out_vec3(uint k, vec3 v) {
    for (uint i = 0u; i < 3u; ++i) out_float(k + i, v[i]);
}

void main() {
    if (!start()) return;
    Tables tables = Tables(test.tables);
    if (FUNCTION == FUNCTION_TRIANGLE_CLOSEST || FUNCTION == FUNCTION_TRIANGLE_ANY) {
        Ray ray = Ray(in_vec3(0u), in_vec3(3u), in_float(6u), in_word(7u), in_word(8u));
        Slabs slabs = slabs_new(ray, tables.lo, tables.hi);
        Shear shear = shear_new(ray);
        vec3 v0 = in_vec3(9u), v1 = in_vec3(12u), v2 = in_vec3(15u);
        float t = 0.0;
        vec2 uv = vec2(0.0);
        bool ok;
        if (FUNCTION == FUNCTION_TRIANGLE_CLOSEST) {
            ok = triangle_closest(ray, shear, slabs, v0, v1, v2, in_word(18u), in_float(19u), t, uv);
        } else {
            ok = triangle_any(ray, shear, slabs, v0, v1, v2, in_word(18u));
        }
        if (ok) {
            out_word(0u, 1u);
            out_vec3(1u, vec3(t, uv));
        }
    } else if (FUNCTION == FUNCTION_QUADRIC) {
        Ray ray = ray_new(in_vec3(0u), in_vec3(3u), in_float(6u));
        Slabs slabs = slabs_new(ray, tables.lo, tables.hi);
        Quadric quadric = tables.quadrics.at[in_word(7u)];
        float t;
        if (quadric_intersect(quadric, ray, slabs, t)) {
            SurfacePoint at = surface_point_quadric(quadric, ray, Hit(t, quadric.primitive, 0.0, 0.0), 0u);
            out_word(0u, 1u);
            out_float(1u, t);
            out_vec3(2u, at.p);
            out_vec3(5u, at.ng);
        }
    } else if (FUNCTION == FUNCTION_LEAVE) {
        Endpoint from = Endpoint(in_vec3(0u), in_vec3(3u), in_vec3(6u), NONE);
        out_vec3(0u, leave(from, in_vec3(9u)).origin);
    } else if (FUNCTION == FUNCTION_SEGMENT) {
        Endpoint from = Endpoint(in_vec3(0u), in_vec3(3u), in_vec3(6u), NONE);
        Endpoint to = Endpoint(in_vec3(9u), in_vec3(12u), in_vec3(15u), NONE);
        Ray ray = segment(from, to);
        out_vec3(0u, ray.origin);
        out_vec3(3u, ray.direction);
    } else if (FUNCTION == FUNCTION_TRIANGLE_POINT) {
        Hit hit = Hit(0.0, in_word(0u), in_float(1u), in_float(2u));
        Surface surface = tables.surfaces.at[hit.primitive];
        UVec3s vertices = tables.vertices;
        Vec3s normals = tables.normals;
        SurfacePoint at = surface_point_triangle(surface, hit, true, vertices, normals);
        out_vec3(0u, at.p);
        out_vec3(3u, at.p_error);
        out_vec3(6u, at.ng);
        out_vec3(9u, at.ns);
        out_word(12u, at.shape);
        out_word(13u, at.triangle);
    }
}
