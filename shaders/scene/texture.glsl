// Twin of src/scene/texture/.
#ifndef SCENE_TEXTURE
#define SCENE_TEXTURE

#include "math/vector.glsl"
#include "scene/scene.glsl"
#include "transport/specialise.glsl"

struct Texture {
    uint kind;
    // Bitmaps: one of WRAP_…, and 4 where bilinear.
    uint mode;
    uvec2 size;
    // Images of the axes and of the origin.
    vec2 u;
    vec2 v;
    vec2 origin;
    uint first;
    float scale;
};
const uint TEXTURE_BITMAP = 0u;
const uint TEXTURE_CHECKERBOARD = 1u;
const uint TEXTURE_VERTEX_ATTRIBUTE = 2u;
const uint TEXTURE_FACE_ATTRIBUTE = 3u;
const uint WRAP_REPEAT = 0u;
const uint WRAP_MIRROR = 1u;
const uint WRAP_CLAMP = 2u;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Textures { Texture at[]; };

// The texel at or before a coordinate, and the weight of the one after it.
int bitmap_texel(uint wrap, float x, uint size, float shift, out float weight) {
    if (!is_finite1(x)) x = 0.0;
    if (wrap == WRAP_CLAMP) {
        x = clamp1(x, 0.0, 1.0);
    } else {
        bool mirror = wrap == WRAP_MIRROR;
        x = x - (mirror ? 2.0 : 1.0) * floor((mirror ? 0.5 : 1.0) * x);
    }
    float position = x * float(size) - shift;
    float texel = floor(position);
    weight = position - texel;
    return int(texel);
}

uint bitmap_wrapped(uint wrap, int i, int size) {
    bool repeat = wrap == WRAP_REPEAT;
    if (i < 0) i = repeat ? i + size : -1 - i;
    if (i >= size) i = repeat ? i - size : wrap == WRAP_MIRROR ? 2 * size - 1 - i : size - 1;
    return uint(i < 0 ? 0 : i >= size ? size - 1 : i);
}

// `gradient`: derivatives of the first channel, for kernels with reliefs; zero but of bilinear pictures.
vec3 texture_eval(
    Texture texture, Vec3s texels, Vec3s attributes, UVec3s vertices, vec2 uv, uint triangle, vec2 barycentrics, out vec2 gradient
) {
    gradient = vec2(0.0);
    vec2 after = vec2(0.0);
    // A sum of up to four colours, whatever the kind.
    uint taps = 1u;
    vec4 weights = vec4(1.0);
    uvec4 indices = uvec4(texture.first);
    if (texture.kind <= TEXTURE_CHECKERBOARD) {
        uv = texture.u * uv.x + texture.v * uv.y + texture.origin;
    }
    if (texture.kind == TEXTURE_BITMAP) {
        bool bilinear = (texture.mode & 4u) != 0u;
        uint wrap = texture.mode & 3u;
        taps = bilinear ? 4u : 1u;
        ivec2 texel;
        for (uint k = 0u; k < 2u; ++k) {
            float weight;
            texel[k] = bitmap_texel(wrap, uv[k], texture.size[k], bilinear ? 0.5 : 0.0, weight);
            after[k] = weight;
        }
        for (uint tap = 0u; tap < taps; ++tap) {
            uint right = tap & 1u, below = tap >> 1;
            uint column = bitmap_wrapped(wrap, texel.x + int(right), int(texture.size.x));
            uint row = bitmap_wrapped(wrap, texel.y + int(below), int(texture.size.y));
            float horizontal = right == 1u ? after.x : 1.0 - after.x;
            float vertical = below == 1u ? after.y : 1.0 - after.y;
            weights[tap] = bilinear ? horizontal * vertical : 1.0;
            indices[tap] = texture.first + row * texture.size.x + column;
        }
    } else if (texture.kind == TEXTURE_CHECKERBOARD) {
        bool s = uv.x - floor(uv.x) > 0.5, t = uv.y - floor(uv.y) > 0.5;
        indices.x = texture.first + uint(s != t);
    } else {
        if (triangle == NONE) return vec3(0.0);
        texels = attributes;
        if (texture.kind == TEXTURE_VERTEX_ATTRIBUTE) {
            taps = 3u;
            indices = uvec4(texture.first + vertices.at[triangle], 0u);
            weights = vec4(1.0 - barycentrics.x - barycentrics.y, barycentrics, 0.0);
        } else {
            indices.x = texture.first + triangle;
        }
    }
    vec3 sum = vec3(0.0);
    vec4 f = vec4(0.0);
    for (uint tap = 0u; tap < taps; ++tap) {
        vec3 color = texels.at[indices[tap]];
        f[tap] = color.x;
        sum += color * weights[tap];
    }
    if (has(EFFECT_RELIEFS) && taps == 4u) {
        float across = ((f.y - f.x) * (1.0 - after.y) + (f.w - f.z) * after.y) * float(texture.size.x);
        float down = ((f.z - f.x) * (1.0 - after.x) + (f.w - f.y) * after.x) * float(texture.size.y);
        gradient = vec2(texture.u.x * across + texture.u.y * down, texture.v.x * across + texture.v.y * down);
    }
    return sum * texture.scale;
}
#endif
