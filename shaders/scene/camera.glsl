// Twin of PathTracer::camera_ray in src/transport/path.rs.
#ifndef SCENE_CAMERA
#define SCENE_CAMERA

#include "scene/filter.glsl"
#include "scene/scene.glsl"

void camera_ray(
    Camera camera, Film film, Floats quantiles, uint pixel, vec2 u, out vec3 origin, out vec3 direction, out float t_max
) {
    uint width = film.crop_size.x;
    vec2 offset = filter_sample(film, u, quantiles);
    float x = float(film.crop_offset.x + pixel % width) + 0.5 + offset.x;
    float y = float(film.crop_offset.y + pixel / width) + 0.5 + offset.y;
    float s = x / float(film.size.x), t = y / float(film.size.y);
    direction = camera.corner + camera.across * s + camera.down * t;
    origin = camera.origin + direction * camera.near;
    t_max = camera.far - camera.near;
}
#endif
