//! Uniform sampling of the solid angle of planar lights, precise for every size.

use super::Vec3;
use super::trig::{atan2, sin_cos_turns};
use std::f32::consts::TAU;

/// Solid angle of the triangle `a`, `a + eb`, `a + ec` seen from the origin, sr; `normal` = eb × ec. Positive where the origin
/// lies on the side that the normal points to, else ≤ 0 or NaN.
///
/// Source: van Oosterom, Strackee, "The solid angle of a plane triangle", 1983. The determinant is taken from the edges, so
/// that its relative error is that of the distance to the plane, however small the triangle.
#[inline(always)]
pub fn triangle_solid_angle(a: Vec3, eb: Vec3, ec: Vec3, normal: Vec3) -> f32 {
    let (b, c) = (a + eb, a + ec);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let (na, nb, nc) = (a / la, b / lb, c / lc);
    2.0 * atan2(-na.dot(normal) / (lb * lc), 1.0 + na.dot(nb) + nb.dot(nc) + nc.dot(na))
}

/// Solid angle of the parallelogram with corner `a` and edges `u`, `v` seen from the origin, sr; `normal` = u × v. Both halves as
/// in [`triangle_solid_angle`], their half angles added by multiplying complex numbers. 0 from behind and from the plane.
#[inline(always)]
pub fn parallelogram_solid_angle(a: Vec3, u: Vec3, v: Vec3, normal: Vec3) -> f32 {
    let corners = [a, a + u, a + u + v, a + v];
    let l = corners.map(Vec3::length);
    let [na, nb, nc, nd] = [0, 1, 2, 3].map(|i| corners[i] / l[i]);
    let height = -na.dot(normal) / l[2];
    if height.is_nan() || height <= 0.0 {
        return 0.0;
    }
    let ac = 1.0 + na.dot(nc);
    let (y0, x0) = (height / l[1], ac + na.dot(nb) + nb.dot(nc));
    let (y1, x1) = (height / l[3], ac + nc.dot(nd) + nd.dot(na));
    let half = atan2(y0 * x1 + y1 * x0, x0 * x1 - y0 * y1);
    // Half a turn may round past the cut.
    2.0 * if half < 0.0 { half + TAU } else { half }
}

/// 1 − cos of the angle between (along, across) and the first axis, without cancellation.
#[inline(always)]
fn one_minus_cos(along: f32, across: f32) -> f32 {
    let length = (along * along + across * across).sqrt();
    if along > 0.0 { across * across / (length * (length + along)) } else { (length - along) / length }
}

/// A triangle seen from the origin, ready for sampling by solid angle.
///
/// The idea is Arvo's ("Stratified sampling of spherical triangles", 1995): u₀ cuts off a sub-triangle A B C′ with u₀ of the
/// area, u₁ picks a point on the arc B C′. Here both steps are solved in half-angle tangents relative to the vertices and
/// edges in space (tan(Ω′/2) is a ratio of linear forms in C′), and the answer is a point of the planar triangle: no arc
/// cosine, no difference of unit vectors, hence a relative precision that does not depend on the triangle's size.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    /// sr, positive.
    pub solid_angle: f32,
    eb: Vec3,
    ec: Vec3,
    /// |a|, |b|.
    la: f32,
    lb: f32,
    /// b/|b|.
    nb: Vec3,
    /// ec = xc·A + yc·A⊥ with A = a/|a|.
    xc: f32,
    yc: f32,
    /// 1 + A·B, B·A⊥, |A × B·A⊥|.
    k: f32,
    m: f32,
    n: f32,
}

impl SphericalTriangle {
    /// The triangle `a`, `a + eb`, `a + ec`; `None` where it shows the origin its back or its edge.
    #[inline(always)]
    pub fn new(a: Vec3, eb: Vec3, ec: Vec3, normal: Vec3) -> Option<Self> {
        let solid_angle = triangle_solid_angle(a, eb, ec, normal);
        let b = a + eb;
        let (la, lb) = (a.length(), b.length());
        let (na, nb) = (a / la, b / lb);
        let xc = na.dot(ec);
        let across = ec - xc * na;
        let yc = across.length();
        if !(solid_angle > 0.0 && yc > 0.0) {
            return None;
        }
        let (k, m, n) = (1.0 + na.dot(nb), eb.dot(across) / (yc * lb), -na.dot(normal) / (yc * lb));
        Some(Self { solid_angle, eb, ec, la, lb, nb, xc, yc, k, m, n })
    }

    /// Position of C′ on the edge a–c (0 at a), and the vector from b to C′ in components along and across b/|b|.
    #[inline(always)]
    fn chord(&self, s: f32) -> (f32, f32) {
        let e = s * self.ec - self.eb;
        let x = self.nb.dot(e);
        (x, (e - x * self.nb).length())
    }

