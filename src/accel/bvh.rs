//! The bounding volume hierarchy: one eight-wide tree over the triangles, one over the quadrics, each only where the
//! scene has such shapes.

use super::few::Few;
use super::primitives::{Best, BoundedQuadric, Primitives};
use super::simd::{Portable, Registers, Simd};
use super::slab::{Slabs, WideSlabs};
use super::surface::{Surface, SurfaceLanes};
use super::tree::{Leaves, Tree};
use super::triangle::{Packet, TriangleRay, bounds};
use super::{Hit, Hits, Intersect, Ray, Rays};
use crate::Result;
use crate::math::lanes::set_bits;
use crate::scene::Scene;

/// The fast intersector. Gives the same bits as [`super::brute::Brute`], with AVX2 or without.
pub struct Bvh {
    /// The tree's leaves are packets.
    triangles: Option<(Tree, Vec<Packet>)>,
    /// The tree's leaves are indices of quadrics.
    quadrics: Option<(Tree, Vec<BoundedQuadric>)>,
    /// Only where the scene has few triangles.
    few: Option<Few>,
    /// Of each triangle, where there are not more than [`MOST_SURFACES`].
    surfaces: Vec<Surface>,
    #[cfg(target_arch = "x86_64")]
    avx2: Option<super::simd::Avx2>,
}

/// Two mebibytes: beyond this a table of surfaces is no longer in a core's cache when it is asked for, and only takes memory.
const MOST_SURFACES: usize = 1 << 15;

impl Bvh {
    /// Builds the trees; owns a copy of the geometry.
    ///
    /// # Errors
    /// A vertex index out of range, a coordinate that is not finite or beyond 1e15, more than 2³¹ primitives.
    pub fn new(scene: &Scene) -> Result<Self> {
        let primitives = Primitives::new(scene)?;
        let boxes: Vec<_> = primitives.triangles.iter().map(bounds).collect();
        let mut packets = Vec::new();
        // A leaf is one packet, however many triangles it holds.
        let triangles = Tree::new(
            &boxes,
            8,
            |_| 1.0,
            |leaf| {
                packets.push(primitives.packet(leaf.iter().copied()));
                packets.len() as u32 - 1
            },
        );
        let boxes: Vec<_> = primitives.quadrics.iter().map(|q| q.bounds).collect();
        let quadrics = Tree::new(&boxes, 1, |_| 1.0, |leaf| leaf[0]);
        let tabulated = if scene.triangles.len() <= MOST_SURFACES { scene.triangles.len() } else { 0 };
        Ok(Self {
            few: Few::new(&primitives.triangles),
            triangles: triangles.map(|tree| (tree, packets)),
            quadrics: quadrics.map(|tree| (tree, primitives.quadrics)),
            surfaces: (0..tabulated as u32).map(|t| Surface::new(scene, t)).collect(),
            #[cfg(target_arch = "x86_64")]
            avx2: super::simd::Avx2::detect(),
        })
    }

