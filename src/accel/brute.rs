//! The O(n) intersector that judges the BVH.

use super::primitives::{Best, Primitives};
use super::simd::{Portable, Simd};
use super::slab::{Slabs, WideSlabs};
use super::triangle::{Packet, TriangleRay};
use super::{Hit, Intersect, Ray};
use crate::Result;
use crate::scene::Scene;

/// Tests every primitive, with the same triangle and quadric tests as [`super::bvh::Bvh`] but no tree.
pub struct Brute {
    primitives: Primitives,
    packets: Vec<Packet>,
}

impl Brute {
    /// Copies the geometry. Errors as for [`super::bvh::Bvh::new`].
    pub fn new(scene: &Scene) -> Result<Self> {
        let primitives = Primitives::new(scene)?;
        let packets = (0..primitives.triangles.len())
            .step_by(8)
            .map(|first| primitives.packet(first as u32..(first as u32 + 8).min(primitives.triangles.len() as u32)))
            .collect();
        Ok(Self { primitives, packets })
    }

    #[inline(always)]
    fn closest_with<S: Simd>(&self, s: S, ray: &Ray) -> Option<Hit> {
        let mut best = Best::new(ray);
        if let Some(bounds) = &self.primitives.triangle_bounds {
            let slabs = WideSlabs::new(s, &Slabs::new(ray, bounds));
            let shear = TriangleRay::new(s, ray);
            for packet in &self.packets {
                best.packet(s, packet, &shear, &slabs);
            }
        }
        if let Some(bounds) = &self.primitives.quadric_bounds {
            let slabs = Slabs::new(ray, bounds);
            for quadric in &self.primitives.quadrics {
                best.quadric(ray, &slabs, quadric);
            }
        }
        best.hit()
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn closest_avx2(&self, s: super::simd::Avx2, ray: &Ray) -> Option<Hit> {
        self.closest_with(s, ray)
    }
}

impl Intersect for Brute {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = super::simd::Avx2::detect() {
            // SAFETY: AVX2 was detected.
            return unsafe { self.closest_avx2(avx2, ray) };
        }
        self.closest_with(Portable, ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.closest(ray).is_some()
    }
}
