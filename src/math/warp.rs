//! Warps of the unit square, each as sample / density / inverse.
//!
//! Inputs are in \[0, 1); densities are with respect to the measure of the codomain (solid angle, area, length);
//! an inverse gives back the `u` that a point came from.

use super::trig::{atan2, sin_cos_eighth, sin_cos_turns};
use super::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};
use std::sync::LazyLock;

/// Azimuth of (x, y) in turns, in \[0, 1).
fn turns(x: f32, y: f32) -> f32 {
    let t = atan2(y, x) / TAU;
    if t < 0.0 { t + 1.0 } else { t }
}

/// Uniform direction in the hemisphere around +z. z is never 0.
#[inline(always)]
pub fn sample_uniform_hemisphere(u: [f32; 2]) -> Vec3 {
    sample_uniform_cone(u, 1.0)
}

/// 1/2π sr⁻¹.
#[inline(always)]
pub fn uniform_hemisphere_pdf() -> f32 {
    FRAC_1_PI / 2.0
}

/// Inverse of [`sample_uniform_hemisphere`].
pub fn invert_uniform_hemisphere(v: Vec3) -> [f32; 2] {
    invert_uniform_cone(v, 1.0)
}

/// Uniform direction on the sphere.
#[inline(always)]
pub fn sample_uniform_sphere(u: [f32; 2]) -> Vec3 {
    let r = 2.0 * (u[0] * (1.0 - u[0])).sqrt();
    let (s, c) = sin_cos_turns(u[1]);
    Vec3::new(r * c, r * s, 1.0 - 2.0 * u[0])
}

/// 1/4π sr⁻¹.
#[inline(always)]
pub fn uniform_sphere_pdf() -> f32 {
    FRAC_1_PI / 4.0
}

/// Inverse of [`sample_uniform_sphere`].
pub fn invert_uniform_sphere(v: Vec3) -> [f32; 2] {
    [(1.0 - v.z) / 2.0, turns(v.x, v.y)]
}

/// Half of what 2u steps by.
const HALF_STEP: f32 = 1.0 / 16_777_216.0;

/// Uniform point of the unit disk by the concentric map of Shirley and Chiu, "A low distortion map between disk and square",
/// JGT 2(3), 1997; with its radius, which is exact.
#[inline(always)]
fn concentric(u: [f32; 2]) -> (Vec2, f32) {
    // The middle of a word's interval, exact in f32: never on the rim, where a cosine would be 0, nor in the centre.
    let [a, b] = u.map(|u| 2.0 * u - 1.0 + HALF_STEP);
    // One octant, then reflections: which triangle of the square it is would be a branch on a coin toss.
    let wide = a.abs() > b.abs();
    let (r, minor) = if wide { (a.abs(), b.abs()) } else { (b.abs(), a.abs()) };
    let (s, c) = sin_cos_eighth(0.125 * (minor / if r == 0.0 { 1.0 } else { r }));
    let (along, across) = (r * c, r * s);
    let (x, y) = if wide { (along, across) } else { (across, along) };
    (Vec2::new(x.copysign(a), y.copysign(b)), r)
}

/// Uniform point of the unit disk.
#[inline(always)]
pub fn sample_uniform_disk(u: [f32; 2]) -> Vec2 {
    concentric(u).0
}

/// 1/π.
#[inline(always)]
pub fn uniform_disk_pdf() -> f32 {
    FRAC_1_PI
}

/// Inverse of [`sample_uniform_disk`].
pub fn invert_uniform_disk(v: Vec2) -> [f32; 2] {
    let r = v.length();
    let (a, b) = if r == 0.0 {
        (0.0, 0.0)
    } else if v.x.abs() > v.y.abs() {
        let a = r.copysign(v.x);
        (a, a * (atan2(v.y / v.x, 1.0) * (8.0 / TAU)))
    } else {
        let b = r.copysign(v.y);
        (b * (atan2(v.x / v.y, 1.0) * (8.0 / TAU)), b)
    };
    [a, b].map(|a| (a - HALF_STEP + 1.0) / 2.0)
}

/// Direction around +z with density cos θ/π: a uniform point of the disk, lifted (Malley's method).
#[inline(always)]
pub fn sample_cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let (d, r) = concentric(u);
    Vec3::new(d.x, d.y, ((1.0 - r) * (1.0 + r)).sqrt())
}

/// cos θ/π sr⁻¹.
#[inline(always)]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Inverse of [`sample_cosine_hemisphere`].
pub fn invert_cosine_hemisphere(v: Vec3) -> [f32; 2] {
    invert_uniform_disk(Vec2::new(v.x, v.y))
}

/// Uniform direction in the cone around +z with `height` = 1 − cos θmax, which stays precise for narrow cones.
#[inline(always)]
pub fn sample_uniform_cone(u: [f32; 2], height: f32) -> Vec3 {
    let h = u[0] * height;
    let r = (h * (2.0 - h)).sqrt();
    let (s, c) = sin_cos_turns(u[1]);
    Vec3::new(r * c, r * s, 1.0 - h)
}

/// 1/(2π(1 − cos θmax)) sr⁻¹.
#[inline(always)]
pub fn uniform_cone_pdf(height: f32) -> f32 {
    1.0 / (TAU * height)
}

/// Inverse of [`sample_uniform_cone`].
pub fn invert_uniform_cone(v: Vec3, height: f32) -> [f32; 2] {
    let h = if v.z > 0.0 { (v.x * v.x + v.y * v.y) / (1.0 + v.z) } else { 1.0 - v.z };
    [h / height, turns(v.x, v.y)]
}

