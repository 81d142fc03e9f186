//! Rough surfaces as fields of microfacets: distribution, shadowing, and drawing of the normals that are visible.
//!
//! Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007; anisotropy and visible normals: Heitz,
//! "Understanding the masking-shadowing function in microfacet-based BRDFs", JCGT 3(2), 2014. Shadowing is Smith's, for both
//! directions independently (separable), as in Mitsuba. Directions are in the local frame of the material, normals point up.

use crate::math::special::{FRAC_1_SQRT_PI, erf, erf_inv, erfcx, exp_neg, ln};
use crate::math::trig::sin_cos_turns;
use crate::math::{Vec3, warp};
use crate::sampling::rng::unit_f32;
use crate::sampling::strategy::Directions;
use std::f32::consts::PI;

/// Distribution of the microfacets' slopes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Trowbridge and Reitz, long tails.
    Ggx,
    /// Gaussian slopes.
    Beckmann,
}

/// Smallest and largest roughness α: below, floats do not hold what happens within a highlight.
pub(crate) const ROUGHNESS: std::ops::RangeInclusive<f32> = 1e-4..=100.0;

/// Microfacets with roughness α along the local x and y axes (root-mean-square slope times √2 for [`Distribution::Beckmann`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets<S = f32> {
    /// Distribution of slopes.
    pub distribution: Distribution,
    /// Roughness along x and y, between 1e-4 and 100.
    pub alpha: [S; 2],
}

impl<S> Microfacets<S> {
    /// With other numbers.
    #[inline(always)]
    pub fn map<T>(&self, number: impl Fn(&S) -> T) -> Microfacets<T> {
        Microfacets { distribution: self.distribution, alpha: self.alpha.each_ref().map(number) }
    }
}

/// What a lobe is made of, for one pair of directions.
#[derive(Clone, Copy)]
pub(super) struct Half {
    /// Density of the normal over projected area, sr⁻¹.
    pub(super) d: f32,
    /// Shadowing towards `wo` over cos θo.
    pub(super) visible_o: f32,
    /// Shadowing towards `wi`.
    pub(super) g_i: f32,
    /// Cosines between the normal and `wo`, > 0, and `wi`, < 0 for refraction.
    pub(super) cos_o: f32,
    pub(super) cos_i: f32,
    /// |wo + η wi|², the square of cos_o + η cos_i.
    pub(super) length2: f32,
}

impl Microfacets {
    /// The microfacets that send light from `wi` to `wo`. `eta`: index of the other side over that of `wo`; 1 where `wi` is on the
    /// side of `wo`. `None` where there are none.
    #[inline(always)]
    pub(super) fn half(&self, wo: Vec3, wi: Vec3, eta: f32) -> Option<Half> {
        let across = wo + wi * eta;
        let length = across.length();
        if !(length > 0.0 && wo.z > 0.0) {
            return None;
        }
        // Refraction into the denser side bends the half vector down.
        let m = across / if across.z < 0.0 { -length } else { length };
        let (cos_o, cos_i) = (wo.dot(m), wi.dot(m));
        let faces = cos_o > 0.0 && if wi.z > 0.0 { cos_i > 0.0 } else { cos_i < 0.0 };
        faces.then(|| Half {
            d: self.density(m),
            visible_o: self.shadowing(wo),
            g_i: self.shadowing(wi) * wi.z.abs(),
            cos_o,
            cos_i,
            length2: length * length,
        })
    }

    /// D(m), sr⁻¹; ∫ D(m) cos θm dm = 1 over the hemisphere.
    #[inline(always)]
    pub(super) fn density(&self, m: Vec3) -> f32 {
        let [ax, ay] = self.alpha;
        let (x, y) = (m.x / ax, m.y / ay);
        let (slope2, z2) = (x * x + y * y, m.z * m.z);
        match self.distribution {
            Distribution::Ggx => {
                let s = slope2 + z2;
                1.0 / (PI * ax * ay * s * s)
            }
            Distribution::Beckmann => {
                let e = exp_neg(slope2 / z2);
                if e > 0.0 { e / (PI * ax * ay * z2 * z2) } else { 0.0 }
            }
        }
    }

    /// Smith's G₁(v) over |cos θv|: finite at grazing angles.
    #[inline(always)]
    pub(super) fn shadowing(&self, v: Vec3) -> f32 {
        let (x, y, z) = (v.x * self.alpha[0], v.y * self.alpha[1], v.z.abs());
        let s2 = x * x + y * y;
        match self.distribution {
            Distribution::Ggx => 2.0 / (z + (z * z + s2).sqrt()),
            // 1/(z(1 + Λ)), Λ = (exp(−a²)/(a√π) − erfc a)/2, a = z/s.
            Distribution::Beckmann => {
                let s = s2.sqrt();
                let a = z / s;
                1.0 / (z + 0.5 * exp_neg(a * a) * (s * FRAC_1_SQRT_PI - z * erfcx(a)))
            }
        }
    }

