// Calls one function of math/, scene/filter, scene/material/ per specialisation; the host compares with the Rust.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "math/frame.glsl"
#include "math/robust.glsl"
#include "math/special.glsl"
#include "math/spherical.glsl"
#include "math/trig.glsl"
#include "math/vector.glsl"
#include "math/warp.glsl"
#include "scene/filter.glsl"
#include "scene/material/material.glsl"
#include "scene/scene.glsl"
#include "test/words.glsl"

const uint SIN_COS_EIGHTH = 0u;
const uint SIN_COS_TURNS = 1u;
const uint ATAN2 = 2u;
const uint FRAME_TO_WORLD = 3u;
const uint FRAME_TO_LOCAL = 4u;
const uint GAMMA = 5u;
const uint OFFSET_ORIGIN = 6u;
const uint SAMPLE_UNIFORM_HEMISPHERE = 7u;
const uint UNIFORM_HEMISPHERE_PDF = 8u;
const uint SAMPLE_UNIFORM_SPHERE = 9u;
const uint UNIFORM_SPHERE_PDF = 10u;
const uint SAMPLE_UNIFORM_DISK = 11u;
const uint UNIFORM_DISK_PDF = 12u;
const uint SAMPLE_COSINE_HEMISPHERE = 13u;
const uint COSINE_HEMISPHERE_PDF = 14u;
const uint SAMPLE_UNIFORM_CONE = 15u;
const uint UNIFORM_CONE_PDF = 16u;
const uint SAMPLE_UNIFORM_TRIANGLE = 17u;
const uint UNIFORM_TRIANGLE_PDF = 18u;
const uint SAMPLE_TENT = 19u;
const uint TENT_PDF = 20u;
const uint SAMPLE_GAUSSIAN = 21u;
const uint TRIANGLE_SOLID_ANGLE = 22u;
const uint PARALLELOGRAM_SOLID_ANGLE = 23u;
const uint SPHERICAL_TRIANGLE = 24u;
const uint SPHERICAL_RECTANGLE = 25u;
const uint EXP_NEG = 26u;
const uint LN = 27u;
const uint ERF = 28u;
const uint ERF_INV = 29u;
const uint MATERIAL_EVAL = 30u;
const uint MATERIAL_SAMPLE = 31u;
const uint DOT3 = 32u;
const uint CROSS3 = 33u;
const uint LENGTH3 = 34u;
const uint NORMALIZE3 = 35u;
const uint TRY_NORMALIZE3 = 36u;
const uint NORMALIZE_OR3 = 37u;
const uint MIN_MAX = 38u;
const uint CLAMP1 = 39u;
const uint FILTER_SAMPLE = 40u;

float f1(uint k) { return uintBitsToFloat(in_word(k)); }
vec2 f2(uint k) { return vec2(f1(k), f1(k + 1u)); }
vec3 f3(uint k) { return vec3(f1(k), f1(k + 1u), f1(k + 2u)); }
Material material() {
    return Material(f3(0u), in_word(3u), f3(4u), f1(7u), f3(8u), in_word(11u), f2(12u), in_word(14u), in_word(15u), f1(16u),
        f1(17u), uvec4(NONE), uvec2(0u), vec3(0.0), 0u, NONE);
}

void put(uint k, float x) { out_word(k, floatBitsToUint(x)); }
void put(uint k, bool x) { out_word(k, uint(x)); }

void put(uint k, vec2 x) {
    put(k, x.x);
    put(k + 1u, x.y);
}

void put(uint k, vec3 x) {
    put(k, x.x);
    put(k + 1u, x.y);
    put(k + 2u, x.z);
}
// Word 0 tells the side as well.
void put_scattered(Scattered s) {
    out_word(0u, s.wi.z < 0.0 ? 2u : 1u);
    put(1u, s.wi);
    put(4u, s.pdf);
    put(5u, s.value);
    put(8u, s.delta);
    put(9u, s.eta);
}

