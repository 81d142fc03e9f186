// Twin of src/scene/light/area.rs. The including entry declares `LIGHT_KINDS`, bits of the kinds that the scene has.
#ifndef SCENE_LIGHT_AREA
#define SCENE_LIGHT_AREA

#include "accel/surface.glsl"
#include "math/frame.glsl"
#include "math/robust.glsl"
#include "math/spherical.glsl"
#include "math/trig.glsl"
#include "math/vector.glsl"
#include "math/warp.glsl"
#include "sampling/discrete.glsl"
#include "sampling/rng.glsl"
#include "scene/scene.glsl"

bool light_kind(LightEntry entry, uint kind) {
    return ((LIGHT_KINDS >> kind) & 1u) != 0u && entry.kind == kind;
}

// A density over area as one over solid angle; false at the back and at the edge.
bool light_seen(float density, vec3 to, vec3 wi, vec3 ng, out float pdf) {
    float cosine = -dot3(wi, ng);
    pdf = 0.0;
    if (!(cosine > 0.0)) return false;
    pdf = density * length_squared3(to) / cosine;
    return true;
}

Endpoint light_planar(vec3 corner, vec3 s, vec3 t, vec3 ng, uint triangle) {
    return Endpoint(corner + s + t, 5.0 * UNIT_ROUNDOFF * (abs(corner) + abs(s) + abs(t)), ng, triangle);
}

Endpoint patch_at(LightEntry entry, vec2 st) {
    return light_planar(entry.a, st.x * entry.u, st.y * entry.v, entry.w, entry.start + (st.x < st.y ? 1u : 0u));
}

// Saturates, as Rust's cast does; NaN is 0.
uint light_word(float x) {
    if (x >= 4294967296.0) return 0xFFFFFFFFu;
    return x > 0.0 ? uint(x) : 0u;
}

bool parallelogram_seen(LightEntry entry, vec3 p, out float solid_angle) {
    solid_angle = parallelogram_solid_angle(entry.a - p, entry.u, entry.v, entry.n);
    return solid_angle > 0.0;
}

bool parallelogram_sample_halves(LightEntry entry, vec3 a, vec3 d, vec2 u, uint part, out vec2 st) {
    st = vec2(0.0);
    SphericalTriangle first, second;
    if (!spherical_triangle_new(a, entry.u, d, entry.n, first)) return false;
    if (!spherical_triangle_new(a, d, entry.v, entry.n, second)) return false;
    float share = first.solid_angle / (first.solid_angle + second.solid_angle);
    if (part < light_word(share * 4294967296.0)) {
        vec2 bc = spherical_triangle_sample(first, u);
        st = vec2(bc.x + bc.y, bc.y);
    } else {
        vec2 bc = spherical_triangle_sample(second, u);
        st = vec2(bc.x, bc.x + bc.y);
    }
    return true;
}

bool parallelogram_sample_solid_angle(LightEntry entry, vec3 p, vec2 u, uint part, out Endpoint at, out float pdf) {
    at = endpoint_free(vec3(0.0));
    pdf = 0.0;
    float total;
    if (!parallelogram_seen(entry, p, total)) return false;
    vec3 a = entry.a - p, d = entry.u + entry.v;
    vec2 st;
    SphericalRectangle rectangle;
    bool drawn = false;
    if (entry.rectangular != 0u) {
        float lu = length3(entry.u), lv = length3(entry.v);
        if (spherical_rectangle_new(a, entry.u / lu, lu, entry.v / lv, lv, entry.w, total, rectangle)) {
            st = spherical_rectangle_sample(rectangle, u);
            drawn = true;
        }
    }
    if (!drawn && !parallelogram_sample_halves(entry, a, d, u, part, st)) return false;
    at = patch_at(entry, st);
    pdf = 1.0 / total;
    return true;
}

// Probability of a triangle of the mesh, and that over its area; false: another's triangle.
bool mesh_densities(LightEntry entry, LightSampler lights, uint triangle, out vec2 densities) {
    uint i = triangle - entry.start;
    densities = vec2(0.0);
    if (i >= entry.triangles) return false;
    densities = lights.densities.at[entry.first_density + i];
    return true;
}

float mesh_density(LightEntry entry, LightSampler lights, uint triangle) {
    vec2 densities;
    mesh_densities(entry, lights, triangle, densities);
    return densities.y;
}