/// Uniform point of a triangle: the weights of vertices 1 and 2. Source: Heitz, "A low-distortion map between triangle and
/// square", 2019.
#[inline(always)]
pub fn sample_uniform_triangle(u: [f32; 2]) -> [f32; 2] {
    if u[1] > u[0] {
        let b = 0.5 * u[0];
        [b, u[1] - b]
    } else {
        let b = 0.5 * u[1];
        [u[0] - b, b]
    }
}

/// 2: the density of the two weights.
#[inline(always)]
pub fn uniform_triangle_pdf() -> f32 {
    2.0
}

/// Inverse of [`sample_uniform_triangle`].
pub fn invert_uniform_triangle(b: [f32; 2]) -> [f32; 2] {
    if b[1] > b[0] { [2.0 * b[0], b[1] + b[0]] } else { [b[0] + b[1], 2.0 * b[1]] }
}

/// Point of (−1, 1) with density 1 − |x|.
#[inline(always)]
pub fn sample_tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() }
}

/// 1 − |x|, 0 outside.
#[inline(always)]
pub fn tent_pdf(x: f32) -> f32 {
    (1.0 - x.abs()).max(0.0)
}

/// Inverse of [`sample_tent`].
pub fn invert_tent(x: f32) -> f32 {
    if x < 0.0 { 0.5 * (1.0 + x) * (1.0 + x) } else { 1.0 - 0.5 * (1.0 - x) * (1.0 - x) }
}

/// Where the Gaussian is cut, in standard deviations.
const CUT: f64 = 4.0;

/// exp(−y) for 0 ≤ y ≤ 8 without libm: Taylor's series at y/256, squared eight times.
fn exp_neg(y: f64) -> f64 {
    let t = -y / 256.0;
    let mut e = (1..=10).rev().fold(1.0, |e, k| 1.0 + e * t / f64::from(k));
    for _ in 0..8 {
        e *= e;
    }
    e
}

/// The lowered Gaussian in units of its standard deviation, not normalised.
fn lowered(x: f64) -> f64 {
    (exp_neg(x * x / 2.0) - exp_neg(CUT * CUT / 2.0)).max(0.0)
}

/// Intervals of the table of quantiles.
const CELLS: usize = 1024;

/// Quantiles of |x|: entry j belongs to the tail probability (j/CELLS)². Taking the root makes the quantile smooth up to the
/// cut, where the density falls linearly to 0; and the integral of the lowered Gaussian from 0 to the cut.
static QUANTILES: LazyLock<(Vec<f32>, f32)> = LazyLock::new(|| {
    const STEPS: usize = 1 << 14;
    let width = CUT / STEPS as f64;
    // Tail integrals from the cut inwards, by Simpson's rule.
    let mut tail = vec![0.0; STEPS + 1];
    for i in (0..STEPS).rev() {
        let x = i as f64 * width;
        let simpson = lowered(x) + 4.0 * lowered(x + width / 2.0) + lowered(x + width);
        tail[i] = tail[i + 1] + simpson * width / 6.0;
    }
    let mut i = STEPS;
    let quantiles = (0..=CELLS).map(|j| {
        let wanted = (j as f64 / CELLS as f64).powi(2) * tail[0];
        while i > 0 && tail[i] < wanted {
            i -= 1;
        }
        // Inside a step the roots of the tail integrals are close to linear.
        let (outer, inner) = (tail[(i + 1).min(STEPS)].sqrt(), tail[i].sqrt());
        let part = if inner > outer { ((wanted.sqrt() - outer) / (inner - outer)).min(1.0) } else { 0.0 };
        (((i + 1).min(STEPS) as f64 - part) * width) as f32
    });
    (quantiles.collect(), tail[0] as f32)
});

/// The table that [`sample_gaussian`] reads: quantiles of |x|, entry j belonging to the tail probability (j/1024)².
pub fn gaussian_quantiles() -> &'static [f32] {
    &QUANTILES.0
}

/// Point of (−4, 4) with density proportional to exp(−x²/2) − exp(−8): Mitsuba's Gaussian filter in standard deviations.
/// A table of quantiles with linear interpolation: the probability of each of its 2 × 1024 cells is exact, and so is, to
/// 1e-6, every moment.
#[inline]
pub fn sample_gaussian(u: f32) -> f32 {
    let (quantiles, _) = &*QUANTILES;
    let tail = if u < 0.5 { 2.0 * u } else { 2.0 - 2.0 * u };
    let w = tail.sqrt() * CELLS as f32;
    let j = (w as usize).min(CELLS - 1);
    let x = quantiles[j] + (quantiles[j + 1] - quantiles[j]) * (w - j as f32);
    if u < 0.5 { -x } else { x }
}

/// Density of [`sample_gaussian`].
pub fn gaussian_pdf(x: f32) -> f32 {
    if f64::from(x.abs()) < CUT { lowered(f64::from(x)) as f32 / (2.0 * QUANTILES.1) } else { 0.0 }
}

/// Inverse of [`sample_gaussian`].
pub fn invert_gaussian(x: f32) -> f32 {
    let (quantiles, _) = &*QUANTILES;
    let j = quantiles.partition_point(|&q| q > x.abs()).clamp(1, CELLS);
    let w = (j - 1) as f32 + (quantiles[j - 1] - x.abs()) / (quantiles[j - 1] - quantiles[j]);
    let tail = (w / CELLS as f32).powi(2);
    if x < 0.0 { 0.5 * tail } else { 1.0 - 0.5 * tail }
}
