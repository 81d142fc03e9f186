// Twin of src/accel/parameterization.rs.
#ifndef ACCEL_PARAMETERIZATION
#define ACCEL_PARAMETERIZATION

#include "accel/quadric.glsl"
#include "accel/ray.glsl"
#include "math/frame.glsl"
#include "math/trig.glsl"
#include "math/vector.glsl"
#include "scene/scene.glsl"

// 1/2π.
const float TURNS = 0.15915493667125701904296875;

struct Parameterization {
    vec2 uv;
    vec3 dp_du;
    vec3 dp_dv;
};

// Between a sphere, disk or cylinder and the unit one.
struct QuadricMap {
    vec3 origin;
    // QUADRIC_…
    uint kind;
    vec3 axes[3];
    // Rows.
    vec3 inverse[3];
};

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer QuadricMaps { QuadricMap at[]; };

Parameterization parameterization_triangle(Surface surface, Hit hit, UVec3s vertices, Vec2s uvs) {
    Frame frame = frame_new(surface.ng);
    Parameterization found = Parameterization(vec2(hit.u, hit.v), frame.s, frame.t);
    if ((surface.flags & SURFACE_UVS) == 0u) return found;
    uvec3 corner = vertices.at[hit.primitive];
    vec2 uv0 = uvs.at[corner.x], uv1 = uvs.at[corner.y], uv2 = uvs.at[corner.z];
    found.uv = uv0 * (1.0 - hit.u - hit.v) + uv1 * hit.u + uv2 * hit.v;
    vec2 d1 = uv1 - uv0, d2 = uv2 - uv0;
    float inverse = 1.0 / (d1.x * d2.y - d1.y * d2.x);
    if (!is_finite1(inverse)) return found;
    found.dp_du = (surface.e1 * d2.y - surface.e2 * d1.y) * inverse;
    found.dp_dv = (surface.e2 * d1.x - surface.e1 * d2.x) * inverse;
    return found;
}

Parameterization parameterization_quadric(QuadricMap map, vec3 p) {
    vec3 q = p - map.origin;
    float x = dot3(map.inverse[0], q), y = dot3(map.inverse[1], q), z = dot3(map.inverse[2], q);
    float r = sqrt(x * x + y * y);
    float c = 1.0, s = 0.0, azimuth = 0.0;
    if (r > 0.0) {
        c = x / r;
        s = y / r;
        azimuth = atan2(y, x) * TURNS;
        azimuth = azimuth < 0.0 ? azimuth + 1.0 : azimuth;
    }
    vec3 around = vec3(-y, x, 0.0) * TAU, du = around, dv = vec3(0.0, 0.0, 1.0);
    vec2 uv = vec2(azimuth, z);
    if (map.kind == QUADRIC_SPHERE) {
        uv.y = atan2(r, z) * (2.0 * TURNS);
        dv = vec3(z * c, z * s, -r) * PI;
    } else if (map.kind == QUADRIC_DISK) {
        uv = vec2(r, azimuth);
        du = vec3(c, s, 0.0);
        dv = around;
    }
    vec3 dp_du = map.axes[0] * du.x + map.axes[1] * du.y + map.axes[2] * du.z;
    vec3 dp_dv = map.axes[0] * dv.x + map.axes[1] * dv.y + map.axes[2] * dv.z;
    return Parameterization(uv, dp_du, dp_dv);
}
#endif