void mesh_sample_area(LightEntry entry, LightSampler lights, Surfaces surfaces, vec2 u, uint part, out Endpoint at,
    out float density) {
    uint i = discrete_pick(lights.drawn_first, entry.first_drawn, entry.drawn, part);
    uint triangle = lights.drawn_triangles.at[entry.first_drawn + i];
    vec3 a = surfaces.at[triangle].p0, eb = surfaces.at[triangle].e1, ec = surfaces.at[triangle].e2;
    vec2 bc = sample_uniform_triangle(u);
    at = light_planar(a, bc.x * eb, bc.y * ec, normalize3(cross3(eb, ec)), triangle);
    density = mesh_density(entry, lights, triangle);
}

bool mesh_sample_solid_angle(LightEntry entry, LightSampler lights, Surfaces surfaces, vec3 p, vec2 u, uint part,
    out Endpoint at, out float pdf) {
    at = endpoint_free(vec3(0.0));
    pdf = 0.0;
    uint i = discrete_pick(lights.drawn_first, entry.first_drawn, entry.drawn, part);
    uint triangle = lights.drawn_triangles.at[entry.first_drawn + i];
    vec3 a = surfaces.at[triangle].p0, eb = surfaces.at[triangle].e1, ec = surfaces.at[triangle].e2;
    vec3 normal = cross3(eb, ec);
    SphericalTriangle t;
    if (!spherical_triangle_new(a - p, eb, ec, normal, t)) return false;
    vec2 bc = spherical_triangle_sample(t, u);
    pdf = 1.0 / t.solid_angle * discrete_pmf(lights.drawn_first, entry.first_drawn, entry.drawn, i);
    at = light_planar(a, bc.x * eb, bc.y * ec, normalize3(normal), triangle);
    return true;
}

bool mesh_solid_angle_pdf(LightEntry entry, LightSampler lights, Surfaces surfaces, vec3 p, uint triangle, out float pdf) {
    pdf = 0.0;
    vec2 densities;
    if (!mesh_densities(entry, lights, triangle, densities)) return false;
    vec3 a = surfaces.at[triangle].p0, eb = surfaces.at[triangle].e1, ec = surfaces.at[triangle].e2;
    float solid_angle = triangle_solid_angle(a - p, eb, ec, cross3(eb, ec));
    if (!(solid_angle > 0.0)) return false;
    pdf = 1.0 / solid_angle * densities.x;
    return true;
}

float sphere_density(float radius) {
    return 1.0 / (2.0 * TAU * radius * radius);
}

Endpoint on_sphere(vec3 center, float radius, vec3 n, bool flip) {
    vec3 p_error = 8.0 * UNIT_ROUNDOFF * (abs(center) + vec3(radius));
    return Endpoint(center + radius * n, p_error, flip ? -n : n, NONE);
}

// 1 − cos θmax; false from inside and on the sphere.
bool cone_height(float radius, float distance2, out float height) {
    height = 0.0;
    float radius2 = radius * radius;
    if (!(distance2 > radius2)) return false;
    float sin2 = radius2 / distance2;
    height = sin2 / (1.0 + sqrt(1.0 - sin2));
    return true;
}

bool cone_pdf(vec3 center, float radius, vec3 p, out float pdf) {
    float height;
    pdf = 0.0;
    if (!cone_height(radius, length_squared3(p - center), height)) return false;
    pdf = uniform_cone_pdf(height);
    return true;
}

bool sample_cone(vec3 center, float radius, vec3 p, vec2 u, out Endpoint at, out float pdf) {
    at = endpoint_free(vec3(0.0));
    pdf = 0.0;
    vec3 axis = p - center;
    float distance2 = length_squared3(axis);
    float height;
    if (!cone_height(radius, distance2, height)) return false;
    float distance1 = sqrt(distance2);
    float h = u.x * height;
    float sin2 = h * (2.0 - h), cosine = 1.0 - h;
    float chord2 = radius * radius - distance2 * sin2;
    float half_chord = sqrt(chord2 > 0.0 ? chord2 : 0.0);
    float t = (distance1 - radius) * (distance1 + radius) / (distance1 * cosine + half_chord);
    float sin_alpha = t * sqrt(sin2) / radius;
    sin_alpha = sin_alpha < 1.0 ? sin_alpha : 1.0;
    float cos_alpha = sqrt((1.0 - sin_alpha) * (1.0 + sin_alpha));
    float s, c;
    sin_cos_turns(u.y, s, c);
    vec3 n = frame_to_world(frame_new(axis / distance1), vec3(sin_alpha * c, sin_alpha * s, cos_alpha));
    at = on_sphere(center, radius, n, false);
    pdf = uniform_cone_pdf(height);
    return true;
}

