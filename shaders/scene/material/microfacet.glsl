// Twin of src/scene/material/microfacet.rs.
#ifndef SCENE_MATERIAL_MICROFACET
#define SCENE_MATERIAL_MICROFACET

#include "math/special.glsl"
#include "math/trig.glsl"
#include "math/warp.glsl"
#include "sampling/rng.glsl"
#include "transport/specialise.glsl"

const uint DISTRIBUTION_GGX = 0u;
const uint DISTRIBUTION_BECKMANN = 1u;

struct Half {
    float d;
    float visible_o;
    float g_i;
    float cos_o;
    float cos_i;
    float length2;
};

// Whether the slopes are Gaussian, in kernels that know them.
bool is_beckmann(uint distribution) {
    return has(EFFECT_BECKMANN) && distribution == DISTRIBUTION_BECKMANN;
}

float microfacet_density(uint distribution, vec2 alpha, vec3 m) {
    float x = m.x / alpha.x, y = m.y / alpha.y;
    float slope2 = x * x + y * y, z2 = m.z * m.z;
    if (is_beckmann(distribution)) {
        float e = exp_neg(slope2 / z2);
        return e > 0.0 ? e / (PI * alpha.x * alpha.y * z2 * z2) : 0.0;
    }
    float s = slope2 + z2;
    return 1.0 / (PI * alpha.x * alpha.y * s * s);
}

float microfacet_shadowing(uint distribution, vec2 alpha, vec3 v) {
    float x = v.x * alpha.x, y = v.y * alpha.y, z = abs(v.z);
    float s2 = x * x + y * y;
    if (is_beckmann(distribution)) {
        float s = sqrt(s2);
        float a = z / s;
        return 1.0 / (z + 0.5 * exp_neg(a * a) * (s * FRAC_1_SQRT_PI - z * erfcx(a)));
    }
    return 2.0 / (z + sqrt(z * z + s2));
}

bool microfacet_half(uint distribution, vec2 alpha, vec3 wo, vec3 wi, float eta, out Half h) {
    h = Half(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    vec3 across = wo + wi * eta;
    float size = length3(across);
    if (!(size > 0.0 && wo.z > 0.0)) return false;
    vec3 m = across / (across.z < 0.0 ? -size : size);
    float cos_o = dot3(wo, m), cos_i = dot3(wi, m);
    if (!(cos_o > 0.0 && (wi.z > 0.0 ? cos_i > 0.0 : cos_i < 0.0))) return false;
    float shadowing[2];
    for (int k = 0; k < 2; ++k) shadowing[k] = microfacet_shadowing(distribution, alpha, k == 0 ? wo : wi);
    h = Half(microfacet_density(distribution, alpha, m), shadowing[0], shadowing[1] * abs(wi.z), cos_o, cos_i, size * size);
    return true;
}

vec3 upright(float x, float y, float z) {
    vec3 m = vec3(x, y, z > 0.0 ? z : 0.0);
    float size = length3(m);
    return size > 0.0 ? m / size : vec3(0.0, 0.0, 1.0);
}

const float SMALLEST = 1.0 / 33554432.0;
const float LARGEST = 1.0 - 1.0 / 8388608.0;
const int STEPS = 6;

vec2 visible_slopes(float tan, float cot, vec2 u) {
    u = vec2(u.x > SMALLEST ? u.x : SMALLEST, u.y > SMALLEST ? u.y : SMALLEST);
    float scale = tan * FRAC_1_SQRT_PI;
    float largest = erf(cot);
    largest = largest < LARGEST ? largest : LARGEST;
    float target = u.x * (1.0 + largest + scale * exp_neg(cot * cot));
    float low = -LARGEST, high = largest;
    float x = largest - (1.0 + largest) * erf(sqrt(-ln(u.x)));
    // The last two rounds give the slopes: one copy of the inverse error function.
    float slope = 0.0;
    vec2 slopes = vec2(0.0);
    for (int k = 0; k < STEPS + 2; ++k) {
        if (k <= STEPS) x = x >= low && x <= high ? x : 0.5 * (low + high);
        slope = erf_inv(k <= STEPS ? x : 2.0 * u.y - 1.0);
        if (k == STEPS) slopes.x = slope;
        if (k == STEPS + 1) slopes.y = slope;
        float value = 1.0 + x + scale * exp_neg(slope * slope) - target;
        if (value > 0.0) {
            high = x;
        } else {
            low = x;
        }
        x -= value / (1.0 - slope * tan);
    }
    return slopes;
}

vec3 microfacet_sample_visible(uint distribution, vec2 alpha, vec3 wo, uvec4 words) {
    vec2 u = vec2(unit_f32(words.x), unit_f32(words.y));
    vec3 v = vec3(wo.x * alpha.x, wo.y * alpha.y, wo.z);
    v = v / length3(v);
    if (is_beckmann(distribution)) {
        float sin2 = v.x * v.x + v.y * v.y;
        float sin = sqrt(sin2);
        float c = sin > 0.0 ? v.x / sin : 1.0, s = sin > 0.0 ? v.y / sin : 0.0;
        vec2 slopes = visible_slopes(sin / v.z, v.z / sin, u);
        return upright(-alpha.x * (c * slopes.x - s * slopes.y), -alpha.y * (s * slopes.x + c * slopes.y), 1.0);
    }
    float z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    float r2 = (1.0 - z) * (1.0 + z);
    float r = r2 > 0.0 ? sqrt(r2) : 0.0;
    float s, c;
    sin_cos_turns(u.x, s, c);
    return upright(alpha.x * (r * c + v.x), alpha.y * (r * s + v.y), z + v.z);
}

float other_pdf(uint directions, vec3 wi, bool both) {
    float pdf = directions == DIRECTIONS_UNIFORM ? uniform_hemisphere_pdf() : cosine_hemisphere_pdf(abs(wi.z));
    return both ? 0.5 * pdf : pdf;
}

vec3 mirrored(vec3 wo, vec3 m) {
    return m * (2.0 * dot3(wo, m)) - wo;
}
#endif