    /// A point as weights of b and c.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 2]) -> [f32; 2] {
        let (sin, cos) = sin_cos_turns(u[0] * self.solid_angle * (0.5 / TAU));
        // tan(θ/2) = ty/tx, θ = the angle between a and C′.
        let (ty, tx) = (sin * self.k, self.n * cos - sin * self.m);
        let s = 2.0 * ty * tx * self.la / (self.yc * (tx * tx - ty * ty) - 2.0 * self.xc * ty * tx);
        let s = s.clamp(0.0, 1.0);
        let (x, y) = self.chord(s);
        let along = self.lb + x;
        let h = u[1] * one_minus_cos(along, y);
        // Where divisions are not exact h may round past 2.
        let (sin, cos) = ((h * (2.0 - h)).max(0.0).sqrt(), 1.0 - h);
        let r = if y > 0.0 { (self.lb * sin / (y * cos - x * sin)).clamp(0.0, 1.0) } else { u[1] };
        [1.0 - r, r * s]
    }

    /// Inverse of [`Self::sample`].
    pub fn invert(&self, weights: [f32; 2]) -> [f32; 2] {
        let r = 1.0 - weights[0];
        let s = weights[1] / r;
        let (along, across) = (self.la + s * self.xc, s * self.yc);
        // tan(θ/2) = ty/tx.
        let length = (along * along + across * across).sqrt();
        let (ty, tx) = if along > 0.0 { (across, length + along) } else { (length - along, across) };
        let u0 = 2.0 * atan2(ty * self.n, tx * self.k + ty * self.m) / self.solid_angle;
        let (x, y) = self.chord(s);
        let height = |r: f32| one_minus_cos(self.lb + r * x, r * y);
        [u0, height(r) / height(1.0)]
    }
}

/// Signed solid angle of \[0, x\] × \[y₀, y₁\] at distance z: the difference of two corner quadrants with tangents x y/(z r).
#[inline(always)]
fn strip(x: f32, y: [f32; 2], z: f32) -> f32 {
    let [r0, r1] = y.map(|y| z * (x * x + y * y + z * z).sqrt());
    let [n0, n1] = y.map(|y| x * y);
    atan2(n1 * r0 - n0 * r1, r0 * r1 + n0 * n1)
}

/// A rectangle seen from the origin, ready for sampling by solid angle.
///
/// Source: Ureña, Fajardo, King, "An area-preserving parametrization for spherical rectangles", EGSR 2013, with the internal
/// angles replaced by the solid angles of the four corner quadrants, asin(x y/√((x²+z²)(y²+z²))) = atan(x y/(z r)).
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    solid_angle: f32,
    /// Distance to the plane; the sides.
    z: f32,
    x0: f32,
    lx: f32,
    y0: f32,
    ly: f32,
    /// Signed solid angle between x = 0 and x = x0.
    phi0: f32,
    /// Sines and the cosine of the elevations of y0 and y1.
    sin0: f32,
    sin1: f32,
    cos0: f32,
}

impl SphericalRectangle {
    /// The rectangle with corner `a`, sides of lengths `lx`, `ly` along the unit vectors `x`, `y`, unit normal `n` = x × y
    /// turned towards the origin, and the given solid angle.
    ///
    /// `None` where the parametrisation is not precise. A solid angle made of corner quadrants carries an absolute error of a
    /// few 2⁻²⁴, so positions err by that over Ω, relative to the width: Ω ≥ 2⁻¹⁰ keeps it below 2⁻¹¹. The elevation h = y/r
    /// turns back into y with dy/dh = r³/z², which r³ ≤ 2¹¹·z²·width keeps below 2⁻¹¹ of the width, too.
    #[inline(always)]
    pub fn new(a: Vec3, x: (Vec3, f32), y: (Vec3, f32), n: Vec3, solid_angle: f32) -> Option<Self> {
        let ((x, lx), (y, ly)) = (x, y);
        let (x0, y0, z) = (a.dot(x), a.dot(y), -a.dot(n));
        let (x1, y1) = (x0 + lx, y0 + ly);
        let far2 = (x0 * x0).max(x1 * x1) + (y0 * y0).max(y1 * y1) + z * z;
        if !(solid_angle >= 1.0 / 1024.0 && far2 * far2.sqrt() <= 2048.0 * z * z * lx.min(ly)) {
            return None;
        }
        let (r0, r1) = ((y0 * y0 + z * z).sqrt(), (y1 * y1 + z * z).sqrt());
        let phi0 = strip(x0, [y0, y1], z);
        Some(Self { solid_angle, z, x0, lx, y0, ly, phi0, sin0: y0 / r0, sin1: y1 / r1, cos0: z / r0 })
    }

    /// A point in units of the sides.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 2]) -> [f32; 2] {
        let phi = self.phi0 + u[0] * self.solid_angle;
        let (sin, cos) = sin_cos_turns(phi.abs() * (1.0 / TAU));
        let (e, f) = (self.sin1 - self.sin0 * cos, self.cos0 * sin);
        let x = (self.z * sin / ((e - f) * (e + f)).max(0.0).sqrt()).copysign(phi);
        let x = if sin > 0.0 { x.clamp(self.x0, self.x0 + self.lx) } else { 0.0 };
        let d2 = x * x + self.z * self.z;
        let y1 = self.y0 + self.ly;
        let (h0, h1) = (self.y0 / (d2 + self.y0 * self.y0).sqrt(), y1 / (d2 + y1 * y1).sqrt());
        let h = h0 + u[1] * (h1 - h0);
        let y = h * (d2 / ((1.0 - h) * (1.0 + h))).sqrt();
        [((x - self.x0) / self.lx).clamp(0.0, 1.0), ((y - self.y0) / self.ly).clamp(0.0, 1.0)]
    }

    /// Inverse of [`Self::sample`].
    pub fn invert(&self, st: [f32; 2]) -> [f32; 2] {
        let (x, y, y1) = (self.x0 + st[0] * self.lx, self.y0 + st[1] * self.ly, self.y0 + self.ly);
        let d2 = x * x + self.z * self.z;
        let h = |y: f32| y / (d2 + y * y).sqrt();
        let u0 = (strip(x, [self.y0, y1], self.z) - self.phi0) / self.solid_angle;
        [u0, (h(y) - h(self.y0)) / (h(y1) - h(self.y0))]
    }
}
