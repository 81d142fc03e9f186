//! Shapes as lights: points on them drawn uniformly over their area or over the solid angle they subtend.
//!
//! Solid angle: triangles and parallelograms by [`SphericalTriangle`] and [`SphericalRectangle`], spheres by their cone. Disks,
//! cylinders and spheres with inward normals are drawn by area in both cases.

use super::super::{Geometry, Scene};
use crate::accel::{Endpoint, NO_PRIMITIVE, SurfacePoint};
use crate::math::density::{Area, Discrete as Pmf, SolidAngle};
use crate::math::spherical::{SphericalRectangle, SphericalTriangle, parallelogram_solid_angle, triangle_solid_angle};
use crate::math::trig::sin_cos_turns;
use crate::math::{Frame, Rgb, Vec3, warp};
use crate::sampling::discrete::Discrete;
use crate::sampling::rng::unit_f32;
use std::f32::consts::{PI, TAU};

/// Half a unit in the last place of 1.
const ULP: f32 = f32::EPSILON / 2.0;

/// Radiance that the surface emits at a point towards the unit vector `wo`: the shape's light, on the front side only.
#[inline(always)]
pub fn emitted(scene: &Scene, at: &SurfacePoint, wo: Vec3) -> Rgb {
    match scene.shapes[at.shape as usize].light.map(|l| scene.lights[l as usize]) {
        Some(super::Light::Area { radiance, .. }) if at.ng.dot(wo) > 0.0 => radiance,
        _ => Rgb::ZERO,
    }
}

/// Whether points on the shape can be drawn over the solid angle that it subtends; the others are drawn by area always.
pub const fn samples_solid_angle(geometry: &Geometry) -> bool {
    match geometry {
        Geometry::Mesh { .. } | Geometry::Rectangle { .. } => true,
        Geometry::Sphere { flip, .. } => !*flip,
        Geometry::Disk { .. } | Geometry::Cylinder { .. } => false,
    }
}

/// Density of a drawn point, in the measure it was drawn in.
#[derive(Clone, Copy)]
enum Density {
    Area(Area),
    SolidAngle(f32),
}

/// The surface of an area light, ready for sampling.
#[derive(Clone, Debug)]
pub(super) enum Emitter {
    Parallelogram(Parallelogram),
    Mesh(MeshEmitter),
    Sphere { center: Vec3, radius: f32, flip: bool },
    Disk { center: Vec3, u: Vec3, v: Vec3, ng: Vec3, density: Area },
    Cylinder { p0: Vec3, axis: Vec3, frame: Frame, radius: f32, flip: bool, density: Area },
}

impl Emitter {
    /// The emitter of a shape and its area; `None` where the area is 0.
    pub(super) fn new(scene: &Scene, geometry: &Geometry) -> Option<(Self, f64)> {
        let (emitter, area) = match *geometry {
            Geometry::Rectangle { ref range, corner, edge_u, edge_v } => {
                let e = Parallelogram::new(range.start, corner, edge_u, edge_v);
                let area = f64::from(e.normal.length());
                (Self::Parallelogram(e), area)
            }
            Geometry::Mesh { ref range, .. } => {
                let (e, area) = MeshEmitter::new(scene, range.start, range.end);
                (Self::Mesh(e), area)
            }
            Geometry::Sphere { center, radius, flip } => {
                (Self::Sphere { center, radius, flip }, 2.0 * f64::from(TAU) * f64::from(radius).powi(2))
            }
            Geometry::Disk { center, u, v } => {
                let normal = u.cross(v);
                let area = PI * normal.length();
                (Self::Disk { center, u, v, ng: normal.normalize(), density: Area(1.0 / area) }, f64::from(area))
            }
            Geometry::Cylinder { p0, axis, radius, flip } => {
                let area = TAU * radius * axis.length();
                let frame = Frame::new(axis.normalize());
                (Self::Cylinder { p0, axis, frame, radius, flip, density: Area(1.0 / area) }, f64::from(area))
            }
        };
        (area > 0.0 && area.is_finite()).then_some((emitter, area))
    }

    /// A point of the front side, the unit vector to it from `p`, and the density without the choice of the light. Words 0, 1
    /// place it, word 3 picks the part. `None` where the drawn point, or all of the light, shows `p` its back.
    #[inline(always)]
    pub(super) fn sample(
        &self,
        scene: &Scene,
        p: Vec3,
        words: [u32; 4],
        solid: bool,
    ) -> Option<(Endpoint, Vec3, SolidAngle)> {
        let (at, density) = self.draw(scene, p, words, solid)?;
        let to = at.p - p;
        let wi = to.try_normalize()?;
        let density = match density {
            Density::SolidAngle(d) => SolidAngle(d),
            Density::Area(d) => seen(d, to, wi, at.ng)?,
        };
        Some((at, wi, density))
    }

