// Twin of src/math/spherical.rs, without the inverses.
#ifndef MATH_SPHERICAL
#define MATH_SPHERICAL

#include "math/trig.glsl"
#include "math/vector.glsl"

float triangle_solid_angle(vec3 a, vec3 eb, vec3 ec, vec3 normal) {
    vec3 b = a + eb, c = a + ec;
    float la = length3(a), lb = length3(b), lc = length3(c);
    vec3 na = a / la, nb = b / lb, nc = c / lc;
    return 2.0 * atan2(-dot3(na, normal) / (lb * lc), 1.0 + dot3(na, nb) + dot3(nb, nc) + dot3(nc, na));
}

float parallelogram_solid_angle(vec3 a, vec3 u, vec3 v, vec3 normal) {
    vec3 b = a + u, c = a + u + v, d = a + v;
    float la = length3(a), lb = length3(b), lc = length3(c), ld = length3(d);
    vec3 na = a / la, nb = b / lb, nc = c / lc, nd = d / ld;
    float height = -dot3(na, normal) / lc;
    if (is_nan1(height) || height <= 0.0) return 0.0;
    float ac = 1.0 + dot3(na, nc);
    float y0 = height / lb, x0 = ac + dot3(na, nb) + dot3(nb, nc);
    float y1 = height / ld, x1 = ac + dot3(nc, nd) + dot3(nd, na);
    float half_angle = atan2(y0 * x1 + y1 * x0, x0 * x1 - y0 * y1);
    return 2.0 * (half_angle < 0.0 ? half_angle + TAU : half_angle);
}

float one_minus_cos(float along, float across) {
    float len = sqrt(along * along + across * across);
    return along > 0.0 ? across * across / (len * (len + along)) : (len - along) / len;
}

// Fields as in the Rust.
struct SphericalTriangle {
    float solid_angle;
    vec3 eb;
    vec3 ec;
    float la;
    float lb;
    vec3 nb;
    float xc;
    float yc;
    float k;
    float m;
    float n;
};

bool spherical_triangle_new(vec3 a, vec3 eb, vec3 ec, vec3 normal, out SphericalTriangle triangle) {
    float solid_angle = triangle_solid_angle(a, eb, ec, normal);
    vec3 b = a + eb;
    float la = length3(a), lb = length3(b);
    vec3 na = a / la, nb = b / lb;
    float xc = dot3(na, ec);
    vec3 across = ec - xc * na;
    float yc = length3(across);
    float k = 1.0 + dot3(na, nb), m = dot3(eb, across) / (yc * lb), n = -dot3(na, normal) / (yc * lb);
    triangle = SphericalTriangle(solid_angle, eb, ec, la, lb, nb, xc, yc, k, m, n);
    return solid_angle > 0.0 && yc > 0.0;
}

// Components along and across b/|b| of the vector from b to C′.
vec2 spherical_triangle_chord(SphericalTriangle triangle, float s) {
    vec3 e = s * triangle.ec - triangle.eb;
    float x = dot3(triangle.nb, e);
    return vec2(x, length3(e - x * triangle.nb));
}

// A point as weights of b and c.
vec2 spherical_triangle_sample(SphericalTriangle triangle, vec2 u) {
    float sin, cos;
    sin_cos_turns(u.x * triangle.solid_angle * (0.5 / TAU), sin, cos);
    float ty = sin * triangle.k, tx = triangle.n * cos - sin * triangle.m;
    float s = 2.0 * ty * tx * triangle.la / (triangle.yc * (tx * tx - ty * ty) - 2.0 * triangle.xc * ty * tx);
    s = clamp1(s, 0.0, 1.0);
    vec2 chord = spherical_triangle_chord(triangle, s);
    float x = chord.x, y = chord.y;
    float along = triangle.lb + x;
    float h = u.y * one_minus_cos(along, y);
    sin = sqrt(max(h * (2.0 - h), 0.0));
    cos = 1.0 - h;
    float r = y > 0.0 ? clamp1(triangle.lb * sin / (y * cos - x * sin), 0.0, 1.0) : u.y;
    return vec2(1.0 - r, r * s);
}

float strip(float x, vec2 y, float z) {
    float r0 = z * sqrt(x * x + y.x * y.x + z * z), r1 = z * sqrt(x * x + y.y * y.y + z * z);
    float n0 = x * y.x, n1 = x * y.y;
    return atan2(n1 * r0 - n0 * r1, r0 * r1 + n0 * n1);
}

// Fields as in the Rust.
struct SphericalRectangle {
    float solid_angle;
    float z;
    float x0;
    float lx;
    float y0;
    float ly;
    float phi0;
    float sin0;
    float sin1;
    float cos0;
};

bool spherical_rectangle_new(
    vec3 a, vec3 x, float lx, vec3 y, float ly, vec3 n, float solid_angle, out SphericalRectangle rectangle
) {
    float x0 = dot3(a, x), y0 = dot3(a, y), z = -dot3(a, n);
    float x1 = x0 + lx, y1 = y0 + ly;
    float far2 = max1(x0 * x0, x1 * x1) + max1(y0 * y0, y1 * y1) + z * z;
    float r0 = sqrt(y0 * y0 + z * z), r1 = sqrt(y1 * y1 + z * z);
    float phi0 = strip(x0, vec2(y0, y1), z);
    rectangle = SphericalRectangle(solid_angle, z, x0, lx, y0, ly, phi0, y0 / r0, y1 / r1, z / r0);
    return solid_angle >= 1.0 / 1024.0 && far2 * sqrt(far2) <= 2048.0 * z * z * min1(lx, ly);
}

// A point in units of the sides.
vec2 spherical_rectangle_sample(SphericalRectangle rectangle, vec2 u) {
    float phi = rectangle.phi0 + u.x * rectangle.solid_angle;
    float sin, cos;
    sin_cos_turns(abs(phi) * (1.0 / TAU), sin, cos);
    float e = rectangle.sin1 - rectangle.sin0 * cos, f = rectangle.cos0 * sin;
    float x = copysign1(rectangle.z * sin / sqrt(max1((e - f) * (e + f), 0.0)), phi);
    x = sin > 0.0 ? clamp1(x, rectangle.x0, rectangle.x0 + rectangle.lx) : 0.0;
    float d2 = x * x + rectangle.z * rectangle.z;
    float y1 = rectangle.y0 + rectangle.ly;
    float h0 = rectangle.y0 / sqrt(d2 + rectangle.y0 * rectangle.y0), h1 = y1 / sqrt(d2 + y1 * y1);
    float h = h0 + u.y * (h1 - h0);
    float y = h * sqrt(d2 / ((1.0 - h) * (1.0 + h)));
    return vec2(clamp1((x - rectangle.x0) / rectangle.lx, 0.0, 1.0), clamp1((y - rectangle.y0) / rectangle.ly, 0.0, 1.0));
}
#endif
