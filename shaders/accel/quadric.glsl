// Twin of src/accel/quadric.rs.
#ifndef ACCEL_QUADRIC
#define ACCEL_QUADRIC

#include "accel/ray.glsl"
#include "accel/slab.glsl"
#include "math/vector.glsl"

struct Quadric {
    // Sphere: centre, radius, outside (±1). Disk: centre, u, v. Cylinder: p0, unit axis, length, radius, outside.
    double data[10];
    uint kind;
    uint primitive;
    vec3 lo;
    vec3 hi;
};
const uint QUADRIC_SPHERE = 0u;
const uint QUADRIC_DISK = 1u;
const uint QUADRIC_CYLINDER = 2u;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Quadrics { Quadric at[]; };

dvec3 normalize_or3d(dvec3 v, dvec3 fallback) {
    double rcp = 1.0lf / length3d(v);
    bool finite = (unpackDouble2x32(rcp).y & 0x7FF00000u) != 0x7FF00000u;
    return finite && rcp > 0.0lf ? v * rcp : fallback;
}

// Of a unit vector.
dvec3 any_orthonormal_vector3d(dvec3 v) {
    double sign = (unpackDouble2x32(v.z).y >> 31) != 0u ? -1.0lf : 1.0lf;
    double a = -1.0lf / (sign + v.z);
    double b = v.x * v.y * a;
    return dvec3(b, sign + v.y * v.y * a, -v.y);
}

bool quadric_ahead(Ray ray, double t) {
    return t >= 0.0lf && t < double(ray.t_max);
}

// The two t with |q + t·d| = radius, smaller first.
bool quadric_roots(dvec3 q, dvec3 d, double radius, out dvec2 t) {
    t = dvec2(0.0lf);
    double dd = dot3d(d, d);
    double middle = -dot3d(q, d) / dd;
    dvec3 closest = q + d * middle;
    double square = (radius - length3d(closest)) * (radius + length3d(closest));
    if (!(square >= 0.0lf && dd > 0.0lf)) return false;
    double half_chord = sqrt(square / dd);
    double product = (length3d(q) - radius) * (length3d(q) + radius) / dd;
    double far = middle >= 0.0lf ? middle + half_chord : middle - half_chord;
    double other = far == 0.0lf ? 0.0lf : product / far;
    t = middle >= 0.0lf ? dvec2(other, far) : dvec2(far, other);
    return true;
}

// Of the first hit with 0 ≤ t < t_max.
bool quadric_distance(Quadric quadric, Ray ray, out double t) {
    t = 0.0lf;
    dvec3 o = dvec3(ray.origin), d = dvec3(ray.direction);
    dvec3 center = dvec3(quadric.data[0], quadric.data[1], quadric.data[2]);
    dvec2 both;
    if (quadric.kind == QUADRIC_SPHERE) {
        if (!quadric_roots(o - center, d, quadric.data[3], both)) return false;
        t = quadric_ahead(ray, both.x) ? both.x : both.y;
        return quadric_ahead(ray, t);
    }
    if (quadric.kind == QUADRIC_DISK) {
        dvec3 u = dvec3(quadric.data[3], quadric.data[4], quadric.data[5]);
        dvec3 v = dvec3(quadric.data[6], quadric.data[7], quadric.data[8]);
        dvec3 n = cross3d(u, v);
        t = dot3d(n, center - o) / dot3d(n, d);
        dvec3 q = o + d * t - center;
        double a = dot3d(cross3d(q, v), n), b = dot3d(cross3d(u, q), n);
        double nn = dot3d(n, n);
        return quadric_ahead(ray, t) && a * a + b * b <= nn * nn;
    }
    dvec3 axis = dvec3(quadric.data[3], quadric.data[4], quadric.data[5]);
    double len = quadric.data[6], radius = quadric.data[7];
    dvec3 q = o - center;
    dvec3 q_across = q - axis * dot3d(q, axis), d_across = d - axis * dot3d(d, axis);
    if (!quadric_roots(q_across, d_across, radius, both)) return false;
    for (uint i = 0u; i < 2u; ++i) {
        t = i == 0u ? both.x : both.y;
        double height = dot3d(q + d * t, axis);
        if (quadric_ahead(ray, t) && 0.0lf <= height && height <= len) return true;
    }
    return false;
}

// As f32, within the box interval.
bool quadric_intersect(Quadric quadric, Ray ray, Slabs slabs, out float t) {
    t = INFINITE;
    float near, far;
    slabs_interval(slabs, quadric.lo, quadric.hi, near, far);
    if (near > far) return false;
    double exact;
    if (!quadric_distance(quadric, ray, exact)) return false;
    float last = next_down(ray.t_max);
    t = float(exact);
    t = last < t ? last : t;
    t = near > t ? near : t;
    t = far < t ? far : t;
    return t < ray.t_max;
}

// The point at distance `t` put onto the surface, and the unit normal on the front side.
void quadric_surface(Quadric quadric, Ray ray, double t, out dvec3 p, out dvec3 n) {
    p = dvec3(ray.origin) + dvec3(ray.direction) * t;
    dvec3 center = dvec3(quadric.data[0], quadric.data[1], quadric.data[2]);
    dvec3 z = dvec3(0.0lf, 0.0lf, 1.0lf);
    if (quadric.kind == QUADRIC_SPHERE) {
        n = normalize_or3d(p - center, z);
        p = center + n * quadric.data[3];
        n = n * quadric.data[4];
        return;
    }
    if (quadric.kind == QUADRIC_DISK) {
        dvec3 u = dvec3(quadric.data[3], quadric.data[4], quadric.data[5]);
        dvec3 v = dvec3(quadric.data[6], quadric.data[7], quadric.data[8]);
        n = normalize_or3d(cross3d(u, v), z);
        p = p - n * dot3d(n, p - center);
        return;
    }
    dvec3 axis = dvec3(quadric.data[3], quadric.data[4], quadric.data[5]);
    double len = quadric.data[6], radius = quadric.data[7];
    double height = dot3d(p - center, axis);
    n = normalize_or3d(p - center - axis * height, any_orthonormal_vector3d(axis));
    height = height < 0.0lf ? 0.0lf : height;
    height = height > len ? len : height;
    p = center + axis * height + n * radius;
    n = n * quadric.data[8];
}
#endif