Endpoint cylinder_at(LightEntry entry, vec2 u) {
    float s, c;
    sin_cos_turns(u.y, s, c);
    vec3 n = entry.v * c + entry.w * s;
    vec3 a = u.x * entry.u;
    vec3 p_error = 8.0 * UNIT_ROUNDOFF * (abs(entry.a) + abs(a) + vec3(entry.radius));
    return Endpoint(entry.a + a + entry.radius * n, p_error, entry.flip != 0u ? -n : n, NONE);
}

// A drawn point and its density: over solid angle where `over_solid_angle` says so, else over area.
bool emitter_draw(LightEntry entry, LightSampler lights, Surfaces surfaces, vec3 p, uvec4 words, bool solid, out Endpoint at,
    out float density, out bool over_solid_angle) {
    vec2 u = vec2(unit_f32(words.x), unit_f32(words.y));
    at = endpoint_free(vec3(0.0));
    density = entry.density;
    over_solid_angle = false;
    if (light_kind(entry, LIGHT_PARALLELOGRAM)) {
        over_solid_angle = solid;
        if (solid) return parallelogram_sample_solid_angle(entry, p, u, words.w, at, density);
        at = patch_at(entry, u);
        return true;
    }
    if (light_kind(entry, LIGHT_MESH)) {
        over_solid_angle = solid;
        if (solid) return mesh_sample_solid_angle(entry, lights, surfaces, p, u, words.w, at, density);
        mesh_sample_area(entry, lights, surfaces, u, words.w, at, density);
        return true;
    }
    if (light_kind(entry, LIGHT_SPHERE)) {
        over_solid_angle = solid && entry.flip == 0u;
        if (over_solid_angle) return sample_cone(entry.a, entry.radius, p, u, at, density);
        at = on_sphere(entry.a, entry.radius, sample_uniform_sphere(u), entry.flip != 0u);
        density = sphere_density(entry.radius);
        return true;
    }
    if (light_kind(entry, LIGHT_DISK)) {
        vec2 d = sample_uniform_disk(u);
        at = light_planar(entry.a, d.x * entry.u, d.y * entry.v, entry.w, NONE);
        return true;
    }
    if (light_kind(entry, LIGHT_CYLINDER)) {
        at = cylinder_at(entry, u);
        return true;
    }
    return false;
}

// Words 0, 1 place the point, word 3 picks the part; the density is that without the choice of the light.
bool emitter_sample(LightEntry entry, LightSampler lights, Surfaces surfaces, vec3 p, uvec4 words, bool solid,
    out Endpoint at, out vec3 wi, out float pdf) {
    bool over_solid_angle;
    float density;
    wi = vec3(0.0);
    pdf = 0.0;
    if (!emitter_draw(entry, lights, surfaces, p, words, solid, at, density, over_solid_angle)) return false;
    vec3 to = at.p - p;
    if (!try_normalize3(to, wi)) return false;
    pdf = density;
    return over_solid_angle || light_seen(density, to, wi, at.ng, pdf);
}

bool emitter_pdf(LightEntry entry, LightSampler lights, Surfaces surfaces, vec3 p, vec3 wi, SurfacePoint hit, uint primitive,
    bool solid, out float pdf) {
    pdf = 0.0;
    float density = entry.density;
    if (light_kind(entry, LIGHT_PARALLELOGRAM)) {
        if (solid) {
            float solid_angle;
            if (!parallelogram_seen(entry, p, solid_angle)) return false;
            pdf = 1.0 / solid_angle;
            return true;
        }
    } else if (light_kind(entry, LIGHT_MESH)) {
        if (solid) return mesh_solid_angle_pdf(entry, lights, surfaces, p, primitive, pdf);
        density = mesh_density(entry, lights, primitive);
    } else if (light_kind(entry, LIGHT_SPHERE)) {
        if (solid && entry.flip == 0u) return cone_pdf(entry.a, entry.radius, p, pdf);
        density = sphere_density(entry.radius);
    }
    return light_seen(density, hit.p - p, wi, hit.ng, pdf);
}
#endif
