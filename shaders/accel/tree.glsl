// Twin of src/accel/tree.rs and compact.rs: the walk of one ray.
#ifndef ACCEL_TREE
#define ACCEL_TREE

#include "accel/quadric.glsl"
#include "accel/ray.glsl"
#include "accel/slab.glsl"
#include "accel/triangle.glsl"

// Eight boxes, quantised to a grid of 256 steps per axis, and where they lead.
struct CompactNode {
    vec3 origin;
    // Bytes: exponents of the steps along x, y, z, bits of the slots in use.
    uint exponents;
    // Bit 31: a leaf (first primitive · 8 + number of primitives − 1), else an inner node.
    uint children[8];
    // Per axis: lower planes of slots 0–3, 4–7, upper planes of slots 0–3, 4–7.
    uvec4 planes[3];
};

// A triangle in the order of the leaves.
struct LeafTriangle {
    vec3 v0;
    uint primitive;
    vec3 v1;
    uint pad1;
    vec3 v2;
    uint pad2;
};

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Nodes { CompactNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LeafTriangles { LeafTriangle at[]; };

struct Tree {
    Nodes nodes;
    vec3 lo;
    vec3 hi;
    // Where the walk starts, as in CompactNode.children; NONE: the tree is empty.
    uint root;
    uint pad;
};

const uint TREE_LEAF = 0x80000000u;

// Bit of every slot whose box the ray may meet at or before `limit`; bit k stands for slot k ^ octant, so that the lowest bits
// are those of the boxes that the ray meets first, roughly.
uint tree_boxes(Tree tree, uint node, Slabs slabs, uint octant, float limit) {
    vec3 origin = tree.nodes.at[node].origin;
    uint exponents = tree.nodes.at[node].exponents;
    uvec4 planes[3] = tree.nodes.at[node].planes;
    vec3 grid = vec3(uintBitsToFloat((exponents & 0xFFu) << 23), uintBitsToFloat((exponents >> 8 & 0xFFu) << 23),
        uintBitsToFloat((exponents >> 16 & 0xFFu) << 23));
    uint used = exponents >> 24;
    uint hits = 0u;
    for (uint k = 0u; k < 8u; ++k) {
        uint slot = k ^ octant;
        uint shift = (slot & 3u) * 8u;
        bool high = slot >= 4u;
        vec3 lower = vec3((high ? planes[0].y : planes[0].x) >> shift & 0xFFu, (high ? planes[1].y : planes[1].x) >> shift & 0xFFu,
            (high ? planes[2].y : planes[2].x) >> shift & 0xFFu);
        vec3 upper = vec3((high ? planes[0].w : planes[0].z) >> shift & 0xFFu, (high ? planes[1].w : planes[1].z) >> shift & 0xFFu,
            (high ? planes[2].w : planes[2].z) >> shift & 0xFFu);
        float near, far;
        slabs_clip(slabs, origin + lower * grid, origin + upper * grid, limit, near, far);
        hits |= near <= far && (used >> slot & 1u) != 0u ? 1u << k : 0u;
    }
    return hits;
}

// The deepest stack that a tree of the scene needs; the host knows.
layout(constant_id = 10) const uint STACK = 32;

struct Group {
    uint node;
    // Slots still to be visited, as tree_boxes gives them.
    uint slots;
};

// State of a walk: groups of siblings.
struct Walk {
    Group stack[STACK];
    uint top;
    Group now;
    // Where it goes on: an inner node, a leaf, or NONE: a sibling.
    uint next;
    uint octant;
};

// An empty tree's walk ends at once.
void walk_start(out Walk walk, Tree tree, Slabs slabs) {
    walk.top = 0u;
    walk.now = Group(0u, 0u);
    walk.next = tree.root;
    walk.octant = slabs.negative.x | slabs.negative.y << 1 | slabs.negative.z << 2;
}

// The next leaf; NONE where there is no more.
uint walk_next(inout Walk walk, Tree tree, Slabs slabs, float limit) {
    while (true) {
        uint next = walk.next;
        walk.next = NONE;
        if (next == NONE) {
            if (walk.now.slots == 0u) {
                if (walk.top == 0u) return NONE;
                walk.top -= 1u;
                walk.now = walk.stack[walk.top];
            }
            uint k = uint(findLSB(walk.now.slots));
            walk.now.slots &= walk.now.slots - 1u;
            next = tree.nodes.at[walk.now.node].children[k ^ walk.octant];
        }
        if ((next & TREE_LEAF) != 0u) return next;
        if (walk.now.slots != 0u && walk.top < STACK) {
            walk.stack[walk.top] = walk.now;
            walk.top += 1u;
        }
        walk.now = Group(next, tree_boxes(tree, next, slabs, walk.octant, limit));
    }
}

void closest_triangle(Tree tree, LeafTriangles triangles, Ray ray, inout Hit best) {
    Slabs slabs = slabs_new(ray, tree.lo, tree.hi);
    Shear shear = shear_new(ray);
    Walk walk;
    walk_start(walk, tree, slabs);
    while (true) {
        uint leaf = walk_next(walk, tree, slabs, best.t);
        if (leaf == NONE) return;
        uint first = (leaf & ~TREE_LEAF) >> 3, count = (leaf & 7u) + 1u;
        for (uint i = first; i < first + count; ++i) {
            LeafTriangle triangle = triangles.at[i];
            float t;
            vec2 uv;
            if (triangle_closest(ray, shear, slabs, triangle.v0, triangle.v1, triangle.v2, triangle.primitive, best.t, t, uv)
                && (t < best.t || triangle.primitive < best.primitive)) {
                best = Hit(t, triangle.primitive, uv.x, uv.y);
            }
        }
    }
}

bool any_triangle(Tree tree, LeafTriangles triangles, Ray ray) {
    Slabs slabs = slabs_new(ray, tree.lo, tree.hi);
    Shear shear = shear_new(ray);
    float limit = next_down(ray.t_max);
    Walk walk;
    walk_start(walk, tree, slabs);
    while (true) {
        uint leaf = walk_next(walk, tree, slabs, limit);
        if (leaf == NONE) return false;
        uint first = (leaf & ~TREE_LEAF) >> 3, count = (leaf & 7u) + 1u;
        for (uint i = first; i < first + count; ++i) {
            LeafTriangle triangle = triangles.at[i];
            if (triangle_any(ray, shear, slabs, triangle.v0, triangle.v1, triangle.v2, triangle.primitive)) return true;
        }
    }
}

void closest_quadric(Tree tree, Quadrics quadrics, Ray ray, inout Hit best) {
    Slabs slabs = slabs_new(ray, tree.lo, tree.hi);
    Walk walk;
    walk_start(walk, tree, slabs);
    while (true) {
        uint leaf = walk_next(walk, tree, slabs, best.t);
        if (leaf == NONE) return;
        Quadric quadric = quadrics.at[(leaf & ~TREE_LEAF) >> 3];
        float t;
        if (quadric_intersect(quadric, ray, slabs, t)
            && (t < best.t || (t == best.t && quadric.primitive < best.primitive))) {
            best = Hit(t, quadric.primitive, 0.0, 0.0);
        }
    }
}

bool any_quadric(Tree tree, Quadrics quadrics, Ray ray) {
    Slabs slabs = slabs_new(ray, tree.lo, tree.hi);
    float limit = next_down(ray.t_max);
    Walk walk;
    walk_start(walk, tree, slabs);
    while (true) {
        uint leaf = walk_next(walk, tree, slabs, limit);
        if (leaf == NONE) return false;
        float t;
        if (quadric_intersect(quadrics.at[(leaf & ~TREE_LEAF) >> 3], ray, slabs, t)) return true;
    }
}
#endif
