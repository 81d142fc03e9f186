//! Spheres, disks and cylinders, intersected in f64: stable for tiny and huge radii and distances.

use super::Ray;
use super::slab::{Bounds, Slabs};
use crate::scene::Geometry;
use glam::DVec3;

/// A curved or elliptic surface in f64.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Quadric {
    Sphere { center: DVec3, radius: f64, outside: f64 },
    Disk { center: DVec3, u: DVec3, v: DVec3 },
    Cylinder { p0: DVec3, axis: DVec3, length: f64, radius: f64, outside: f64 },
}

impl Quadric {
    /// `None` for shapes made of triangles.
    pub(crate) fn new(geometry: &Geometry) -> Option<Self> {
        let side = |flip: bool| if flip { -1.0 } else { 1.0 };
        match *geometry {
            Geometry::Mesh { .. } | Geometry::Rectangle { .. } => None,
            Geometry::Sphere { center, radius, flip } => {
                Some(Self::Sphere { center: center.as_dvec3(), radius: radius.into(), outside: side(flip) })
            }
            Geometry::Disk { center, u, v } => {
                Some(Self::Disk { center: center.as_dvec3(), u: u.as_dvec3(), v: v.as_dvec3() })
            }
            Geometry::Cylinder { p0, axis, radius, flip } => {
                let length = axis.as_dvec3().length();
                let unit = axis.as_dvec3() / length;
                Some(Self::Cylinder {
                    p0: p0.as_dvec3(),
                    axis: unit,
                    length,
                    radius: radius.into(),
                    outside: side(flip),
                })
            }
        }
    }

    /// Distance of the first hit with 0 ≤ t < t_max.
    pub(crate) fn distance(&self, ray: &Ray) -> Option<f64> {
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let ahead = |t: &f64| *t >= 0.0 && *t < f64::from(ray.t_max);
        match *self {
            Self::Sphere { center, radius, .. } => roots(o - center, d, radius)?.into_iter().find(ahead),
            Self::Disk { center, u, v } => {
                let n = u.cross(v);
                let t = n.dot(center - o) / n.dot(d);
                let q = o + d * t - center;
                // q = a·u + b·v.
                let (a, b) = (q.cross(v).dot(n), u.cross(q).dot(n));
                let nn = n.dot(n);
                (ahead(&t) && a * a + b * b <= nn * nn).then_some(t)
            }
            Self::Cylinder { p0, axis, length, radius, .. } => {
                let q = o - p0;
                let across = |x: DVec3| x - axis * x.dot(axis);
                let height = |t: &f64| (q + d * *t).dot(axis);
                roots(across(q), across(d), radius)?
                    .into_iter()
                    .find(|t| ahead(t) && (0.0..=length).contains(&height(t)))
            }
        }
    }

    /// Distance of the first hit as f32, within the box interval (as for triangles, so that culling changes no bit).
    #[inline(always)]
    pub(crate) fn intersect(&self, ray: &Ray, slabs: &Slabs, bounds: &Bounds) -> Option<f32> {
        let (near, far) = slabs.interval(bounds);
        if near > far {
            return None;
        }
        let t = (self.distance(ray)? as f32).min(ray.t_max.next_down()).max(near).min(far);
        (t < ray.t_max).then_some(t)
    }

    /// The point at (f64) distance `t` put onto the surface, and the unit normal on the front side.
    pub(crate) fn surface(&self, ray: &Ray, t: f64) -> (DVec3, DVec3) {
        let p = ray.origin.as_dvec3() + ray.direction.as_dvec3() * t;
        match *self {
            Self::Sphere { center, radius, outside } => {
                let n = (p - center).normalize_or(DVec3::Z);
                (center + n * radius, n * outside)
            }
            Self::Disk { center, u, v } => {
                let n = u.cross(v).normalize_or(DVec3::Z);
                (p - n * n.dot(p - center), n)
            }
            Self::Cylinder { p0, axis, length, radius, outside } => {
                let height = (p - p0).dot(axis);
                let n = (p - p0 - axis * height).normalize_or(axis.any_orthonormal_vector());
                (p0 + axis * height.clamp(0.0, length) + n * radius, n * outside)
            }
        }
    }

    /// A box around it, rounded outwards.
    pub(crate) fn bounds(&self) -> Bounds {
        let (lo, hi) = match *self {
            Self::Sphere { center, radius, .. } => (center - radius, center + radius),
            Self::Disk { center, u, v } => {
                let reach = (u * u + v * v).map(f64::sqrt);
                (center - reach, center + reach)
            }
            Self::Cylinder { p0, axis, length, radius, .. } => {
                let p1 = p0 + axis * length;
                let reach = (1.0 - axis * axis).max(DVec3::ZERO).map(f64::sqrt) * radius;
                (p0.min(p1) - reach, p0.max(p1) + reach)
            }
        };
        let (lo, hi) = (lo.as_vec3(), hi.as_vec3());
        Bounds { lo: lo.map(f32::next_down), hi: hi.map(f32::next_up) }
    }
}

/// The two t with |q + t·d| = radius, smaller first (Haines et al., "Precision Improvements for Ray/Sphere Intersection",
/// Ray Tracing Gems ch. 7, 2019): discriminant from the distance of closest approach, no difference of near-equal roots.
fn roots(q: DVec3, d: DVec3, radius: f64) -> Option<[f64; 2]> {
    let dd = d.dot(d);
    let middle = -q.dot(d) / dd;
    let closest = q + d * middle;
    let square = (radius - closest.length()) * (radius + closest.length());
    if !(square >= 0.0 && dd > 0.0) {
        return None;
    }
    let half = (square / dd).sqrt();
    // Product of the roots, with the sign of "origin outside".
    let product = (q.length() - radius) * (q.length() + radius) / dd;
    let far = if middle >= 0.0 { middle + half } else { middle - half };
    let other = if far == 0.0 { 0.0 } else { product / far };
    Some(if middle >= 0.0 { [other, far] } else { [far, other] })
}
