// Twin of src/transport/path.rs, one path at a time. The including entry brings trace_closest and trace_occluded.
#ifndef TRANSPORT_PATH
#define TRANSPORT_PATH

#include "transport/specialise.glsl"
#include "accel/surface.glsl"
#include "math/frame.glsl"
#include "sampling/dimension.glsl"
#include "sampling/heuristic.glsl"
#include "sampling/rng.glsl"
#include "sampling/sequence/sequence.glsl"
#include "sampling/strategy.glsl"
#include "scene/camera.glsl"
#include "scene/light/choice.glsl"
#include "scene/material/material.glsl"
#include "transport/tracer.glsl"
#ifdef FULL
#include "scene/material/relief.glsl"
#else
// Nothing is ever bent.
struct Bent { float alpha2; };
#endif

const float LARGEST_SURVIVAL = 0.999;

struct Path {
    Ray ray;
    vec3 wo;
    vec3 beta;
    vec3 radiance;
    // Density and origin of the last drawn direction.
    float pdf;
    vec3 p;
    uint depth;
    // No other technique draws that direction.
    bool delta;
    // Squared index of refraction where the path is, over that at the camera.
    float eta2;
};

struct Vertex {
    SurfacePoint at;
    uint front;
    uint back;
    // Index of the light, or NONE.
    uint light;
};

void path_start(TracerAt tracer, Draw draw, out Path path) {
    uvec4 words = draw_words(SEQUENCE, draw, group(0u, DECISION_DIRECTION));
    vec3 origin, direction;
    float t_max;
    vec2 u = vec2(unit_f32(words.x), unit_f32(words.y));
    vec2 st = film_sample(tracer.it.film, tracer.it.quantiles, draw.pixel, u);
    camera_ray(tracer.it.camera, st, origin, direction, t_max);
#ifdef FULL
    if (has(EFFECT_LENS) && tracer.it.camera.projection == PROJECTION_THIN_LENS) {
        words = draw_words(SEQUENCE, draw, group(0u, DECISION_LENS));
        thin_lens_ray(tracer.it.camera, vec2(unit_f32(words.x), unit_f32(words.y)), origin, direction);
    }
    if (has(EFFECT_ORTHOGRAPHIC) && tracer.it.camera.projection == PROJECTION_ORTHOGRAPHIC) {
        orthographic_ray(tracer.it.camera, origin, direction);
    }
#endif
    path.ray = ray_new(origin, direction, t_max);
    path.wo = -normalize3(direction);
    path.beta = vec3(1.0);
    path.radiance = vec3(0.0);
    path.pdf = 0.0;
    path.p = vec3(0.0);
    path.depth = 1u;
    path.delta = true;
    path.eta2 = 1.0;
}

Vertex path_vertex(TracerAt tracer, Ray ray, Hit hit) {
    Vertex vertex;
    if (has(EFFECT_TRIANGLES) && (!has(EFFECT_QUADRICS) || hit.primitive < tracer.it.triangle_count)) {
        Surface surface = tracer.it.surfaces.at[hit.primitive];
        vertex.at = surface_point_triangle(surface, hit, has(EFFECT_SMOOTH_NORMALS), tracer.it.vertices, tracer.it.normals);
        vertex.front = surface.front;
        vertex.back = surface.back;
        vertex.light = NONE;
        if (has(EFFECT_EMITTING_SURFACES) && (surface.flags & SURFACE_LIGHT) != 0u) {
            vertex.light = tracer.it.shapes.at[surface.shape].light;
        }
    } else {
        uint index = hit.primitive - tracer.it.triangle_count;
        Shape shape = tracer.it.shapes.at[index];
        vertex.at = surface_point_quadric(tracer.it.quadrics.at[shape.quadric], ray, hit, index);
        vertex.front = shape.front;
        vertex.back = shape.back;
        vertex.light = shape.light;
    }
    return vertex;
}

#ifdef FULL
// Twin of frame_along in src/transport/shading.rs.
Frame frame_along(vec3 n, vec3 along) {
    vec3 s;
    if (try_normalize3(along - n * dot3(n, along), s)) return Frame(s, cross3(n, s), n);
    return frame_new(n);
}