    /// A normal that `wo` sees, with density G₁(wo) D(m) (wo·m)/cos θo, sr⁻¹.
    #[inline(always)]
    pub(super) fn sample_visible(&self, wo: Vec3, words: [u32; 4]) -> Vec3 {
        let u = [unit_f32(words[0]), unit_f32(words[1])];
        let [ax, ay] = self.alpha;
        let v = Vec3::new(wo.x * ax, wo.y * ay, wo.z);
        let v = v / v.length();
        match self.distribution {
            Distribution::Ggx => {
                // The hemisphere of mirrored directions is a cap of the sphere: Dupuy and Benyoub, "Sampling visible GGX
                // normals with spherical caps", HPG 2023.
                let z = (1.0 - u[1]) * (1.0 + v.z) - v.z;
                let r2 = (1.0 - z) * (1.0 + z);
                let r = if r2 > 0.0 { r2.sqrt() } else { 0.0 };
                let (s, c) = sin_cos_turns(u[0]);
                upright(ax * (r * c + v.x), ay * (r * s + v.y), z + v.z)
            }
            Distribution::Beckmann => {
                let sin2 = v.x * v.x + v.y * v.y;
                let sin = sin2.sqrt();
                let (c, s) = if sin > 0.0 { (v.x / sin, v.y / sin) } else { (1.0, 0.0) };
                let [along, across] = visible_slopes(sin / v.z, v.z / sin, u);
                upright(-ax * (c * along - s * across), -ay * (s * along + c * across), 1.0)
            }
        }
    }
}

/// A unit normal, above the horizon even where its components underflow.
#[inline(always)]
fn upright(x: f32, y: f32, z: f32) -> Vec3 {
    let m = Vec3::new(x, y, if z > 0.0 { z } else { 0.0 });
    let length = m.length();
    if length > 0.0 { m / length } else { Vec3::Z }
}

/// Slopes of unit roughness, seen under the angle with this tangent and cotangent: towards the eye and across. Jakob, "An improved
/// visible normal sampling routine for the Beckmann distribution", 2014: Newton's method on the distribution function of the
/// first in the variable erf(slope), here kept in its bracket.
#[inline(always)]
fn visible_slopes(tan: f32, cot: f32, u: [f32; 2]) -> [f32; 2] {
    let u = u.map(|u| if u > SMALLEST { u } else { SMALLEST });
    let scale = tan * FRAC_1_SQRT_PI;
    let largest = erf(cot);
    let largest = if largest < LARGEST { largest } else { LARGEST };
    let target = u[0] * (1.0 + largest + scale * exp_neg(cot * cot));
    let (mut low, mut high) = (-LARGEST, largest);
    let mut x = largest - (1.0 + largest) * erf((-ln(u[0])).sqrt());
    for _ in 0..STEPS {
        x = if x >= low && x <= high { x } else { 0.5 * (low + high) };
        let slope = erf_inv(x);
        let value = 1.0 + x + scale * exp_neg(slope * slope) - target;
        if value > 0.0 {
            high = x;
        } else {
            low = x;
        }
        x -= value / (1.0 - slope * tan);
    }
    x = if x >= low && x <= high { x } else { 0.5 * (low + high) };
    let across = 2.0 * u[1] - 1.0;
    [erf_inv(x), erf_inv(across)]
}

/// Of the steps of floats in [0, 1) half of one.
const SMALLEST: f32 = 1.0 / 33_554_432.0;
/// Largest value whose inverse error function is taken.
const LARGEST: f32 = 1.0 - 1.0 / 8_388_608.0;
/// Steps of Newton's method.
const STEPS: usize = 6;

/// Density, sr⁻¹, of directions that do not follow the BSDF, over one hemisphere or `both`.
#[inline(always)]
pub(super) fn other_pdf(directions: Directions, wi: Vec3, both: bool) -> f32 {
    let pdf = match directions {
        Directions::Uniform => warp::uniform_hemisphere_pdf(),
        Directions::Cosine | Directions::Bsdf => warp::cosine_hemisphere_pdf(wi.z.abs()),
    };
    if both { 0.5 * pdf } else { pdf }
}

/// `wo` mirrored at the normal `m`.
#[inline(always)]
pub(super) fn mirrored(wo: Vec3, m: Vec3) -> Vec3 {
    m * (2.0 * wo.dot(m)) - wo
}
