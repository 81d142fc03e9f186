//! Multiple importance sampling weights in overflow-safe ratio form.
//!
//! Source: Veach, "Robust Monte Carlo methods for light transport simulation", 1997, §9.2.

use super::strategy::Heuristic;
use crate::math::LANES;

/// Share of the largest density below which [`Heuristic::Cutoff`] counts a density as 0.
const CUTOFF: f32 = 0.1;

/// Ratio of densities from which [`Heuristic::Maximum`] takes them for equal. Where two techniques have the same density
/// everywhere (inside a sphere that emits: cosine and area), rounding would decide for each technique on its own, and the
/// weights of a path would not add up to 1.
const TIE: f32 = 1.0 - 1.0 / 1024.0;

impl Heuristic {
    /// Weight of a sample that was drawn with density `p` and could have been drawn with density `q` by the other technique
    /// (same measure). In \[0, 1\] for all p, q in \[0, ∞\]; `w(p, q) + w(q, p)` = 1 up to rounding, except for
    /// [`Heuristic::None`], whose weight is 1: there the caller makes sure that only one technique reaches a path.
    #[inline(always)]
    pub fn weight(self, p: f32, q: f32) -> f32 {
        // Equal densities first: 0/0 and ∞/∞ have no ratio.
        let r = if p == q { 1.0 } else { q / p };
        match self {
            Self::None => 1.0,
            Self::Balance => 1.0 / (1.0 + r),
            Self::Power => 1.0 / (1.0 + r * r),
            Self::Cutoff if p < CUTOFF * q => 0.0,
            Self::Cutoff if q < CUTOFF * p => 1.0,
            Self::Cutoff => 1.0 / (1.0 + r),
            Self::Maximum if p.min(q) >= TIE * p.max(q) => 0.5,
            Self::Maximum => f32::from(u8::from(p > q)),
        }
    }

    /// [`Self::weight`] for lanes.
    #[inline(always)]
    pub fn weights(self, p: &[f32; LANES], q: &[f32; LANES]) -> [f32; LANES] {
        // One loop for each heuristic, so that each can become vector code.
        #[inline(always)]
        fn each(heuristic: Heuristic, p: &[f32; LANES], q: &[f32; LANES]) -> [f32; LANES] {
            let mut weights = [0.0; LANES];
            for lane in 0..LANES {
                weights[lane] = heuristic.weight(p[lane], q[lane]);
            }
            weights
        }
        match self {
            Self::None => each(Self::None, p, q),
            Self::Balance => each(Self::Balance, p, q),
            Self::Power => each(Self::Power, p, q),
            Self::Cutoff => each(Self::Cutoff, p, q),
            Self::Maximum => each(Self::Maximum, p, q),
        }
    }
}
