// Twin of src/scene/light/choice.rs.
#ifndef SCENE_LIGHT_CHOICE
#define SCENE_LIGHT_CHOICE

#include "sampling/discrete.glsl"
#include "sampling/strategy.glsl"
#include "scene/light/area.glsl"
#include "scene/light/constant.glsl"
#include "scene/light/environment_map.glsl"
#include "scene/light/point.glsl"
#include "scene/light/spot.glsl"

struct LightSample {
    // There is no `to`, only `wi`.
    bool direction_only;
    Endpoint to;
    vec3 wi;
    vec3 emitted;
    // The choice included; of `delta` lights the probability of the choice.
    float pdf;
    bool delta;
};

bool light_is_at_point(LightEntry entry) {
#ifdef FULL
    if (light_kind(entry, LIGHT_SPOT)) return true;
#endif
    return light_kind(entry, LIGHT_POINT);
}

// Words 0, 1 place it on the light, 2 picks the light, 3 a part of it.
bool light_sampler_sample(LightSampler lights, Surfaces surfaces, uint lights_mode, vec3 p, uvec4 words, out LightSample s) {
    s = LightSample(false, endpoint_free(vec3(0.0)), vec3(0.0), vec3(0.0), 0.0, false);
    if (lights.entry_count == 0u) return false;
    uint index = discrete_pick(lights.choice, 0u, lights.entry_count, words.z);
    LightEntry entry = lights.entries.at[index];
    s.emitted = entry.radiance;
    if (light_kind(entry, LIGHT_ENVIRONMENT)) {
        s.direction_only = true;
        s.wi = constant_sample(words);
        s.pdf = constant_pdf();
#ifdef FULL
    } else if (light_kind(entry, LIGHT_ENVIRONMENT_MAP)) {
        s.direction_only = true;
        s.wi = environment_map_sample(lights.environment_map.it, words, s.pdf);
        float density;
        s.emitted = environment_map_lookup(lights.environment_map.it, s.wi, density);
    } else if (light_kind(entry, LIGHT_DIRECTIONAL)) {
        s.direction_only = true;
        s.wi = entry.w;
        s.pdf = 1.0;
        s.delta = true;
#endif
    } else if (light_is_at_point(entry)) {
        if (!point_sample(entry.a, entry.radiance, p, s.to, s.emitted)) return false;
        if (!try_normalize3(s.to.p - p, s.wi)) return false;
#ifdef FULL
        if (light_kind(entry, LIGHT_SPOT)) s.emitted *= spot_falloff(entry.w, entry.radius, entry.density, -s.wi);
        if (s.emitted == vec3(0.0)) return false;
#endif
        s.pdf = 1.0;
        s.delta = true;
    } else {
        bool solid = lights_mode == LIGHTS_SOLID_ANGLE;
        if (!emitter_sample(entry, lights, surfaces, p, words, solid, s.to, s.wi, s.pdf)) return false;
    }
    s.pdf = s.pdf * discrete_pmf(lights.choice, 0u, lights.entry_count, index);
    return s.pdf > 0.0;
}

// Density over solid angle, the choice included; 0 where light_sampler_sample never draws `wi`.
float light_sampler_pdf(LightSampler lights, Surfaces surfaces, uint lights_mode, vec3 p, vec3 wi, SurfacePoint hit,
    uint primitive) {
    uint index = lights.of_shape.at[hit.shape];
    if (index == NONE) return 0.0;
    LightEntry entry = lights.entries.at[index];
    bool solid = lights_mode == LIGHTS_SOLID_ANGLE;
    float pdf;
    if (!emitter_pdf(entry, lights, surfaces, p, wi, hit, primitive, solid, pdf)) return 0.0;
    return pdf * discrete_pmf(lights.choice, 0u, lights.entry_count, index);
}

// Radiance from outside the scene, and the density of sampling it. `constant`: the radiance where there is no map.
vec3 light_sampler_escape(LightSampler lights, bool mapped, vec3 constant, vec3 direction, out float pdf) {
    pdf = lights.environment_pdf;
#ifdef FULL
    if (mapped && uint64_t(lights.environment_map) != 0ul) {
        float density;
        vec3 radiance = environment_map_lookup(lights.environment_map.it, direction, density);
        pdf = density * lights.environment_pdf;
        return radiance;
    }
#endif
    return constant;
}
#endif
