// Twin of src/scene/material/relief.rs.
#ifndef SCENE_MATERIAL_RELIEF
#define SCENE_MATERIAL_RELIEF

#include "accel/parameterization.glsl"
#include "math/frame.glsl"
#include "scene/material/material.glsl"

const uint RELIEF_MAP = 3u;
const uint RELIEF_BUMP = 1u;
const uint RELIEF_INWARD = 4u;
const uint RELIEF_FLIPS = 8u;
const uint RELIEF_SHADOWS = 16u;

struct Bent {
    vec3 normal;
    // Negative where nothing is bent.
    float alpha2;
};

// `gradient`: of the material's bump map; a normal map's colour is in material.relief.
bool relief_bend(Material material, vec2 gradient, Parameterization surface, SurfacePoint at, Frame frame, vec3 wo, out vec3 n, out Bent bent) {
    bent = Bent(frame.n, -1.0);
    vec3 t = cross3(at.ns, frame.s);
    vec3 local = material.relief * 2.0 - 1.0;
    if ((material.relief_mode & RELIEF_MAP) == RELIEF_BUMP) {
        vec2 g = gradient * material.relief.x;
        vec2 du = vec2(dot3(frame.s, surface.dp_du), dot3(t, surface.dp_du));
        vec2 dv = vec2(dot3(frame.s, surface.dp_dv), dot3(t, surface.dp_dv));
        local = vec3(du.y * g.y - g.x * dv.y, g.x * dv.x - du.x * g.y, du.x * dv.y - du.y * dv.x);
        float outward = dot3(frame.s * local.x + t * local.y + at.ns * local.z, at.ng);
        if (outward < 0.0) local = -local;
    }
    if (local.x == 0.0 && local.y == 0.0 && local.z >= 0.0) return false;
    if ((material.relief_mode & RELIEF_INWARD) != 0u) local = vec3(-local.x, -local.y, local.z);
    vec3 tilt = frame.s * local.x + t * local.y, up = frame.n * local.z;
    bool faces_away = dot3(wo, tilt + up) <= 0.0;
    if (!try_normalize3((material.relief_mode & RELIEF_FLIPS) != 0u && faces_away ? up - tilt : tilt + up, n)) return false;
    float cos2 = dot3(n, frame.n) * dot3(n, frame.n);
    bent.alpha2 = 0.0;
    if ((material.relief_mode & RELIEF_SHADOWS) != 0u) {
        float sin2 = 1.0 - cos2;
        float alpha2 = 0.125 * ((sin2 > 0.0 ? sin2 : 0.0) / cos2);
        bent.alpha2 = alpha2 < 1.0 ? alpha2 : 1.0;
    }
    return true;
}

float bent_factor(Bent bent, vec3 wi, float cos) {
    if (bent.alpha2 < 0.0) return 1.0;
    float unbent = dot3(bent.normal, wi);
    if (!((cos > 0.0 && unbent > 0.0) || (cos < 0.0 && unbent < 0.0))) return 0.0;
    if (bent.alpha2 == 0.0) return 1.0;
    float cos2 = unbent * unbent;
    float c = sqrt(cos2), sin2 = 1.0 - cos2;
    return 2.0 * c / (c + sqrt(cos2 + bent.alpha2 * (sin2 > 0.0 ? sin2 : 0.0)));
}
#endif
