// Twin of src/math/warp.rs, without the inverses and the density of the Gaussian.
#ifndef MATH_WARP
#define MATH_WARP

#include "math/trig.glsl"
#include "math/vector.glsl"
#include "scene/scene.glsl"

vec3 sample_uniform_cone(vec2 u, float height) {
    float h = u.x * height;
    float r = sqrt(h * (2.0 - h));
    float s, c;
    sin_cos_turns(u.y, s, c);
    return vec3(r * c, r * s, 1.0 - h);
}

vec3 sample_uniform_hemisphere(vec2 u) { return sample_uniform_cone(u, 1.0); }

float uniform_hemisphere_pdf() { return FRAC_1_PI / 2.0; }

vec3 sample_uniform_sphere(vec2 u) {
    float r = 2.0 * sqrt(u.x * (1.0 - u.x));
    float s, c;
    sin_cos_turns(u.y, s, c);
    return vec3(r * c, r * s, 1.0 - 2.0 * u.x);
}

float uniform_sphere_pdf() { return FRAC_1_PI / 4.0; }

const float HALF_STEP = 1.0 / 16777216.0;

// Uniform point of the unit disk, with its radius.
vec2 concentric(vec2 u, out float r) {
    float a = 2.0 * u.x - 1.0 + HALF_STEP;
    float b = 2.0 * u.y - 1.0 + HALF_STEP;
    bool wide = abs(a) > abs(b);
    r = wide ? abs(a) : abs(b);
    float minor = wide ? abs(b) : abs(a);
    float s, c;
    sin_cos_eighth(0.125 * (minor / (r == 0.0 ? 1.0 : r)), s, c);
    float along = r * c, across = r * s;
    return vec2(copysign1(wide ? along : across, a), copysign1(wide ? across : along, b));
}

vec2 sample_uniform_disk(vec2 u) {
    float r;
    return concentric(u, r);
}

float uniform_disk_pdf() { return FRAC_1_PI; }

vec3 sample_cosine_hemisphere(vec2 u) {
    float r;
    vec2 d = concentric(u, r);
    return vec3(d, sqrt((1.0 - r) * (1.0 + r)));
}

float cosine_hemisphere_pdf(float cos) { return max1(cos, 0.0) * FRAC_1_PI; }

float uniform_cone_pdf(float height) { return 1.0 / (TAU * height); }

vec2 sample_uniform_triangle(vec2 u) {
    if (u.y > u.x) {
        float b = 0.5 * u.x;
        return vec2(b, u.y - b);
    }
    float b = 0.5 * u.y;
    return vec2(u.x - b, b);
}

float uniform_triangle_pdf() { return 2.0; }

float sample_tent(float u) { return u < 0.5 ? sqrt(2.0 * u) - 1.0 : 1.0 - sqrt(2.0 - 2.0 * u); }

float tent_pdf(float x) { return max1(1.0 - abs(x), 0.0); }

const uint WARP_CELLS = 1024u;

// `quantiles`: gaussian_quantiles() of the Rust.
float sample_gaussian(float u, Floats quantiles) {
    float tail = u < 0.5 ? 2.0 * u : 2.0 - 2.0 * u;
    float w = sqrt(tail) * float(WARP_CELLS);
    uint j = min(uint(w), WARP_CELLS - 1u);
    float q = quantiles.at[j];
    float x = q + (quantiles.at[j + 1u] - q) * (w - float(j));
    return u < 0.5 ? -x : x;
}
#endif