// Twin of shade in src/transport/shading.rs.
Material path_shade_full(TracerAt tracer, Draw draw, uint depth, Vertex vertex, Hit hit, uint index, vec3 normal, vec3 wo, out Frame frame, out Bent bent) {
    uvec4 words = uvec4(0u);
    if (has(EFFECT_MIXTURES)) words = draw_words(SEQUENCE, draw, FIRST_LAYER + depth);
    Parameterization surface;
    if (vertex.at.triangle != NONE) {
        surface = parameterization_triangle(tracer.it.surfaces.at[hit.primitive], hit, tracer.it.vertices, tracer.it.uvs);
    } else {
        surface = parameterization_quadric(tracer.it.quadric_maps.at[tracer.it.shapes.at[vertex.at.shape].quadric], vertex.at.p);
    }
    Material material;
    vec2 gradient;
    for (uint level = 0u;; ++level) {
        material = tracer.it.materials.at[index];
        for (uint k = has(EFFECT_TEXTURES) ? 0u : 4u; k < (has(EFFECT_RELIEFS) ? 5u : 4u); ++k) {
            uint t = k == 4u ? material.relief_texture : material.textures[k];
            if (t == NONE) continue;
            vec3 value = texture_eval(tracer.it.textures.at[t], tracer.it.texels, tracer.it.attributes, tracer.it.vertices,
                surface.uv, vertex.at.triangle, vec2(hit.u, hit.v), gradient);
            if (k == 0u) material.reflectance = value;
            if (k == 1u) material.second = value;
            if (k == 2u) material.alpha.x = value.x;
            if (k == 3u) material.alpha.y = value.x;
            if (k == 4u && (material.relief_mode & RELIEF_MAP) != RELIEF_BUMP) material.relief = value;
        }
        if (!is(material, EFFECT_MIXTURES, MATERIAL_MIXTURE) || level == MIXTURE_DEPTH) break;
        index = material.materials[happens(words[level], material.alpha.x) ? 1u : 0u];
    }
    for (uint k = 0u; k < 2u; ++k) material.alpha[k] = clamp1(material.alpha[k], SMALLEST_ALPHA, LARGEST_ALPHA);
    bent = Bent(normal, -1.0);
    bool turned = has(EFFECT_TANGENTS) && material.alpha.x != material.alpha.y;
    bool relief = has(EFFECT_RELIEFS) && material.relief_mode != 0u;
    vec3 along = turned || relief ? surface.dp_du : vec3(0.0);
    for (uint k = 0u; k < 2u; ++k) {
        frame = frame_along(normal, along);
        vec3 n;
        if (k == 1u || !relief) break;
        if (relief_bend(material, gradient, surface, vertex.at, frame, wo, n, bent)) {
            normal = n;
            along = frame.s;
            // The relief is seen from behind: one-sided materials are black there.
            if (!(dot3(n, wo) > 0.0)) material.kind = MATERIAL_BLACK;
        } else if (!turned) {
            along = vec3(0.0);
        }
    }
    return material;
}
#endif

// The material of one layer, and the frame around the shading normal on the side of the path; `cos` is between the two.
Material path_shade(TracerAt tracer, Draw draw, Path path, Vertex vertex, Hit hit, float cos, out Frame frame, out Bent bent) {
    uint index = cos > 0.0 ? vertex.front : vertex.back;
    vec3 normal = vertex.at.ns * copysign1(1.0, cos);
#ifdef FULL
    if (has(EFFECT_TEXTURES | EFFECT_TANGENTS | EFFECT_RELIEFS | EFFECT_MIXTURES)) {
        return path_shade_full(tracer, draw, path.depth, vertex, hit, index, normal, path.wo, frame, bent);
    }
#endif
    bent.alpha2 = -1.0;
    frame = frame_new(normal);
    return tracer.it.materials.at[index];
}

float weight_of_direction(float pdf_direction, float pdf_light) {
    if (HEURISTIC == HEURISTIC_NONE) return pdf_light <= 0.0 ? 1.0 : 0.0;
    return heuristic_weight(HEURISTIC, pdf_direction, pdf_light);
}

vec3 path_met(Path path, vec3 carried, float pdf_light) {
    float weight = path.delta ? 1.0 : weight_of_direction(path.pdf, pdf_light);
    return carried * weight;
}

vec3 path_emission(TracerAt tracer, Path path, Vertex vertex) {
    vec3 radiance = tracer.it.radiances.at[vertex.light];
    if (!(dot3(vertex.at.ng, path.wo) > 0.0) || radiance == vec3(0.0)) return vec3(0.0);
    float pdf_light = 0.0;
    if (has(EFFECT_SAMPLED_LIGHTS) && !path.delta && LIGHTS != LIGHTS_NONE) {
        pdf_light = light_sampler_pdf(tracer.it.lights, tracer.it.surfaces, LIGHTS, path.p, -path.wo, vertex.at,
            vertex.at.triangle);
    }
    return path_met(path, path.beta * radiance, pdf_light);
}

