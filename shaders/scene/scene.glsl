// The scene in device memory: twins of src/scene/ and of the tables that src/estimator/vulkan/ uploads.
#ifndef SCENE_SCENE
#define SCENE_SCENE

#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_explicit_arithmetic_types_float64 : require

// Stands for no primitive, no light.
const uint NONE = 0xFFFFFFFFu;

// A triangle as shading needs it (accel/surface).
struct Surface {
    vec3 p0;
    // From vertex 0 to vertices 1 and 2.
    vec3 e1;
    vec3 e2;
    vec3 ng;
    uint shape;
    uint front;
    uint back;
    // SURFACE_SMOOTH, SURFACE_LIGHT, SURFACE_UVS.
    uint flags;
};
const uint SURFACE_SMOOTH = 1u;
const uint SURFACE_LIGHT = 2u;
const uint SURFACE_UVS = 4u;

// What a shape looks like; its emission is on the front side.
struct Shape {
    uint front;
    uint back;
    // Index of its light, or NONE.
    uint light;
    // Index of its quadric, or NONE.
    uint quadric;
};

// Kinds of LightEntry.
const uint LIGHT_ENVIRONMENT = 0u;
const uint LIGHT_POINT = 1u;
const uint LIGHT_PARALLELOGRAM = 2u;
const uint LIGHT_MESH = 3u;
const uint LIGHT_SPHERE = 4u;
const uint LIGHT_DISK = 5u;
const uint LIGHT_CYLINDER = 6u;
const uint LIGHT_SPOT = 7u;
const uint LIGHT_DIRECTIONAL = 8u;
const uint LIGHT_ENVIRONMENT_MAP = 9u;

// One outcome of the choice among lights (light/choice, light/area): fields that a kind has no use for are 0.
struct LightEntry {
    vec3 radiance;
    uint kind;
    // Corner of a parallelogram; centre of a sphere or disk; p0 of a cylinder; position of a point or spot light.
    vec3 a;
    // Over area, except for meshes and lights that are no shape; angle up to which a spot light shines in full.
    float density;
    // Edge u of a parallelogram; u of a disk; axis of a cylinder.
    vec3 u;
    // Parallelograms and meshes: the scene's index of the first triangle.
    uint start;
    // Edge v of a parallelogram; v of a disk; frame s of a cylinder.
    vec3 v;
    // Of a sphere or cylinder; angle beyond which a spot light is dark.
    float radius;
    // ng of a parallelogram or disk; frame t of a cylinder; axis of a spot light; from where a directional light comes.
    vec3 w;
    // 1: normals point inwards.
    uint flip;
    // u × v of a parallelogram; its length is the area.
    vec3 n;
    // 1: the sides of a parallelogram are orthogonal to rounding.
    uint rectangular;
    // Meshes: where the tables of its triangles start (see Scene), how many triangles have an area, how many there are.
    uint first_drawn;
    uint drawn;
    uint first_density;
    uint triangles;
};

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Surfaces { Surface at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Shapes { Shape at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LightEntries { LightEntry at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Words { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer UVec3s { uvec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Vec3s { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Vec2s { vec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Floats { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer UVec4s { uvec4 at[]; };

// A map of radiance around the scene (light/environment_map).
struct EnvironmentMap {
    // Images of the local axes.
    vec3 x_axis;
    vec3 y_axis;
    vec3 z_axis;
    // Columns of texels, and rows of cells: one less than those of texels.
    uint width;
    uint band_count;
    uint pad;
    Vec3s texels;
    // Of each row of cells: height of its upper edge, from there to the lower edge, and density.
    Vec3s bands;
    // Discrete: smallest word of each band, and of each cell of each band.
    Words rows;
    Words columns;
};

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer EnvironmentMapAt { EnvironmentMap it; };

const uint PROJECTION_PINHOLE = 0u;
const uint PROJECTION_THIN_LENS = 1u;
const uint PROJECTION_ORTHOGRAPHIC = 2u;

struct Camera {
    vec3 origin;
    float near;
    vec3 corner;
    float far;
    vec3 across;
    vec3 down;
    // PROJECTION_PINHOLE …
    uint projection;
    // Radii of a lens; the first is the direction of an orthographic camera.
    vec3 u;
    vec3 v;
    // One over the distance of what a lens shows sharply.
    float inverse_focus;
};

struct Film {
    uvec2 size;
    uvec2 crop_offset;
    uvec2 crop_size;
    // FILTER_BOX, FILTER_TENT, FILTER_GAUSSIAN.
    uint filter_kind;
    // Radius of the tent, standard deviation of the Gaussian, pixels.
    float filter_width;
};

const uint FILTER_BOX = 0u;
const uint FILTER_TENT = 1u;
const uint FILTER_GAUSSIAN = 2u;

// The lights as one strategy draws them: light/choice.
struct LightSampler {
    LightEntries entries;
    // Discrete: smallest word of each entry, ascending; entry_count of them.
    Words choice;
    // Entry of each shape, or NONE.
    Words of_shape;
    // Meshes, from first_drawn: the scene's index of each triangle that has an area, and the thresholds of their choice.
    Words drawn_triangles;
    Words drawn_first;
    // Meshes, from first_density, for each triangle of the mesh: its probability, and that over its area.
    Vec2s densities;
    uint entry_count;
    // Density of any direction to a constant environment; probability of the choice of an environment map.
    float environment_pdf;
    // Null without one.
    EnvironmentMapAt environment_map;
};
#endif
