//! The BVH as GPUs walk it: eight-wide nodes with boxes quantised to a grid of bytes, after Ylitie, Karras & Laine,
//! "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", 2017, §3; triangles in the order of the leaves.
//!
//! Quantised boxes contain the exact ones: rounding is checked with the arithmetic that the walk uses. Since an interval of a
//! box contains those of all boxes inside, no hit depends on the quantisation.

use super::primitives::Primitives;
use super::quadric::Quadric;
use super::slab::Bounds;
use super::surface::Surface;
use super::tree::{LEAF, Tree, Wide};
use super::triangle::bounds;
use crate::error::{Error, Place, Result};
use crate::math::Vec3;
use crate::scene::Scene;
use bytemuck::{Pod, Zeroable};

/// Most triangles in a leaf. One thread tests them one after the other.
const PER_LEAF: u32 = 4;

/// Cost of testing a triangle relative to an inner node's eight boxes.
const TRIANGLE_COST: f32 = 0.3;

/// A leaf's name has 28 bits for its first triangle.
const MOST_TRIANGLES: usize = 1 << 28;

/// Stands for an empty tree.
pub const EMPTY: u32 = u32::MAX;

/// An inner node.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct CompactNode {
    /// Lower corner of the grid.
    origin: [f32; 3],
    /// Biased exponents of the grid's steps along x, y, z, and the bits of the slots in use.
    exponents: [u8; 4],
    /// Bit 31: a leaf, 8 × its first primitive + their number − 1; else an inner node.
    children: [u32; 8],
    /// Per axis: lower planes, upper planes.
    planes: [[[u8; 8]; 2]; 3],
}

/// A tree: nodes, where the walk starts and how deep it goes.
#[derive(Clone, Debug)]
pub struct CompactTree {
    /// Inner nodes.
    pub nodes: Vec<CompactNode>,
    /// As in a node's children; [`EMPTY`] where there are no primitives.
    pub root: u32,
    /// Box around everything: lower and upper corner.
    pub bounds: [[f32; 3]; 2],
    /// Most inner nodes on a way from the root to a leaf.
    pub depth: u32,
}

/// A triangle as the walk tests it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct LeafTriangle {
    v0: [f32; 3],
    primitive: u32,
    v1: [f32; 3],
    pad1: u32,
    v2: [f32; 3],
    pad2: u32,
}

/// A quadric as the walk tests it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct CompactQuadric {
    /// See `shaders/accel/quadric.glsl`.
    data: [f64; 10],
    kind: u32,
    primitive: u32,
    lo: [f32; 3],
    hi: [f32; 3],
}

/// Everything that a GPU needs to intersect a scene.
#[derive(Clone, Debug)]
pub struct CompactBvh {
    /// Over the triangles.
    pub triangle_tree: CompactTree,
    /// Over the quadrics; leaves hold one.
    pub quadric_tree: CompactTree,
    /// In the order of the leaves.
    pub triangles: Vec<LeafTriangle>,
    /// In scene order.
    pub quadrics: Vec<CompactQuadric>,
    /// In scene order.
    pub surfaces: Vec<Surface>,
}

impl CompactBvh {
    /// Builds the trees.
    ///
    /// # Errors
    /// Those of [`super::bvh::Bvh::new`], and more than 2²⁸ triangles.
    pub fn new(scene: &Scene) -> Result<Self> {
        let primitives = Primitives::new(scene)?;
        if primitives.triangles.len() >= MOST_TRIANGLES {
            let found = primitives.triangles.len();
            let message = format!("{found} triangles; on a GPU {MOST_TRIANGLES} are allowed");
            return Err(Error::input(Place::file(&scene.name), message));
        }
        let boxes: Vec<_> = primitives.triangles.iter().map(bounds).collect();
        let mut triangles = Vec::with_capacity(boxes.len());
        let tree = Tree::new(
            &boxes,
            PER_LEAF,
            |n| TRIANGLE_COST * n as f32,
            |leaf| {
                let first = triangles.len() as u32;
                triangles.extend(leaf.iter().map(|&i| LeafTriangle::new(i, &primitives.triangles[i as usize])));
                first * 8 + leaf.len() as u32 - 1
            },
        );
        let boxes: Vec<_> = primitives.quadrics.iter().map(|q| q.bounds).collect();
        let quadric_tree = Tree::new(&boxes, 1, |_| 1.0, |leaf| leaf[0] * 8);
        let quadrics = primitives.quadrics.iter().map(|q| CompactQuadric::new(&q.surface, &q.bounds, q.primitive));
        Ok(Self {
            triangle_tree: CompactTree::new(tree.as_ref()),
            quadric_tree: CompactTree::new(quadric_tree.as_ref()),
            quadrics: quadrics.collect(),
            surfaces: (0..scene.triangles.len() as u32).map(|t| Surface::new(scene, t)).collect(),
            triangles,
        })
    }
}

impl LeafTriangle {
    fn new(primitive: u32, [v0, v1, v2]: &[Vec3; 3]) -> Self {
        Self { v0: (*v0).into(), primitive, v1: (*v1).into(), pad1: 0, v2: (*v2).into(), pad2: 0 }
    }
}

