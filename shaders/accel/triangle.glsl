// Twin of src/accel/triangle.rs, one triangle at a time.
#ifndef ACCEL_TRIANGLE
#define ACCEL_TRIANGLE

#include "accel/ray.glsl"
#include "accel/slab.glsl"
#include "math/robust.glsl"
#include "math/vector.glsl"

// Beyond this multiple of t_max a depth lies behind the end, whatever its roundings.
const float REACH = 1.0 + 8.0 * UNIT_ROUNDOFF;

struct Shear {
    uvec3 axes;
    vec3 origin;
    vec3 shear;
};

float shear_pick(vec3 v, uint axis) {
    return axis == 0u ? v.x : axis == 1u ? v.y : v.z;
}

vec3 shear_permute(uvec3 axes, vec3 v) {
    return vec3(shear_pick(v, axes.x), shear_pick(v, axes.y), shear_pick(v, axes.z));
}

Shear shear_new(Ray ray) {
    uint z = longest_axis(ray.direction);
    uint x = z == 2u ? 0u : z + 1u;
    uint y = x == 2u ? 0u : x + 1u;
    uvec3 axes = uvec3(x, y, z);
    vec3 d = shear_permute(axes, ray.direction);
    float rcp = 1.0 / d.z;
    return Shear(axes, shear_permute(axes, ray.origin), vec3(d.x * rcp, d.y * rcp, rcp));
}

vec3 shear_apply(Shear shear, vec3 vertex) {
    vec3 v = shear_permute(shear.axes, vertex);
    float depth = v.z - shear.origin.z;
    return vec3((v.x - shear.origin.x) - shear.shear.x * depth, (v.y - shear.origin.y) - shear.shear.y * depth,
        shear.shear.z * depth);
}

// Not min and max: of a NaN and b this is b.
float triangle_least(vec3 x) {
    float a = x.x < x.y ? x.x : x.y;
    return a < x.z ? a : x.z;
}

float triangle_most(vec3 x) {
    float a = x.x > x.y ? x.x : x.y;
    return a > x.z ? a : x.z;
}

float triangle_edge(vec3 a, vec3 b) {
    return a.x * b.y - a.y * b.x;
}

double triangle_edge_exact(vec3 a, vec3 b) {
    return double(a.x) * double(b.y) - double(a.y) * double(b.x);
}

// glam's.
double triangle_min_element(dvec3 x) {
    double a = x.y < x.z ? x.y : x.z;
    return x.x < a ? x.x : a;
}

double triangle_max_element(dvec3 x) {
    double a = x.y > x.z ? x.y : x.z;
    return x.x > a ? x.x : a;
}

// Recomputes the edge functions in f64, scaled to at most 1; false: outside or degenerate.
bool triangle_exact_edges(vec3 p0, vec3 p1, vec3 p2, inout vec3 weight) {
    dvec3 w = dvec3(triangle_edge_exact(p2, p1), triangle_edge_exact(p0, p2), triangle_edge_exact(p1, p0));
    double largest = triangle_max_element(dvec3(abs(w.x), abs(w.y), abs(w.z)));
    double low = triangle_min_element(w), high = triangle_max_element(w);
    if ((low < 0.0lf && high > 0.0lf) || largest == 0.0lf) return false;
    weight = vec3(float(w.x / largest), float(w.y / largest), float(w.z / largest));
    return true;
}

bool triangle_within(vec3 depth, float reach) {
    return 0.0 <= triangle_most(depth) && triangle_least(depth) <= reach;
}

float triangle_distance(vec3 weight, vec3 depth, float near, float far) {
    float det = weight.x + weight.y + weight.z;
    float t = weight.x / det * depth.x + weight.y / det * depth.y + weight.z / det * depth.z;
    t = t > near ? t : near;
    return t < far ? t : far;
}

struct Crossed {
    // The box does not tell whether 0 ≤ t < t_max.
    bool doubtful;
    vec3 weight;
    float t;
    float near;
    float far;
};

bool triangle_crossed(Ray ray, Shear shear, Slabs slabs, vec3 v0, vec3 v1, vec3 v2, uint primitive, float best,
    out Crossed crossed) {
    crossed = Crossed(false, vec3(0.0), 0.0, 0.0, 0.0);
    vec3 p0 = shear_apply(shear, v0), p1 = shear_apply(shear, v1), p2 = shear_apply(shear, v2);
    vec3 weight = vec3(triangle_edge(p2, p1), triangle_edge(p0, p2), triangle_edge(p1, p0));
    float least = triangle_least(weight), most = triangle_most(weight);
    if (!(0.0 <= least || most <= 0.0)) return false;
    if ((least == 0.0 || most == 0.0) && !triangle_exact_edges(p0, p1, p2, weight)) return false;
    // Vertices are finite.
    float near, far;
    slabs_interval(slabs, min(min(v0, v1), v2), max(max(v0, v1), v2), near, far);
    vec3 depth = vec3(p0.z, p1.z, p2.z);
    if (!triangle_within(depth, ray.t_max * REACH)) return false;
    if (!(near <= far && near <= best) || primitive == ray.from || primitive == ray.to) return false;
    bool doubtful = near <= 0.0 || ray.t_max <= far;
    crossed = Crossed(doubtful, weight, triangle_distance(weight, depth, near, far), near, far);
    return true;
}

// By the side of the triangle's plane that origin and end lie on, in f64.
bool triangle_decide(Ray ray, vec3 v0, vec3 v1, vec3 v2, float rough, out float t) {
    dvec3 o = dvec3(ray.origin), d = dvec3(ray.direction);
    dvec3 a = dvec3(v0), b = dvec3(v1), c = dvec3(v2);
    dvec3 n = cross3d(b - a, c - a);
    double depth = dot3d(n, a - o) / dot3d(n, d);
    bool finite = (unpackDouble2x32(depth).y & 0x7FF00000u) != 0x7FF00000u;
    double exact = finite ? depth : double(rough);
    float last = next_down(ray.t_max);
    t = float(exact);
    t = last < t ? last : t;
    return exact >= 0.0lf && exact < double(ray.t_max);
}

// A hit with 0 ≤ t < t_max and t ≤ `best`; uv: barycentric weights of vertices 1 and 2.
bool triangle_closest(Ray ray, Shear shear, Slabs slabs, vec3 v0, vec3 v1, vec3 v2, uint primitive, float best, out float t,
    out vec2 uv) {
    t = INFINITE;
    uv = vec2(0.0);
    Crossed crossed;
    if (!triangle_crossed(ray, shear, slabs, v0, v1, v2, primitive, best, crossed)) return false;
    t = crossed.t;
    if (crossed.doubtful) {
        if (!triangle_decide(ray, v0, v1, v2, crossed.t, t)) return false;
        t = crossed.near > t ? crossed.near : t;
        t = crossed.far < t ? crossed.far : t;
    }
    vec3 weight = crossed.weight;
    float det = weight.x + weight.y + weight.z;
    uv = vec2(weight.y / det, weight.z / det);
    return t <= best;
}

bool triangle_any(Ray ray, Shear shear, Slabs slabs, vec3 v0, vec3 v1, vec3 v2, uint primitive) {
    Crossed crossed;
    if (!triangle_crossed(ray, shear, slabs, v0, v1, v2, primitive, next_down(ray.t_max), crossed)) return false;
    float t;
    return !crossed.doubtful || triangle_decide(ray, v0, v1, v2, crossed.t, t);
}
#endif
