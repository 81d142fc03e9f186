//! A scene's surfaces as the intersectors keep them, and the nearest hit among them.

use super::quadric::Quadric;
use super::simd::Simd;
use super::slab::{Bounds, Slabs, WideSlabs};
use super::tree::traceable;
use super::triangle::{self, Packet, TriangleRay};
use super::{Hit, Ray};
use crate::error::{Error, Place, Result};
use crate::math::Vec3;
use crate::math::lanes::set_bits;
use crate::scene::Scene;

/// A quadric with its box and its primitive index.
#[derive(Clone, Debug)]
pub(super) struct BoundedQuadric {
    pub(super) surface: Quadric,
    pub(super) bounds: Bounds,
    pub(super) primitive: u32,
}

/// Triangles and quadrics in scene order.
pub(super) struct Primitives {
    pub(super) triangles: Vec<[Vec3; 3]>,
    pub(super) quadrics: Vec<BoundedQuadric>,
    /// `None` where the scene has no triangles.
    pub(super) triangle_bounds: Option<Bounds>,
    /// `None` where the scene has no quadrics.
    pub(super) quadric_bounds: Option<Bounds>,
}

impl Primitives {
    pub(super) fn new(scene: &Scene) -> Result<Self> {
        let name = |shape: u32| scene.shapes.get(shape as usize).map_or("?", |s| s.name.as_str());
        let refuse = |shape: u32, what: &str| {
            Error::input(
                Place::file(&scene.name),
                format!("shape '{}' {what}; allowed are finite coordinates up to 1e15 in size", name(shape)),
            )
        };
        let mut triangles = Vec::with_capacity(scene.triangles.len());
        for t in &scene.triangles {
            let [a, b, c] = t.vertices.map(|v| scene.positions.get(v as usize).copied());
            let (Some(a), Some(b), Some(c)) = (a, b, c) else {
                return Err(refuse(t.shape, "has a triangle whose vertex index is out of range"));
            };
            // Summed, so that a NaN vertex cannot hide behind min and max.
            if !traceable(&triangle::bounds(&[a, b, c])) || !(a + b + c).is_finite() {
                return Err(refuse(t.shape, "has a vertex that cannot be traced"));
            }
            triangles.push([a, b, c]);
        }
        let mut quadrics = Vec::new();
        for (i, shape) in scene.shapes.iter().enumerate() {
            let Some(surface) = Quadric::new(&shape.geometry) else { continue };
            let bounds = surface.bounds();
            if !traceable(&bounds) {
                return Err(refuse(i as u32, "cannot be traced"));
            }
            quadrics.push(BoundedQuadric { surface, bounds, primitive: (triangles.len() + i) as u32 });
        }
        if triangles.len() + scene.shapes.len() >= 1 << 31 {
            return Err(Error::input(
                Place::file(&scene.name),
                format!(
                    "{} triangles and {} shapes; allowed are 2147483647 together",
                    triangles.len(),
                    scene.shapes.len()
                ),
            ));
        }
        let triangle_bounds = triangles.iter().map(triangle::bounds).reduce(Bounds::union);
        let quadric_bounds = quadrics.iter().map(|q| q.bounds).reduce(Bounds::union);
        Ok(Self { triangles, quadrics, triangle_bounds, quadric_bounds })
    }

    /// At most eight triangles as a packet.
    pub(super) fn packet(&self, indices: impl IntoIterator<Item = u32>) -> Packet {
        Packet::new(indices.into_iter().map(|i| (i, self.triangles[i as usize])))
    }
}

/// The nearest hit so far; of equal distances the lowest primitive index wins, whatever the order of the tests.
pub(super) struct Best {
    pub(super) hit: Hit,
}

impl Best {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        Self { hit: Hit { t: ray.t_max.next_down(), primitive: u32::MAX, u: 0.0, v: 0.0 } }
    }

    #[inline(always)]
    fn offer(&mut self, hit: Hit) {
        if hit.t < self.hit.t || (hit.t == self.hit.t && hit.primitive < self.hit.primitive) {
            self.hit = hit;
        }
    }

    #[inline(always)]
    pub(super) fn packet<S: Simd>(&mut self, s: S, packet: &Packet, ray: &TriangleRay<S>, slabs: &WideSlabs<S>) {
        if let Some(found) = packet.closest(s, ray, slabs, self.hit.t) {
            let (t, u, v) = (s.store(found.t), s.store(found.u), s.store(found.v));
            for i in set_bits(found.lanes) {
                self.offer(Hit { t: t[i], primitive: packet.primitive[i], u: u[i], v: v[i] });
            }
        }
    }

    #[inline(always)]
    pub(super) fn quadric(&mut self, ray: &Ray, slabs: &Slabs, quadric: &BoundedQuadric) {
        if let Some(t) = quadric.surface.intersect(ray, slabs, &quadric.bounds) {
            self.offer(Hit { t, primitive: quadric.primitive, u: 0.0, v: 0.0 });
        }
    }

    #[inline(always)]
    pub(super) fn hit(self) -> Option<Hit> {
        (self.hit.primitive != u32::MAX).then_some(self.hit)
    }
}