void main() {
    if (!start()) return;
    switch (FUNCTION) {
        case SIN_COS_EIGHTH:
        case SIN_COS_TURNS: {
            float s, c;
            if (FUNCTION == SIN_COS_EIGHTH) {
                sin_cos_eighth(f1(0u), s, c);
            } else {
                sin_cos_turns(f1(0u), s, c);
            }
            put(0u, vec2(s, c));
            break;
        }
        case ATAN2: put(0u, atan2(f1(0u), f1(1u))); break;
        case FRAME_TO_WORLD: put(0u, frame_to_world(frame_new(f3(0u)), f3(3u))); break;
        case FRAME_TO_LOCAL: put(0u, frame_to_local(frame_new(f3(0u)), f3(3u))); break;
        case GAMMA: put(0u, gamma(in_word(0u))); break;
        case OFFSET_ORIGIN: put(0u, offset_origin(f3(0u), f3(3u), f3(6u), f3(9u))); break;
        case SAMPLE_UNIFORM_HEMISPHERE: put(0u, sample_uniform_hemisphere(f2(0u))); break;
        case UNIFORM_HEMISPHERE_PDF: put(0u, uniform_hemisphere_pdf()); break;
        case SAMPLE_UNIFORM_SPHERE: put(0u, sample_uniform_sphere(f2(0u))); break;
        case UNIFORM_SPHERE_PDF: put(0u, uniform_sphere_pdf()); break;
        case SAMPLE_UNIFORM_DISK: put(0u, sample_uniform_disk(f2(0u))); break;
        case UNIFORM_DISK_PDF: put(0u, uniform_disk_pdf()); break;
        case SAMPLE_COSINE_HEMISPHERE: put(0u, sample_cosine_hemisphere(f2(0u))); break;
        case COSINE_HEMISPHERE_PDF: put(0u, cosine_hemisphere_pdf(f1(0u))); break;
        case SAMPLE_UNIFORM_CONE: put(0u, sample_uniform_cone(f2(0u), f1(2u))); break;
        case UNIFORM_CONE_PDF: put(0u, uniform_cone_pdf(f1(0u))); break;
        case SAMPLE_UNIFORM_TRIANGLE: put(0u, sample_uniform_triangle(f2(0u))); break;
        case UNIFORM_TRIANGLE_PDF: put(0u, uniform_triangle_pdf()); break;
        case SAMPLE_TENT: put(0u, sample_tent(f1(0u))); break;
        case TENT_PDF: put(0u, tent_pdf(f1(0u))); break;
        case SAMPLE_GAUSSIAN: put(0u, sample_gaussian(f1(0u), Floats(test.tables))); break;
        case TRIANGLE_SOLID_ANGLE: put(0u, triangle_solid_angle(f3(0u), f3(3u), f3(6u), f3(9u))); break;
        case PARALLELOGRAM_SOLID_ANGLE: put(0u, parallelogram_solid_angle(f3(0u), f3(3u), f3(6u), f3(9u))); break;
        case SPHERICAL_TRIANGLE: {
            SphericalTriangle triangle;
            if (spherical_triangle_new(f3(0u), f3(3u), f3(6u), f3(9u), triangle)) {
                put(0u, true);
                put(1u, triangle.solid_angle);
                put(2u, spherical_triangle_sample(triangle, f2(12u)));
            }
            break;
        }
        case SPHERICAL_RECTANGLE: {
            SphericalRectangle rectangle;
            if (spherical_rectangle_new(f3(0u), f3(3u), f1(6u), f3(7u), f1(10u), f3(11u), f1(14u), rectangle)) {
                put(0u, true);
                put(1u, spherical_rectangle_sample(rectangle, f2(15u)));
            }
            break;
        }
        case EXP_NEG: put(0u, exp_neg(f1(0u))); break;
        case LN: put(0u, ln(f1(0u))); break;
        case ERF:
            put(0u, erf(f1(0u)));
            put(1u, erfcx(abs(f1(0u))));
            break;
        case ERF_INV: put(0u, erf_inv(f1(0u))); break;
        case MATERIAL_EVAL: {
            float pdf;
            put(0u, material_eval(material(), Floats(test.tables), in_word(18u), f3(19u), f3(22u), pdf));
            put(3u, pdf);
            break;
        }
        case MATERIAL_SAMPLE: {
            Scattered s;
            uvec4 drawn = uvec4(in_word(22u), in_word(23u), in_word(24u), in_word(25u));
            if (material_sample(material(), Floats(test.tables), in_word(18u), f3(19u), drawn, s)) put_scattered(s);
            break;
        }
        case DOT3: put(0u, dot3(f3(0u), f3(3u))); break;
        case CROSS3: put(0u, cross3(f3(0u), f3(3u))); break;
        case LENGTH3: put(0u, length3(f3(0u))); break;
        case NORMALIZE3: put(0u, normalize3(f3(0u))); break;
        case TRY_NORMALIZE3: {
            vec3 normalized;
            if (try_normalize3(f3(0u), normalized)) {
                put(0u, true);
                put(1u, normalized);
            }
            break;
        }
        case NORMALIZE_OR3: put(0u, normalize_or3(f3(0u), f3(3u))); break;
        case MIN_MAX:
            put(0u, min1(f1(0u), f1(1u)));
            put(1u, max1(f1(0u), f1(1u)));
            put(2u, min_element3(f3(0u)));
            put(3u, max_element3(f3(0u)));
            break;
        case CLAMP1: put(0u, clamp1(f1(0u), f1(1u), f1(2u))); break;
        case FILTER_SAMPLE: {
            Film film = Film(uvec2(0u), uvec2(0u), uvec2(0u), in_word(0u), f1(1u));
            put(0u, filter_sample(film, f2(2u), Floats(test.tables)));
            break;
        }
    }
}
