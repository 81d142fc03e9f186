//! How much light passes interfaces: means over directions that have no closed form.

use super::fresnel;
use super::microfacet::{Microfacets, mirrored};
use crate::math::Vec3;

/// Intervals of a table.
const CELLS: usize = 63;
/// Points of the quadratures per dimension.
const POINTS: u32 = 64;

/// Share of light that passes a rough interface, by the cosine of the direction that it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmittance(pub(crate) [f32; CELLS + 1]);

impl Transmittance {
    /// `eta`: index of refraction behind the interface over that before it.
    pub fn new(facets: &Microfacets, eta: f32) -> Self {
        Self(std::array::from_fn(|i| 1.0 - reflectance(facets, eta, (i as f32 / CELLS as f32).max(1e-4)) as f32))
    }

    /// Interpolated; `cos` in \[0, 1\].
    #[inline(always)]
    pub fn at(&self, cos: f32) -> f32 {
        let x = cos * CELLS as f32;
        let i = (x as usize).min(CELLS - 1);
        self.0[i] + (self.0[i + 1] - self.0[i]) * (x - i as f32)
    }
}

/// Share of diffuse light that a smooth interface reflects: 2 ∫ R(μ) μ dμ.
pub fn diffuse_reflectance(eta: f32) -> f32 {
    // In the angle, R has no square root at the critical angle's other side; many midpoints do the rest.
    let steps = 1 << 14;
    let share = |i: u32| {
        let (sin, cos) = ((f64::from(i) + 0.5) / f64::from(steps) * std::f64::consts::FRAC_PI_2).sin_cos();
        f64::from(fresnel::dielectric(cos as f32, eta).0) * sin * cos
    };
    let step = std::f64::consts::FRAC_PI_2 / f64::from(steps);
    (2.0 * step * (0..steps).map(share).sum::<f64>()) as f32
}

/// Share of diffuse light that a rough interface reflects.
pub fn diffuse_rough_reflectance(facets: &Microfacets, eta: f32) -> f32 {
    let mean = |i: u32| {
        let cos = (i as f32 + 0.5) / POINTS as f32;
        reflectance(facets, eta, cos) * f64::from(cos)
    };
    (2.0 / f64::from(POINTS) * (0..POINTS).map(mean).sum::<f64>()) as f32
}

/// Share of light from the direction with this cosine that a rough interface reflects: the mean over the normals that it sees.
fn reflectance(facets: &Microfacets, eta: f32, cos: f32) -> f64 {
    let wo = Vec3::new(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
    let mut sum = 0.0;
    for i in 0..POINTS * POINTS {
        let word = |k: u32| (2 * k + 1) * (u32::MAX / (2 * POINTS));
        let m = facets.sample_visible(wo, [word(i / POINTS), word(i % POINTS), 0, 0]);
        let wi = mirrored(wo, m);
        if wi.z > 0.0 {
            let (r, _) = fresnel::dielectric(wo.dot(m).max(0.0), eta);
            sum += f64::from(r * facets.shadowing(wi) * wi.z);
        }
    }
    sum / f64::from(POINTS * POINTS)
}
