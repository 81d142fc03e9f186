// Twin of src/scene/camera.rs.
#ifndef SCENE_CAMERA
#define SCENE_CAMERA

#include "math/warp.glsl"
#include "scene/filter.glsl"
#include "scene/scene.glsl"

// Film coordinates of a point of a pixel of the rendered part.
vec2 film_sample(Film film, Floats quantiles, uint pixel, vec2 u) {
    uint width = film.crop_size.x;
    vec2 offset = filter_sample(film, u, quantiles);
    float x = float(film.crop_offset.x + pixel % width) + 0.5 + offset.x;
    float y = float(film.crop_offset.y + pixel / width) + 0.5 + offset.y;
    return vec2(x / float(film.size.x), y / float(film.size.y));
}

// What the camera sees along a film vector: the pinhole's ray.
void camera_ray(Camera camera, vec2 st, out vec3 origin, out vec3 direction, out float t_max) {
    direction = camera.corner + camera.across * st.x + camera.down * st.y;
    origin = camera.origin + direction * camera.near;
    t_max = camera.far - camera.near;
}

#ifdef FULL
// Turns the pinhole's ray into that through a point of the lens.
void thin_lens_ray(Camera camera, vec2 lens, inout vec3 origin, inout vec3 direction) {
    vec2 at = sample_uniform_disk(lens);
    vec3 offset = camera.u * at.x + camera.v * at.y;
    direction = direction - offset * camera.inverse_focus;
    origin = camera.origin + offset + direction * camera.near;
}

void orthographic_ray(Camera camera, inout vec3 origin, inout vec3 direction) {
    origin = camera.origin + direction + camera.u * camera.near;
    direction = camera.u;
}
#endif
#endif