impl CompactQuadric {
    /// Lower and upper corner of its box.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        [self.lo, self.hi]
    }

    fn new(quadric: &Quadric, bounds: &Bounds, primitive: u32) -> Self {
        let mut data = [0.0; 10];
        let mut put = |first: usize, values: &[f64]| data[first..first + values.len()].copy_from_slice(values);
        let kind = match *quadric {
            Quadric::Sphere { center, radius, outside } => {
                put(0, &center.to_array());
                put(3, &[radius, outside]);
                0
            }
            Quadric::Disk { center, u, v } => {
                put(0, &center.to_array());
                put(3, &u.to_array());
                put(6, &v.to_array());
                1
            }
            Quadric::Cylinder { p0, axis, length, radius, outside } => {
                put(0, &p0.to_array());
                put(3, &axis.to_array());
                put(6, &[length, radius, outside]);
                2
            }
        };
        Self { data, kind, primitive, lo: bounds.lo.into(), hi: bounds.hi.into() }
    }
}

impl CompactTree {
    fn new(tree: Option<&Tree>) -> Self {
        let Some(tree) = tree else {
            return Self { nodes: Vec::new(), root: EMPTY, bounds: [[0.0; 3]; 2], depth: 0 };
        };
        let nodes: Vec<CompactNode> = tree.nodes().map(|n| CompactNode::new(&n)).collect();
        let mut depth = 0;
        let mut todo = vec![(tree.root(), 1)];
        while let Some((reference, level)) = todo.pop() {
            if reference & LEAF == 0 {
                depth = depth.max(level);
                let node = &nodes[reference as usize];
                let used = (0..8).filter(|slot| node.exponents[3] >> slot & 1 == 1);
                todo.extend(used.map(|slot| (node.children[slot], level + 1)));
            }
        }
        let bounds = [tree.bounds.lo.into(), tree.bounds.hi.into()];
        Self { nodes, root: tree.root(), bounds, depth }
    }
}

impl CompactNode {
    fn new(node: &Wide) -> Self {
        let all = node.iter().fold(Bounds::EMPTY, |all, (b, _)| all.union(*b));
        let slots = slots(node, &all);
        let mut compact = Self { origin: all.lo.into(), ..Self::zeroed() };
        for ((_, reference), &slot) in node.iter().zip(&slots) {
            compact.children[slot] = *reference;
            compact.exponents[3] |= 1 << slot;
        }
        for axis in 0..3 {
            let origin = all.lo[axis];
            // The finest grid of powers of two on which all planes fit into a byte.
            let mut exponent = exponent_of((all.hi[axis] - origin) / 255.0);
            let planes = loop {
                let step = f32::from_bits(u32::from(exponent) << 23);
                let mut planes = [[0; 8]; 2];
                let fits = node.iter().zip(&slots).all(|((b, _), &slot)| {
                    let lower = lower_plane(origin, step, b.lo[axis]);
                    let upper = upper_plane(origin, step, b.hi[axis]);
                    planes[0][slot] = lower;
                    planes[1][slot] = upper.unwrap_or(0);
                    upper.is_some()
                });
                if fits {
                    break planes;
                }
                exponent += 1;
            };
            compact.exponents[axis] = exponent;
            compact.planes[axis] = planes;
        }
        compact
    }
}

/// Biased exponent of the power of two at or below `step`, at least the smallest normal number's.
fn exponent_of(step: f32) -> u8 {
    ((step.to_bits() >> 23) as u8).max(1)
}

/// The largest plane at or below `plane`.
fn lower_plane(origin: f32, step: f32, plane: f32) -> u8 {
    let mut q = ((plane - origin) / step).floor().clamp(0.0, 255.0) as u8;
    while q > 0 && origin + f32::from(q) * step > plane {
        q -= 1;
    }
    q
}

/// The smallest plane at or above `plane`, if it fits.
fn upper_plane(origin: f32, step: f32, plane: f32) -> Option<u8> {
    let mut q = ((plane - origin) / step).ceil().clamp(0.0, 255.0) as u8;
    while origin + f32::from(q) * step < plane {
        q = q.checked_add(1)?;
    }
    Some(q)
}

/// A slot for each child such that a ray into the octant o (bit per axis: negative direction) meets the child of slot 0 ^ o first
/// and that of slot 7 ^ o last, as well as may be: greedily, the child farthest out gets its corner (Ylitie et al. 2017, §3.2).
fn slots(node: &Wide, all: &Bounds) -> Vec<usize> {
    let center = (all.lo + all.hi) * 0.5;
    let mut pairs = Vec::with_capacity(64);
    for (child, (b, _)) in node.iter().enumerate() {
        let from_center = (b.lo + b.hi) * 0.5 - center;
        for slot in 0..8usize {
            let sign = |axis: usize| if slot >> axis & 1 == 1 { 1.0 } else { -1.0 };
            let towards = from_center.dot(Vec3::new(sign(0), sign(1), sign(2)));
            pairs.push((towards, child, slot));
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut slots = vec![usize::MAX; node.len()];
    let mut taken = [false; 8];
    for (_, child, slot) in pairs {
        if slots[child] == usize::MAX && !taken[slot] {
            slots[child] = slot;
            taken[slot] = true;
        }
    }
    slots
}
