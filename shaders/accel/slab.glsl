// Twin of src/accel/slab.rs.
#ifndef ACCEL_SLAB
#define ACCEL_SLAB

#include "accel/ray.glsl"
#include "math/robust.glsl"
#include "math/vector.glsl"

struct Slabs {
    vec3 near_origin;
    vec3 far_origin;
    vec3 near_rcp;
    vec3 far_rcp;
    uvec3 negative;
};

uint longest_axis(vec3 direction) {
    vec3 d = abs(direction);
    if (d.x >= d.y) return d.x >= d.z ? 0u : 2u;
    return d.y >= d.z ? 1u : 2u;
}

Slabs slabs_new(Ray ray, vec3 lo, vec3 hi) {
    vec3 o = ray.origin, d = ray.direction;
    vec3 reach = max(abs(lo - o), abs(hi - o));
    vec3 rcp = vec3(1.0 / d.x, 1.0 / d.y, 1.0 / d.z);
    uint z = longest_axis(d);
    float slope = z == 0u ? abs(rcp.x) * reach.x : z == 1u ? abs(rcp.y) * reach.y : abs(rcp.z) * reach.z;
    vec3 error = UNIT_ROUNDOFF * (4.0 * reach + 8.0 * abs(d) * slope + 2.0 * abs(o));
    vec3 pad = vec3(copysign1(error.x, d.x), copysign1(error.y, d.y), copysign1(error.z, d.z));
    return Slabs(o + pad, o - pad, rcp * (1.0 - 6.0 * UNIT_ROUNDOFF), rcp * (1.0 + 6.0 * UNIT_ROUNDOFF),
        floatBitsToUint(d) >> 31);
}

void slabs_clip_axis(float entry, float exit, float near_origin, float far_origin, float near_rcp, float far_rcp,
    inout float near, inout float far) {
    float t0 = (entry - near_origin) * near_rcp;
    float t1 = (exit - far_origin) * far_rcp;
    // No min, no max: a NaN (0·∞) is ignored.
    near = t0 > near ? t0 : near;
    far = t1 < far ? t1 : far;
}

// Near (not below 0) and far (not above `limit`) distance of a box.
void slabs_clip(Slabs slabs, vec3 lo, vec3 hi, float limit, out float near, out float far) {
    bvec3 negative = notEqual(slabs.negative, uvec3(0u));
    vec3 entry = vec3(negative.x ? hi.x : lo.x, negative.y ? hi.y : lo.y, negative.z ? hi.z : lo.z);
    vec3 exit = vec3(negative.x ? lo.x : hi.x, negative.y ? lo.y : hi.y, negative.z ? lo.z : hi.z);
    near = 0.0;
    far = limit;
    slabs_clip_axis(entry.x, exit.x, slabs.near_origin.x, slabs.far_origin.x, slabs.near_rcp.x, slabs.far_rcp.x, near, far);
    slabs_clip_axis(entry.y, exit.y, slabs.near_origin.y, slabs.far_origin.y, slabs.near_rcp.y, slabs.far_rcp.y, near, far);
    slabs_clip_axis(entry.z, exit.z, slabs.near_origin.z, slabs.far_origin.z, slabs.near_rcp.z, slabs.far_rcp.z, near, far);
}

void slabs_interval(Slabs slabs, vec3 lo, vec3 hi, out float near, out float far) {
    slabs_clip(slabs, lo, hi, INFINITE, near, far);
}
#endif