    /// Whether [`Self::new`] takes the scene.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn check(scene: &Scene) -> Result<()> {
        Primitives::new(scene).map(drop)
    }

    /// Bytes of its trees and of all that stands at their leaves and in tables beside them.
    pub fn bytes(&self) -> usize {
        let triangles = self.triangles.as_ref().map_or(0, |(tree, packets)| tree.bytes() + size_of_val(&packets[..]));
        let quadrics = self.quadrics.as_ref().map_or(0, |(tree, all)| tree.bytes() + size_of_val(&all[..]));
        triangles + quadrics + self.few.as_ref().map_or(0, Few::bytes) + size_of_val(&self.surfaces[..])
    }

    /// [`Scene::surface_point`] of the `live` lanes' hits, from tables; `scene` must be the one that the BVH was built for.
    #[inline(always)]
    pub fn surface_points<R: Registers>(
        &self,
        r: R,
        scene: &Scene,
        rays: &Rays,
        hits: &Hits,
        live: u32,
        at: &mut SurfaceLanes,
    ) {
        at.fill(r, &self.surfaces, scene, rays, hits, live);
    }

    /// [`Intersect::closest`] with a chosen instruction set, to be inlined into a caller compiled for it.
    #[inline(always)]
    pub fn closest_with<S: Simd>(&self, s: S, ray: &Ray) -> Option<Hit> {
        let mut best = Best::new(ray);
        if let Some((tree, packets)) = &self.triangles {
            let mut leaves = ClosestTriangle { packets, ray: TriangleRay::new(s, ray), best: &mut best };
            tree.walk::<S, _, true>(s, leaves.best.hit.t, &Slabs::new(ray, &tree.bounds), &mut leaves);
        }
        self.closest_quadric(s, ray, &mut best);
        best.hit()
    }

    #[inline(always)]
    fn closest_quadric<S: Simd>(&self, s: S, ray: &Ray, best: &mut Best) {
        if let Some((tree, quadrics)) = &self.quadrics {
            let slabs = Slabs::new(ray, &tree.bounds);
            let mut leaves = ClosestQuadric { quadrics, ray, slabs: &slabs, best };
            tree.walk::<S, _, true>(s, leaves.best.hit.t, &slabs, &mut leaves);
        }
    }

    /// [`Self::closest_with`] for the lanes whose bit is set in `live`; the others may hold anything.
    #[inline(always)]
    pub fn closest_lanes<R: Registers>(&self, r: R, rays: &Rays, live: u32) -> Hits {
        let Some(few) = &self.few else {
            let mut hits = Hits::NONE;
            for lane in set_bits(live) {
                if let Some(hit) = self.closest_with(r.eight(), &rays.get(lane)) {
                    hits.set(lane, hit);
                }
            }
            return hits;
        };
        let mut hits = few.closest(r.sixteen(), rays, live);
        if self.quadrics.is_some() {
            for lane in set_bits(live) {
                let ray = rays.get(lane);
                let mut best = Best::new(&ray);
                best.hit = hits.get(lane).unwrap_or(best.hit);
                self.closest_quadric(r.eight(), &ray, &mut best);
                hits.set(lane, best.hit);
            }
        }
        hits
    }

    /// [`Self::occluded_with`] for the lanes whose bit is set in `live`: their answers as bits.
    #[inline(always)]
    pub fn occluded_lanes<R: Registers>(&self, r: R, rays: &Rays, live: u32) -> u32 {
        // Loops, not folds: a closure that stays out of line would be compiled for other instructions.
        let mut found = 0;
        let Some(few) = &self.few else {
            for lane in set_bits(live) {
                found |= u32::from(self.occluded_with(r.eight(), &rays.get(lane))) << lane;
            }
            return found;
        };
        found = few.occluded(r.sixteen(), rays, live);
        if self.quadrics.is_some() {
            for lane in set_bits(live & !found) {
                found |= u32::from(self.meets_quadric(r.eight(), &rays.get(lane))) << lane;
            }
        }
        found
    }

    /// [`Intersect::occluded`] with a chosen instruction set, to be inlined into a caller compiled for it.
    #[inline(always)]
    pub fn occluded_with<S: Simd>(&self, s: S, ray: &Ray) -> bool {
        let end = ray.t_max.next_down();
        if let Some((tree, packets)) = &self.triangles {
            let mut leaves = AnyTriangle { packets, ray: TriangleRay::new(s, ray), found: false };
            tree.walk::<S, _, false>(s, end, &Slabs::new(ray, &tree.bounds), &mut leaves);
            if leaves.found {
                return true;
            }
        }
        self.meets_quadric(s, ray)
    }

    #[inline(always)]
    fn meets_quadric<S: Simd>(&self, s: S, ray: &Ray) -> bool {
        let Some((tree, quadrics)) = &self.quadrics else { return false };
        let slabs = Slabs::new(ray, &tree.bounds);
        let mut leaves = AnyQuadric { quadrics, ray, slabs: &slabs, found: false };
        tree.walk::<S, _, false>(s, ray.t_max.next_down(), &slabs, &mut leaves);
        leaves.found
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

struct ClosestTriangle<'a, S: Simd> {
    packets: &'a [Packet],
    ray: TriangleRay<S>,
    best: &'a mut Best,
}

impl<S: Simd> Leaves<S> for ClosestTriangle<'_, S> {
    #[inline(always)]
    fn visit(&mut self, s: S, slabs: &WideSlabs<S>, leaf: u32, _: f32) -> f32 {
        self.best.packet(s, &self.packets[leaf as usize], &self.ray, slabs);
        self.best.hit.t
    }
}

struct ClosestQuadric<'a> {
    quadrics: &'a [BoundedQuadric],
    ray: &'a Ray,
    slabs: &'a Slabs,
    best: &'a mut Best,
}

impl<S: Simd> Leaves<S> for ClosestQuadric<'_> {
    #[inline(always)]
    fn visit(&mut self, _: S, _: &WideSlabs<S>, leaf: u32, _: f32) -> f32 {
        self.best.quadric(self.ray, self.slabs, &self.quadrics[leaf as usize]);
        self.best.hit.t
    }
}

/// The distance that ends a walk.
const STOP: f32 = -1.0;

struct AnyTriangle<'a, S: Simd> {
    packets: &'a [Packet],
    ray: TriangleRay<S>,
    found: bool,
}

impl<S: Simd> Leaves<S> for AnyTriangle<'_, S> {
    #[inline(always)]
    fn visit(&mut self, s: S, slabs: &WideSlabs<S>, leaf: u32, end: f32) -> f32 {
        self.found = self.packets[leaf as usize].any(s, &self.ray, slabs);
        if self.found { STOP } else { end }
    }
}

struct AnyQuadric<'a> {
    quadrics: &'a [BoundedQuadric],
    ray: &'a Ray,
    slabs: &'a Slabs,
    found: bool,
}

impl<S: Simd> Leaves<S> for AnyQuadric<'_> {
    #[inline(always)]
    fn visit(&mut self, _: S, _: &WideSlabs<S>, leaf: u32, end: f32) -> f32 {
        let quadric = &self.quadrics[leaf as usize];
        self.found = quadric.surface.intersect(self.ray, self.slabs, &quadric.bounds).is_some();
        if self.found { STOP } else { end }
    }
}
