//! Integrals over the unit cube with known values: the harness's touchstone, and the quickest way to see what it does.

use super::{Cell, Estimate, Estimator, Shape, dependence_of, estimate_by_samples, is_progressive};
use crate::error::Result;
use crate::record::Dependence;
use crate::sampling::dimension::{Decision, group};
use crate::sampling::rng::{philox4x32, unit_f64};
use crate::sampling::{Draw, Sequence};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A function on \[0, 1\]ᵈ whose integral and variance are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Integrand {
    /// f = 1 in one dimension: zero variance.
    Constant,
    /// f = x.
    Linear,
    /// f = exp(−x²−y²) in two dimensions.
    #[serde(rename = "gaussian-2d")]
    Gaussian2d,
    /// f = 1 where x < 0.3, else 0.
    Step,
    /// f = 4 inside the quarter disc x² + y² < 1, else 0: integral π.
    Disc,
    /// Genz's product peak in six dimensions, f = Π 1/(a² + (xᵢ − ½)²) with a = ½, scaled to integrate to 1.
    #[serde(rename = "product-peak-6d")]
    ProductPeak6d,
    /// f = x^(−¼) in one dimension: unbounded, finite variance.
    Root,
    /// f = 1/√x: integral 2, infinite variance (∫ f² = ∫ 1/x).
    InverseSqrt,
    /// f = 1000 where x < 1/1000, else 0: integral 1, variance 999.
    Spike,
}

impl Integrand {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Constant,
        Self::Linear,
        Self::Gaussian2d,
        Self::Step,
        Self::Disc,
        Self::ProductPeak6d,
        Self::Root,
        Self::InverseSqrt,
        Self::Spike,
    ];

    /// Name in files and tables.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Linear => "linear",
            Self::Gaussian2d => "gaussian-2d",
            Self::Step => "step",
            Self::Disc => "disc",
            Self::ProductPeak6d => "product-peak-6d",
            Self::Root => "root",
            Self::InverseSqrt => "inverse-sqrt",
            Self::Spike => "spike",
        }
    }

    /// Number of dimensions.
    pub const fn dimensions(self) -> usize {
        match self {
            Self::Gaussian2d | Self::Disc => 2,
            Self::ProductPeak6d => 6,
            _ => 1,
        }
    }

    /// The function at u ∈ (0, 1)ᵈ.
    pub fn eval(self, u: &[f64]) -> f64 {
        let indicator = |inside: bool, value: f64| if inside { value } else { 0.0 };
        match self {
            Self::Constant => 1.0,
            Self::Linear => u[0],
            Self::Gaussian2d => (-u[0] * u[0] - u[1] * u[1]).exp(),
            Self::Step => indicator(u[0] < 0.3, 1.0),
            Self::Disc => indicator(u[0] * u[0] + u[1] * u[1] < 1.0, 4.0),
            // ∫₀¹ 1/(¼ + (x−½)²) dx = 4·atan 1 = π.
            Self::ProductPeak6d => {
                u.iter().map(|x| 1.0 / (std::f64::consts::PI * (0.25 + (x - 0.5) * (x - 0.5)))).product()
            }
            Self::Root => u[0].powf(-0.25),
            Self::InverseSqrt => 1.0 / u[0].sqrt(),
            Self::Spike => indicator(u[0] < 1e-3, 1000.0),
        }
    }

    /// The integral.
    pub fn integral(self) -> f64 {
        match self {
            Self::Constant | Self::ProductPeak6d | Self::Spike => 1.0,
            Self::Linear => 0.5,
            Self::Gaussian2d => GAUSS * GAUSS,
            Self::Step => 0.3,
            Self::Disc => std::f64::consts::PI,
            Self::Root => 4.0 / 3.0,
            Self::InverseSqrt => 2.0,
        }
    }

    /// The variance of f(U); infinite for [`Self::InverseSqrt`].
    pub fn variance(self) -> f64 {
        let pi = std::f64::consts::PI;
        match self {
            Self::Constant => 0.0,
            Self::Linear => 1.0 / 12.0,
            Self::Gaussian2d => GAUSS_SQUARED * GAUSS_SQUARED - (GAUSS * GAUSS).powi(2),
            Self::Step => 0.21,
            Self::Disc => 4.0 * pi - pi * pi,
            // ∫₀¹ (¼ + (x−½)²)⁻² dx = 4 + 2π.
            Self::ProductPeak6d => ((4.0 + 2.0 * pi) / (pi * pi)).powi(6) - 1.0,
            Self::Root => 2.0 - 16.0 / 9.0,
            Self::InverseSqrt => f64::INFINITY,
            Self::Spike => 999.0,
        }
    }
}

/// ∫₀¹ exp(−x²) dx = (√π/2) erf 1.
const GAUSS: f64 = 0.746_824_132_812_427;
/// ∫₀¹ exp(−2x²) dx = (√(π/2)/2) erf √2.
const GAUSS_SQUARED: f64 = 0.598_144_007_120_823_5;

/// A field of independent estimates of one integral.
#[derive(Clone, Copy, Debug)]
pub struct IntegrandEstimator {
    /// What is integrated.
    pub integrand: Integrand,
    /// Columns and rows of the field: that many estimates side by side.
    pub size: [usize; 2],
    /// How points are arranged.
    pub sequence: Sequence,
}

impl Estimator for IntegrandEstimator {
    fn shape(&self) -> Shape {
        Shape { width: self.size[0], height: self.size[1], channels: 1 }
    }

    fn identity(&self) -> String {
        format!("integrand {} on {:?}, {:?}", self.integrand.label(), self.size, self.sequence)
    }

    fn dependence(&self) -> Dependence {
        dependence_of(self.sequence)
    }

    fn progressive(&self) -> bool {
        is_progressive(self.sequence)
    }

    fn estimate(&self, cell: &Cell, checkpoint: u64, previous: &mut Option<Estimate>) -> Result<Estimate> {
        let d = self.integrand.dimensions();
        Ok(estimate_by_samples(self.shape(), self.sequence, cell, checkpoint, previous, |draw, out| {
            let mut u = [0.0; 8];
            point(draw, &mut u[..d]);
            out[0] = self.integrand.eval(&u[..d]);
        }))
    }
}

/// A point of the sequence in (0, 1)ᵈ with 53 bits: the sequence gives the leading 32 of each coordinate, and fresh
/// random digits follow, as scrambling or jittering would give them. Coordinates are taken in pairs, which are cells of a
/// grid for stratified points; four at a time they are one Sobol point. A single coordinate is word 2 of its group:
/// stratified points have strata of their own there.
pub(super) fn point(draw: &Draw, u: &mut [f64]) {
    for (pair, u) in (0u32..).zip(u.chunks_mut(2)) {
        let vertex = pair / 2;
        let group = match pair % 2 {
            0 => group(vertex, Decision::Direction),
            _ => group(vertex + 1, Decision::Light),
        };
        let words = draw.words(group);
        let below =
            philox4x32([draw.pixel, draw.sample as u32, (draw.sample >> 32) as u32, group | LOW_BITS], draw.key);
        let first = if u.len() == 1 { 2 } else { 0 };
        for ((u, hi), lo) in u.iter_mut().zip(&words[first..]).zip(&below[first..]) {
            *u = unit_f64(*hi, *lo);
        }
    }
}

/// Marks the counters of trailing digits, apart from every group.
const LOW_BITS: u32 = 0x4000_0000;
