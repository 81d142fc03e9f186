// Twin of src/scene/filter.rs, without density and inverse.
#ifndef SCENE_FILTER
#define SCENE_FILTER

#include "math/warp.glsl"
#include "scene/scene.glsl"

// Offset from the pixel centre, in pixels.
vec2 filter_sample(Film film, vec2 u, Floats quantiles) {
    if (film.filter_kind == FILTER_BOX) return vec2(u.x - 0.5, u.y - 0.5);
    if (film.filter_kind == FILTER_TENT) return film.filter_width * vec2(sample_tent(u.x), sample_tent(u.y));
    return film.filter_width * vec2(sample_gaussian(u.x, quantiles), sample_gaussian(u.y, quantiles));
}
#endif
