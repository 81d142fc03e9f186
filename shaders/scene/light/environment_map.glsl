// Twin of src/scene/light/environment_map.rs: lookup and sampling.
#ifndef SCENE_LIGHT_ENVIRONMENT_MAP
#define SCENE_LIGHT_ENVIRONMENT_MAP

#include "math/frame.glsl"
#include "math/trig.glsl"
#include "sampling/discrete.glsl"
#include "sampling/rng.glsl"
#include "scene/scene.glsl"

// Radiance from a world direction, and the density with which environment_map_sample draws it.
vec3 environment_map_lookup(EnvironmentMap map, vec3 direction, out float pdf) {
    vec3 d = frame_to_local(Frame(map.x_axis, map.y_axis, map.z_axis), direction);
    float across = sqrt(d.x * d.x + d.z * d.z);
    float phi = across > 0.0 ? atan2(d.x, -d.z) : 0.0;
    uint width = map.width, bands = map.band_count;
    float x = phi * (FRAC_1_PI / 2.0) * float(width) - 0.5;
    x = x < 0.0 ? x + float(width) : x;
    float y = atan2(across, d.y) * FRAC_1_PI * float(bands);
    uint i = min(uint(x), width - 1u), j = min(uint(y), bands - 1u);
    float s = x - float(i), t = y - float(j);
    uint next = i + 1u == width ? 0u : i + 1u, above = j * width, below = above + width;
    vec3 upper = map.texels.at[above + i] * (1.0 - s) + map.texels.at[above + next] * s;
    vec3 lower = map.texels.at[below + i] * (1.0 - s) + map.texels.at[below + next] * s;
    pdf = map.bands.at[j].z * discrete_pmf(map.columns, above, width, i);
    return upper * (1.0 - t) + lower * t;
}

// Word 3 picks the band, word 0 the cell in it and the azimuth, word 1 the polar angle.
vec3 environment_map_sample(EnvironmentMap map, uvec4 words, out float pdf) {
    uint width = map.width, bands = map.band_count;
    uint j = discrete_pick(map.rows, 0u, bands, words.w);
    uint i = discrete_pick(map.columns, j * width, width, words.x);
    float pmf = discrete_pmf(map.columns, j * width, width, i);
    float part = (float(words.x - map.columns.at[j * width + i]) + 0.5) / (pmf * 4294967296.0);
    float turn = (float(i) + 0.5 + part) / float(width);
    float s, c;
    sin_cos_turns(turn >= 1.0 ? turn - 1.0 : turn, s, c);
    vec3 band = map.bands.at[j];
    float h = band.x + unit_f32(words.y) * band.y;
    float across = sqrt(h * (2.0 - h));
    pdf = band.z * pmf;
    // In the lower half the height is above the pole −y.
    vec3 local = vec3(s * across, 2u * j + 1u > bands ? h - 1.0 : 1.0 - h, -c * across);
    return frame_to_world(Frame(map.x_axis, map.y_axis, map.z_axis), local);
}
#endif
