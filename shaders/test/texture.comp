#version 460
// The functions of textures one by one, for comparison with the processor.
#extension GL_GOOGLE_include_directive : require

#include "accel/parameterization.glsl"
#include "scene/texture.glsl"
#include "test/words.glsl"

const uint FUNCTION_TRIANGLE = 0u;
const uint FUNCTION_QUADRIC = 1u;
const uint FUNCTION_TEXTURE = 2u;

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Tables {
    Surfaces surfaces;
    UVec3s vertices;
    Vec2s uvs;
    QuadricMaps quadrics;
    Textures textures;
    Vec3s texels;
    Vec3s attributes;
};

float in_float(uint k) {
    return uintBitsToFloat(in_word(k));
}

void out_vec3(uint k, vec3 v) {
    for (uint i = 0u; i < 3u; ++i) out_word(k + i, floatBitsToUint(v[i]));
}

void main() {
    if (!start()) return;
    Tables tables = Tables(test.tables);
    UVec3s vertices = tables.vertices;
    vec3 v = vec3(in_float(1u), in_float(2u), in_float(3u));
    if (FUNCTION == FUNCTION_TEXTURE) {
        Texture texture = tables.textures.at[in_word(0u)];
        vec2 barycentrics = vec2(in_float(4u), in_float(5u));
        Vec3s texels = tables.texels, attributes = tables.attributes;
        vec2 gradient;
        out_vec3(0u, texture_eval(texture, texels, attributes, vertices, v.xy, in_word(3u), barycentrics, gradient));
        out_word(3u, floatBitsToUint(gradient.x));
        out_word(4u, floatBitsToUint(gradient.y));
        return;
    }
    Parameterization found;
    if (FUNCTION == FUNCTION_TRIANGLE) {
        Hit hit = Hit(0.0, in_word(0u), v.x, v.y);
        Vec2s uvs = tables.uvs;
        found = parameterization_triangle(tables.surfaces.at[hit.primitive], hit, vertices, uvs);
    } else {
        found = parameterization_quadric(tables.quadrics.at[in_word(0u)], v);
    }
    out_word(0u, floatBitsToUint(found.uv.x));
    out_word(1u, floatBitsToUint(found.uv.y));
    out_vec3(2u, found.dp_du);
    out_vec3(5u, found.dp_dv);
}