    #[inline(always)]
    fn draw(&self, scene: &Scene, p: Vec3, words: [u32; 4], solid: bool) -> Option<(Endpoint, Density)> {
        let u = [unit_f32(words[0]), unit_f32(words[1])];
        let (at, density) = match self {
            Self::Parallelogram(e) if solid => return e.sample_solid_angle(p, u, words[3]),
            Self::Mesh(e) if solid => return e.sample_solid_angle(scene, p, u, words[3]),
            Self::Sphere { center, radius, flip: false } if solid => return sample_cone(*center, *radius, p, u),
            Self::Parallelogram(e) => (e.patch.at(u), e.patch.density),
            Self::Mesh(e) => e.sample_area(scene, u, words[3]),
            &Self::Sphere { center, radius, flip } => {
                let n = warp::sample_uniform_sphere(u);
                (on_sphere(center, radius, n, flip), sphere_density(radius))
            }
            &Self::Disk { center, u: du, v: dv, ng, density } => {
                let d = warp::sample_uniform_disk(u);
                (planar(center, d.x * du, d.y * dv, ng, NO_PRIMITIVE), density)
            }
            &Self::Cylinder { p0, axis, frame, radius, flip, density } => {
                let (s, c) = sin_cos_turns(u[1]);
                let n = frame.s * c + frame.t * s;
                let a = u[0] * axis;
                let p_error = 8.0 * ULP * (p0.abs() + a.abs() + Vec3::splat(radius));
                let ng = if flip { -n } else { n };
                (Endpoint { p: p0 + a + radius * n, p_error, ng, triangle: NO_PRIMITIVE }, density)
            }
        };
        Some((at, Density::Area(density)))
    }

    /// Density with which [`Self::sample`] draws the direction `wi` from `p` to `hit`, without the choice of the light.
    #[inline(always)]
    pub(super) fn pdf(
        &self,
        scene: &Scene,
        p: Vec3,
        wi: Vec3,
        hit: &SurfacePoint,
        primitive: u32,
        solid: bool,
    ) -> Option<SolidAngle> {
        let density = match self {
            Self::Parallelogram(e) if solid => return e.solid_angle(p).map(|o| SolidAngle(1.0 / o)),
            Self::Mesh(e) if solid => return e.solid_angle_pdf(scene, p, primitive),
            Self::Sphere { center, radius, flip: false } if solid => return cone_pdf(*center, *radius, p),
            Self::Parallelogram(e) => e.patch.density,
            Self::Mesh(e) => e.density(primitive),
            Self::Sphere { radius, .. } => sphere_density(*radius),
            Self::Disk { density, .. } | Self::Cylinder { density, .. } => *density,
        };
        seen(density, hit.p - p, wi, hit.ng)
    }
}

/// A density over area as one over solid angle; `None` at the back and at the edge.
#[inline(always)]
fn seen(density: Area, to: Vec3, wi: Vec3, ng: Vec3) -> Option<SolidAngle> {
    let cos = -wi.dot(ng);
    (cos > 0.0).then(|| density.seen(to.length_squared(), cos))
}

/// A point given by a corner, or centre, and multiples of two edges.
#[inline(always)]
fn planar(corner: Vec3, s: Vec3, t: Vec3, ng: Vec3, triangle: u32) -> Endpoint {
    // Two products, two sums and the rounding of the edges.
    Endpoint { p: corner + s + t, p_error: 5.0 * ULP * (corner.abs() + s.abs() + t.abs()), ng, triangle }
}

/// A parallelogram sampled by area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    pub(super) corner: Vec3,
    pub(super) u: Vec3,
    pub(super) v: Vec3,
    pub(super) ng: Vec3,
    pub(super) density: Area,
    /// The scene's index of the triangle below the diagonal from the corner, on the side of `u`; the other half comes next.
    pub(super) start: u32,
}

impl Patch {
    /// What [`Emitter::sample`] gives, in a form without branches: the density is 0 where that is `None`.
    #[inline(always)]
    pub(super) fn sample(&self, p: Vec3, u: [f32; 2]) -> (Endpoint, Vec3, SolidAngle) {
        let at = self.at(u);
        let to = at.p - p;
        let scale = to.length_recip();
        let wi = to * scale;
        let cos = -wi.dot(at.ng);
        // A distance of 0 or beyond the range of f32 has no direction.
        let visible = (scale > 0.0) & (scale < f32::INFINITY) & (cos > 0.0);
        let seen = self.density.seen(to.length_squared(), cos);
        (at, wi, SolidAngle(if visible { seen.0 } else { 0.0 }))
    }

