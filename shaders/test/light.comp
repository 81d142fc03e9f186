#version 460
// The functions of scene/light and scene/camera one by one, for comparison with the processor.
#extension GL_GOOGLE_include_directive : require

layout(constant_id = 1) const uint LIGHT_KINDS = 0xFFFFFFFFu;

#include "scene/camera.glsl"
#include "scene/light/choice.glsl"
#include "scene/scene.glsl"
#include "test/words.glsl"

const uint FUNCTION_LIGHT_SAMPLE = 0u;
const uint FUNCTION_LIGHT_PDF = 1u;
const uint FUNCTION_LIGHT_ESCAPE = 2u;
const uint FUNCTION_CAMERA_RAY = 3u;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Tables {
    LightSampler lights;
    Surfaces surfaces;
    uint64_t pad;
    EnvironmentMap map;
};
// Of the map in bytes.
const uint64_t MAP_OFFSET = 80ul;

vec3 in_vec3(uint k) {
    return uintBitsToFloat(uvec3(in_word(k), in_word(k + 1u), in_word(k + 2u)));
}

void out_vec3(uint k, vec3 v) {
    for (uint i = 0u; i < 3u; ++i) out_word(k + i, floatBitsToUint(v[i]));
}

void main() {
    if (!start()) return;
    LightSampler lights = Tables(test.tables).lights;
    lights.environment_map = EnvironmentMapAt(test.tables + MAP_OFFSET);
    Surfaces surfaces = Tables(test.tables).surfaces;
    if (FUNCTION == FUNCTION_LIGHT_SAMPLE) {
        LightSample s;
        uvec4 words = uvec4(in_word(3u), in_word(4u), in_word(5u), in_word(6u));
        if (light_sampler_sample(lights, surfaces, in_word(7u), in_vec3(0u), words, s)) {
            out_word(0u, 1u);
            out_word(1u, s.direction_only ? 1u : 0u);
            out_vec3(2u, s.to.p);
            out_vec3(5u, s.wi);
            out_vec3(8u, s.emitted);
            out_word(11u, floatBitsToUint(s.pdf));
            out_word(12u, s.delta ? 1u : 0u);
            // On the diagonal of a parallelogram rounding decides which half it is, but not for points by area.
            if (in_word(7u) == LIGHTS_AREA) out_word(13u, s.to.triangle);
            out_word(14u, floatBitsToUint(max_element3(s.to.p_error)));
            out_word(15u, floatBitsToUint(dot3(s.to.ng, s.wi)));
        }
    } else if (FUNCTION == FUNCTION_LIGHT_PDF) {
        vec3 ng = in_vec3(10u);
        uint primitive = in_word(14u);
        SurfacePoint hit = SurfacePoint(in_vec3(7u), vec3(0.0), ng, ng, in_word(13u), primitive);
        float pdf = light_sampler_pdf(lights, surfaces, in_word(6u), in_vec3(0u), in_vec3(3u), hit, primitive);
        out_word(0u, floatBitsToUint(pdf));
    } else if (FUNCTION == FUNCTION_LIGHT_ESCAPE) {
        float pdf;
        out_vec3(0u, light_sampler_escape(lights, true, in_vec3(3u), in_vec3(0u), pdf));
        out_word(3u, floatBitsToUint(pdf));
    } else if (FUNCTION == FUNCTION_CAMERA_RAY) {
        Camera camera;
        camera.projection = in_word(0u);
        camera.origin = in_vec3(1u);
        camera.corner = in_vec3(4u);
        camera.u = in_vec3(7u);
        camera.v = in_vec3(10u);
        camera.inverse_focus = uintBitsToFloat(in_word(13u));
        camera.near = uintBitsToFloat(in_word(14u));
        camera.far = 2.0 * camera.near;
        camera.across = vec3(0.0);
        camera.down = vec3(0.0);
        vec3 origin, direction;
        float t_max;
        camera_ray(camera, vec2(0.5), origin, direction, t_max);
        vec2 lens = uintBitsToFloat(uvec2(in_word(15u), in_word(16u)));
        if (camera.projection == PROJECTION_THIN_LENS) thin_lens_ray(camera, lens, origin, direction);
        if (camera.projection == PROJECTION_ORTHOGRAPHIC) orthographic_ray(camera, origin, direction);
        out_vec3(0u, origin);
        out_vec3(3u, direction);
        out_word(6u, floatBitsToUint(t_max));
    }
}
