// A strategy made ready for one scene: src/estimator/vulkan/upload.rs fills it.
#ifndef TRANSPORT_TRACER
#define TRANSPORT_TRACER

#include "accel/parameterization.glsl"
#include "accel/tree.glsl"
#include "scene/material/material.glsl"
#include "scene/scene.glsl"
#include "scene/texture.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Materials { Material at[]; };

struct Tracer {
    Camera camera;
    Film film;
    Floats quantiles;
    Tree triangle_tree;
    Tree quadric_tree;
    LeafTriangles triangles;
    Quadrics quadrics;
    Surfaces surfaces;
    UVec3s vertices;
    Vec3s normals;
    Shapes shapes;
    Materials materials;
    Floats transmittances;
    Vec2s uvs;
    QuadricMaps quadric_maps;
    Textures textures;
    Vec3s texels;
    Vec3s attributes;
    // Radiance of each light with an extent.
    Vec3s radiances;
    uint64_t top_level;
    LightSampler lights;
    vec3 environment;
    uint triangle_count;
};

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer TracerAt { Tracer it; };
#endif