    #[inline(always)]
    fn at(&self, st: [f32; 2]) -> Endpoint {
        planar(self.corner, st[0] * self.u, st[1] * self.v, self.ng, self.start + u32::from(st[0] < st[1]))
    }
}

#[derive(Clone, Debug)]
pub(super) struct Parallelogram {
    pub(super) patch: Patch,
    /// u × v; its length is the area.
    pub(super) normal: Vec3,
    /// Unit edges and their lengths, if they are orthogonal to rounding.
    pub(super) sides: Option<[(Vec3, f32); 2]>,
}

impl Parallelogram {
    fn new(start: u32, corner: Vec3, u: Vec3, v: Vec3) -> Self {
        let normal = u.cross(v);
        let (lu, lv) = (u.length(), v.length());
        let (x, y) = (u / lu, v / lv);
        // An angle of 2⁻²⁰ off moves points by that much of a side.
        let rectangular = x.dot(y).abs() < 16.0 * ULP;
        let density = Area(1.0 / normal.length());
        let sides = rectangular.then_some([(x, lu), (y, lv)]);
        Self { patch: Patch { start, corner, u, v, ng: normal.normalize(), density }, normal, sides }
    }

    /// Solid angle seen from `p`; `None` from behind and from the plane.
    #[inline(always)]
    fn solid_angle(&self, p: Vec3) -> Option<f32> {
        Some(parallelogram_solid_angle(self.patch.corner - p, self.patch.u, self.patch.v, self.normal))
            .filter(|&o| o > 0.0)
    }

    #[inline(always)]
    fn sample_solid_angle(&self, p: Vec3, u: [f32; 2], part: u32) -> Option<(Endpoint, Density)> {
        let total = self.solid_angle(p)?;
        let Patch { corner, u: eu, v: ev, ng, .. } = self.patch;
        let (a, d) = (corner - p, eu + ev);
        let rectangle = self.sides.and_then(|[x, y]| SphericalRectangle::new(a, x, y, ng, total));
        let st = if let Some(r) = rectangle { r.sample(u) } else { self.sample_halves(a, d, u, part)? };
        Some((self.patch.at(st), Density::SolidAngle(1.0 / total)))
    }

    /// The parallelogram as two triangles on both sides of its diagonal `d`.
    #[inline(always)]
    fn sample_halves(&self, a: Vec3, d: Vec3, u: [f32; 2], part: u32) -> Option<[f32; 2]> {
        let first = SphericalTriangle::new(a, self.patch.u, d, self.normal)?;
        let second = SphericalTriangle::new(a, d, self.patch.v, self.normal)?;
        let share = first.solid_angle / (first.solid_angle + second.solid_angle);
        Some(if part < (share * 4_294_967_296.0) as u32 {
            let [b, c] = first.sample(u);
            [b + c, c]
        } else {
            let [b, c] = second.sample(u);
            [b, b + c]
        })
    }
}

#[derive(Clone, Debug)]
pub(super) struct MeshEmitter {
    /// Triangles that have an area, as indices into the scene's.
    pub(super) triangles: Vec<u32>,
    pub(super) choice: Discrete,
    /// The scene's index of the mesh's first triangle.
    pub(super) start: u32,
    /// For each triangle of the mesh: its probability, and that over its area. 0 without an area.
    pub(super) densities: Vec<(Pmf, Area)>,
}

impl MeshEmitter {
    fn new(scene: &Scene, start: u32, end: u32) -> (Self, f64) {
        let areas: Vec<f64> = (start..end).map(|t| f64::from(0.5 * MeshEmitter::edges(scene, t).3.length())).collect();
        let sound = |a: f64| a > 0.0 && a.is_finite();
        let triangles: Vec<u32> = (start..end).filter(|t| sound(areas[(t - start) as usize])).collect();
        let weights: Vec<f64> = triangles.iter().map(|t| areas[(t - start) as usize]).collect();
        let choice = Discrete::new(&weights);
        let mut densities = vec![(Pmf(0.0), Area(0.0)); areas.len()];
        for (i, &t) in triangles.iter().enumerate() {
            let pmf = choice.pmf(i);
            densities[(t - start) as usize] = (Pmf(pmf), Area(pmf / weights[i] as f32));
        }
        (Self { triangles, choice, start, densities }, weights.iter().sum())
    }