vec3 path_escape(TracerAt tracer, Path path) {
    float pdf_light;
    vec3 radiance = light_sampler_escape(tracer.it.lights, has(EFFECT_ENVIRONMENT_MAP), tracer.it.environment, path.ray.direction,
        pdf_light);
    if (radiance == vec3(0.0)) return vec3(0.0);
    return path_met(path, path.beta * radiance, path.delta ? 0.0 : pdf_light);
}

// Next-event estimation.
vec3 path_light(TracerAt tracer, Draw draw, Path path, Vertex vertex, Frame frame, Bent bent, Material material) {
    uvec4 words = draw_words(SEQUENCE, draw, group(path.depth, DECISION_LIGHT));
    LightSample light;
    if (!light_sampler_sample(tracer.it.lights, tracer.it.surfaces, LIGHTS, vertex.at.p, words, light)) {
        return vec3(0.0);
    }
    vec3 wo = frame_to_local(frame, path.wo), wi = frame_to_local(frame, light.wi);
    float pdf_direction;
    vec3 f = material_eval(material, tracer.it.transmittances, DIRECTIONS, wo, wi, pdf_direction);
#ifdef FULL
    if (has(EFFECT_RELIEFS)) f *= bent_factor(bent, light.wi, wi.z);
#endif
    if (f == vec3(0.0)) return vec3(0.0);
    if (light.delta || HEURISTIC == HEURISTIC_NONE) pdf_direction = 0.0;
    Endpoint from = endpoint_of(vertex.at);
    Ray shadow;
    if (light.direction_only) {
        shadow = leave(from, light.wi);
    } else {
        shadow = segment(from, light.to);
    }
    if (trace_occluded(tracer, shadow)) return vec3(0.0);
    float scale = heuristic_weight(HEURISTIC, light.pdf, pdf_direction) / light.pdf;
    return path.beta * f * light.emitted * scale;
}

// Draws the next direction and plays roulette; false: the path ends.
bool path_bounce(TracerAt tracer, Draw draw, inout Path path, Vertex vertex, Frame frame, Bent bent, Material material) {
    uvec4 words = draw_words(SEQUENCE, draw, group(path.depth, DECISION_DIRECTION));
    vec3 wo = frame_to_local(frame, path.wo);
    Scattered s;
    if (!material_sample(material, tracer.it.transmittances, DIRECTIONS, wo, words, s)) return false;
    vec3 direction = frame_to_world(frame, s.wi);
#ifdef FULL
    if (has(EFFECT_RELIEFS)) s.value *= bent_factor(bent, direction, s.wi.z);
#endif
    path.beta *= s.value / s.pdf;
    if (path.beta == vec3(0.0)) return false;
    path.wo = -direction;
    path.pdf = s.pdf;
    path.delta = has(EFFECT_DELTA) && s.delta;
    if (has(EFFECT_REFRACTION)) path.eta2 *= s.eta * s.eta;
    path.p = vertex.at.p;
    path.ray = leave(endpoint_of(vertex.at), direction);
    if (path.depth >= ROULETTE_DEPTH) {
        // Radiance is smaller where light is slower, but carries no less.
        float largest = max_element3(path.beta);
        if (has(EFFECT_REFRACTION)) largest *= path.eta2;
        float survival = largest < LARGEST_SURVIVAL ? largest : LARGEST_SURVIVAL;
        if (unit_f32(words.w) >= survival) return false;
        path.beta /= survival;
    }
    return true;
}

// The next edge: what it meets, the light that is scattered there, and where it goes on. False: the path ends.
bool path_advance(TracerAt tracer, Draw draw, inout Path path) {
    Hit hit;
    if (!trace_closest(tracer, path.ray, hit)) {
        if (has(EFFECT_ENVIRONMENT)) path.radiance += path_escape(tracer, path);
        return false;
    }
    Vertex vertex = path_vertex(tracer, path.ray, hit);
    if (has(EFFECT_EMITTING_SURFACES) && vertex.light != NONE) path.radiance += path_emission(tracer, path, vertex);
    if (path.depth >= MAX_DEPTH) return false;
    float cos = dot3(vertex.at.ns, path.wo);
    Frame frame;
    Bent bent;
    Material material = path_shade(tracer, draw, path, vertex, hit, cos, frame, bent);
    if (cos == 0.0 || material.kind == MATERIAL_BLACK) return false;
    if (has(EFFECT_SAMPLED_LIGHTS)) path.radiance += path_light(tracer, draw, path, vertex, frame, bent, material);
    if (!path_bounce(tracer, draw, path, vertex, frame, bent, material)) return false;
    path.depth += 1u;
    return true;
}
#endif
