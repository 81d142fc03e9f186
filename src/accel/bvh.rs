//! The bounding volume hierarchy: one eight-wide tree over the triangles, one over the quadrics, each only where the
//! scene has such shapes.

use super::primitives::{Best, BoundedQuadric, Primitives};
use super::simd::{Portable, Simd};
use super::slab::Slabs;
use super::tree::Tree;
use super::triangle::{Packet, TriangleRay, bounds};
use super::{Hit, Intersect, Ray};
use crate::Result;
use crate::scene::Scene;

/// The fast intersector. Gives the same bits as [`super::brute::Brute`], with AVX2 or without.
pub struct Bvh {
    /// The tree's leaves are packets.
    triangles: Option<(Tree, Vec<Packet>)>,
    /// The tree's leaves are indices of quadrics.
    quadrics: Option<(Tree, Vec<BoundedQuadric>)>,
    #[cfg(target_arch = "x86_64")]
    avx2: Option<super::simd::Avx2>,
}

impl Bvh {
    /// Builds the trees; owns a copy of the geometry.
    ///
    /// # Errors
    /// A vertex index out of range, a coordinate that is not finite or beyond 1e12, more than 2³¹ primitives.
    pub fn new(scene: &Scene) -> Result<Self> {
        let primitives = Primitives::new(scene)?;
        let boxes: Vec<_> = primitives.triangles.iter().map(bounds).collect();
        let mut packets = Vec::new();
        let triangles = Tree::new(&boxes, 8, |leaf| {
            packets.push(primitives.packet(leaf.iter().copied()));
            packets.len() as u32 - 1
        });
        let boxes: Vec<_> = primitives.quadrics.iter().map(|q| q.bounds).collect();
        let quadrics = Tree::new(&boxes, 1, |leaf| leaf[0]);
        Ok(Self {
            triangles: triangles.map(|tree| (tree, packets)),
            quadrics: quadrics.map(|tree| (tree, primitives.quadrics)),
            #[cfg(target_arch = "x86_64")]
            avx2: super::simd::Avx2::detect(),
        })
    }

    /// [`Intersect::closest`] with a chosen instruction set, to be inlined into a caller compiled for it.
    #[inline(always)]
    pub fn closest_with<S: Simd>(&self, s: S, ray: &Ray) -> Option<Hit> {
        let mut best = Best::new(ray);
        if let Some((tree, packets)) = &self.triangles {
            let shear = TriangleRay::new(s, ray);
            tree.walk(s, best.hit.t, &Slabs::new(ray, &tree.bounds), |slabs, leaf, _| {
                best.packet(s, &packets[leaf as usize], &shear, slabs);
                best.hit.t
            });
        }
        if let Some((tree, quadrics)) = &self.quadrics {
            let slabs = Slabs::new(ray, &tree.bounds);
            tree.walk(s, best.hit.t, &slabs, |_, leaf, _| {
                best.quadric(ray, &slabs, &quadrics[leaf as usize]);
                best.hit.t
            });
        }
        best.hit()
    }

    /// [`Intersect::occluded`] with a chosen instruction set, to be inlined into a caller compiled for it.
    #[inline(always)]
    pub fn occluded_with<S: Simd>(&self, s: S, ray: &Ray) -> bool {
        const STOP: f32 = -1.0;
        let mut found = false;
        let end = ray.t_max.next_down();
        if let Some((tree, packets)) = &self.triangles {
            let shear = TriangleRay::new(s, ray);
            tree.walk(s, end, &Slabs::new(ray, &tree.bounds), |slabs, leaf, end| {
                found |= packets[leaf as usize].intersect(s, &shear, slabs, end).lanes != 0;
                if found { STOP } else { end }
            });
        }
        if let (false, Some((tree, quadrics))) = (found, &self.quadrics) {
            let slabs = Slabs::new(ray, &tree.bounds);
            tree.walk(s, end, &slabs, |_, leaf, end| {
                let quadric = &quadrics[leaf as usize];
                found |= quadric.surface.intersect(ray, &slabs, &quadric.bounds).is_some();
                if found { STOP } else { end }
            });
        }
        found
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn closest_avx2(&self, s: super::simd::Avx2, ray: &Ray) -> Option<Hit> {
        self.closest_with(s, ray)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn occluded_avx2(&self, s: super::simd::Avx2, ray: &Ray) -> bool {
        self.occluded_with(s, ray)
    }
}

impl Intersect for Bvh {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = self.avx2 {
            // SAFETY: AVX2 was detected.
            return unsafe { self.closest_avx2(avx2, ray) };
        }
        self.closest_with(Portable, ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = self.avx2 {
            // SAFETY: AVX2 was detected.
            return unsafe { self.occluded_avx2(avx2, ray) };
        }
        self.occluded_with(Portable, ray)
    }
}