    /// Vertex 0, the edges to vertices 1 and 2, and their cross product.
    #[inline(always)]
    fn edges(scene: &Scene, triangle: u32) -> (Vec3, Vec3, Vec3, Vec3) {
        let [a, b, c] = scene.triangles[triangle as usize].vertices.map(|v| scene.positions[v as usize]);
        let (eb, ec) = (b - a, c - a);
        (a, eb, ec, eb.cross(ec))
    }

    #[inline(always)]
    fn density(&self, triangle: u32) -> Area {
        self.densities.get(triangle.wrapping_sub(self.start) as usize).map_or(Area(0.0), |d| d.1)
    }

    #[inline(always)]
    fn sample_area(&self, scene: &Scene, u: [f32; 2], part: u32) -> (Endpoint, Area) {
        let triangle = self.triangles[self.choice.pick(part)];
        let (a, eb, ec, normal) = Self::edges(scene, triangle);
        let [b, c] = warp::sample_uniform_triangle(u);
        (planar(a, b * eb, c * ec, normal.normalize(), triangle), self.density(triangle))
    }

    #[inline(always)]
    fn sample_solid_angle(&self, scene: &Scene, p: Vec3, u: [f32; 2], part: u32) -> Option<(Endpoint, Density)> {
        let i = self.choice.pick(part);
        let triangle = self.triangles[i];
        let (a, eb, ec, normal) = Self::edges(scene, triangle);
        let t = SphericalTriangle::new(a - p, eb, ec, normal)?;
        let [b, c] = t.sample(u);
        let pdf = SolidAngle(1.0 / t.solid_angle) * Pmf(self.choice.pmf(i));
        Some((planar(a, b * eb, c * ec, normal.normalize(), triangle), Density::SolidAngle(pdf.0)))
    }

    #[inline(always)]
    fn solid_angle_pdf(&self, scene: &Scene, p: Vec3, triangle: u32) -> Option<SolidAngle> {
        let pmf = self.densities.get(triangle.wrapping_sub(self.start) as usize)?.0;
        let (a, eb, ec, normal) = Self::edges(scene, triangle);
        let solid_angle = triangle_solid_angle(a - p, eb, ec, normal);
        (solid_angle > 0.0).then(|| SolidAngle(1.0 / solid_angle) * pmf)
    }
}

#[inline(always)]
pub(super) fn sphere_density(radius: f32) -> Area {
    Area(1.0 / (2.0 * TAU * radius * radius))
}

#[inline(always)]
fn on_sphere(center: Vec3, radius: f32, n: Vec3, flip: bool) -> Endpoint {
    // |n| errs by a few units, too.
    let p_error = 8.0 * ULP * (center.abs() + Vec3::splat(radius));
    Endpoint { p: center + radius * n, p_error, ng: if flip { -n } else { n }, triangle: NO_PRIMITIVE }
}

/// 1 − cos θmax of the cone around a sphere; `None` from inside and on the sphere, where its front cannot be seen.
#[inline(always)]
fn cone_height(radius: f32, distance2: f32) -> Option<f32> {
    let radius2 = radius * radius;
    (distance2 > radius2).then(|| {
        let sin2 = radius2 / distance2;
        sin2 / (1.0 + (1.0 - sin2).sqrt())
    })
}

#[inline(always)]
fn cone_pdf(center: Vec3, radius: f32, p: Vec3) -> Option<SolidAngle> {
    cone_height(radius, p.distance_squared(center)).map(|h| SolidAngle(warp::uniform_cone_pdf(h)))
}

/// The point of a sphere that a direction of its cone meets first.
#[inline(always)]
fn sample_cone(center: Vec3, radius: f32, p: Vec3, u: [f32; 2]) -> Option<(Endpoint, Density)> {
    let axis = p - center;
    let distance2 = axis.length_squared();
    let height = cone_height(radius, distance2)?;
    let distance = distance2.sqrt();
    let h = u[0] * height;
    let (sin2, cos) = (h * (2.0 - h), 1.0 - h);
    // Half the chord that the ray cuts out of the sphere; the distance to its near end without cancellation.
    let half_chord = (radius * radius - distance2 * sin2).max(0.0).sqrt();
    let t = (distance - radius) * (distance + radius) / (distance * cos + half_chord);
    // Angle at the centre between p and the point: the sine rule, and the two legs of the right triangle.
    let sin_alpha = (t * sin2.sqrt() / radius).min(1.0);
    let cos_alpha = ((1.0 - sin_alpha) * (1.0 + sin_alpha)).sqrt();
    let (s, c) = sin_cos_turns(u[1]);
    let n = Frame::new(axis / distance).to_world(Vec3::new(sin_alpha * c, sin_alpha * s, cos_alpha));
    Some((on_sphere(center, radius, n, false), Density::SolidAngle(warp::uniform_cone_pdf(height))))
}
