// Tracing by the driver's ray queries. What is hit is the driver's business; what rays may not hit and where is ours.
#ifndef ACCEL_RAY_QUERY
#define ACCEL_RAY_QUERY

#extension GL_EXT_ray_query : require

#include "accel/quadric.glsl"
#include "accel/ray.glsl"
#include "transport/specialise.glsl"
#include "transport/tracer.glsl"

bool trace(TracerAt tracer, Ray ray, uint flags, out Hit hit) {
    Slabs slabs = slabs_new(ray, tracer.it.quadric_tree.lo, tracer.it.quadric_tree.hi);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, accelerationStructureEXT(tracer.it.top_level), flags, 0xFFu, ray.origin, 0.0, ray.direction,
        ray.t_max);
    while (rayQueryProceedEXT(query)) {
        uint primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
        if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionTriangleEXT) {
            if (primitive != ray.from && primitive != ray.to) rayQueryConfirmIntersectionEXT(query);
        } else if (has(EFFECT_QUADRICS)) {
            Ray rest = ray;
            if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT) {
                rest.t_max = rayQueryGetIntersectionTEXT(query, true);
            }
            float t;
            if (quadric_intersect(tracer.it.quadrics.at[primitive], rest, slabs, t)) rayQueryGenerateIntersectionEXT(query, t);
        }
    }
    uint type = rayQueryGetIntersectionTypeEXT(query, true);
    hit = Hit(ray.t_max, NONE, 0.0, 0.0);
    if (type == gl_RayQueryCommittedIntersectionNoneEXT) return false;
    hit.t = rayQueryGetIntersectionTEXT(query, true);
    hit.primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
    if (type == gl_RayQueryCommittedIntersectionTriangleEXT) {
        vec2 uv = rayQueryGetIntersectionBarycentricsEXT(query, true);
        hit.u = uv.x;
        hit.v = uv.y;
    } else {
        hit.primitive = tracer.it.quadrics.at[hit.primitive].primitive;
    }
    return true;
}

bool trace_closest(TracerAt tracer, Ray ray, out Hit hit) {
    return trace(tracer, ray, gl_RayFlagsNoneEXT, hit);
}

bool trace_occluded(TracerAt tracer, Ray ray) {
    Hit hit;
    return trace(tracer, ray, gl_RayFlagsTerminateOnFirstHitEXT, hit);
}
#endif
