//! Estimators of known integrals with bugs in how samples are arranged, keyed or summed up.

use rootn::estimator::integrand::{Integrand, IntegrandEstimator};
use rootn::estimator::{Cell, Estimate, Estimator, Shape, estimate_by_samples};
use rootn::record::Dependence;
use rootn::sampling::rng::{Key, unit_f64};
use rootn::sampling::{Draw, Sequence};

/// What is wrong with an estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wrong {
    /// Nothing.
    Nothing,
    /// Every replicate has the same key.
    SharedKey,
    /// Sobol points are said to be independent.
    SobolIndependent,
    /// Sample i falls into stratum i + 1; the last one twice.
    NextStratum,
    /// Strata as they should be.
    OwnStratum,
    /// The sum is kept in half precision.
    HalfSum,
    /// The sum is kept in double precision, sample by sample.
    DoubleSum,
}

/// Estimates of an integral, side by side.
pub(crate) struct Number {
    integrand: IntegrandEstimator,
    wrong: Wrong,
}

impl Number {
    pub(crate) fn new(integrand: Integrand, wrong: Wrong) -> Self {
        let sequence = if wrong == Wrong::SobolIndependent { Sequence::Sobol } else { Sequence::Independent };
        Self { integrand: IntegrandEstimator { integrand, size: [16, 16], sequence }, wrong }
    }

    fn own_strata(&self) -> bool {
        matches!(self.wrong, Wrong::NextStratum | Wrong::OwnStratum)
    }

    /// Strata of one's own making, on a line.
    fn stratified(&self, cell: &Cell, n: u64) -> Estimate {
        let shift = u64::from(self.wrong == Wrong::NextStratum);
        estimate_by_samples(self.shape(), Sequence::Independent, cell, n, &mut None, |draw, out| {
            let words = draw.words(0);
            let stratum = (draw.sample + shift).min(n - 1);
            out[0] = self.integrand.integrand.eval(&[(stratum as f64 + unit_f64(words[0], words[1])) / n as f64]);
        })
    }

    /// One sum per value.
    fn summed(&self, cell: &Cell, n: u64) -> Estimate {
        let round = if self.wrong == Wrong::HalfSum { half } else { |x| x };
        let start = std::time::Instant::now();
        let sum = |pixel| {
            let sample = |sample| {
                let draw = Draw { key: cell.key, pixel, sample, length: n, sequence: Sequence::Independent };
                let words = draw.words(0);
                self.integrand.integrand.eval(&[unit_f64(words[0], words[1]), unit_f64(words[2], words[3])])
            };
            (0..n).fold(0.0, |sum, i| round(sum + sample(i))) / n as f64
        };
        let field = (0..self.shape().pixels() as u32).map(sum).collect();
        let seconds = start.elapsed().as_secs_f64();
        Estimate { field, moments: None, abscissa: n, seconds, wall_seconds: seconds }
    }
}

/// The nearest number with eleven significant bits.
fn half(x: f64) -> f64 {
    if x == 0.0 {
        return x;
    }
    let step = 2f64.powi(x.abs().log2().floor() as i32 - 10);
    (x / step).round_ties_even() * step
}

impl Estimator for Number {
    fn shape(&self) -> Shape {
        self.integrand.shape()
    }

    fn identity(&self) -> String {
        format!("{:?} of {}", self.wrong, self.integrand.identity())
    }

    fn dependence(&self) -> Dependence {
        if self.own_strata() { Dependence::Dependent } else { Dependence::Independent }
    }

    fn progressive(&self) -> bool {
        !self.own_strata()
    }

    fn estimate(&self, cell: &Cell, n: u64, previous: &mut Option<Estimate>) -> rootn::Result<Estimate> {
        match self.wrong {
            Wrong::NextStratum | Wrong::OwnStratum => Ok(self.stratified(cell, n)),
            Wrong::HalfSum | Wrong::DoubleSum => Ok(self.summed(cell, n)),
            Wrong::SharedKey => self.integrand.estimate(&Cell { key: Key([1, 2]), ..*cell }, n, previous),
            Wrong::Nothing | Wrong::SobolIndependent => self.integrand.estimate(cell, n, previous),
        }
    }
}
