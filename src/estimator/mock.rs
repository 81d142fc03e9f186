//! Estimators of nothing: samples of a known distribution, seconds by a formula. What statistics, claims and reports say can
//! be held against the truth, and is the same on every machine.

use super::{Cell, Estimate, Estimator, Shape, dependence_of, estimate_by_samples};
use crate::error::Result;
use crate::record::Dependence;
use crate::sampling::Sequence;
use crate::sampling::rng::{Key, philox4x32, unit_f64};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

/// The mean of every distribution.
pub const MEAN: f64 = 1.0;

/// The distribution of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// Normal with standard deviation ½.
    Normal,
    /// Exponential: skewness 2, kurtosis 9.
    Exponential,
    /// 50 with probability 2 %, else 0: kurtosis 48.
    Bernoulli,
    /// exp(z − ½), z standard normal: kurtosis 114.
    LogNormal,
    /// Pareto with exponent 3: finite variance, infinite fourth moment.
    #[serde(rename = "pareto-3")]
    Pareto3,
    /// Pareto with exponent 1.5: infinite variance.
    #[serde(rename = "pareto-1.5")]
    Pareto1_5,
}

impl Distribution {
    /// Name in files and tables.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Exponential => "exponential",
            Self::Bernoulli => "bernoulli",
            Self::LogNormal => "log-normal",
            Self::Pareto3 => "pareto-3",
            Self::Pareto1_5 => "pareto-1.5",
        }
    }

    /// The sample that stands at u ∈ (0, 1): large where u is small.
    fn sample(self, u: f64) -> f64 {
        let z = |u: f64| -Normal::standard().inverse_cdf(u);
        let pareto = |exponent: f64| (exponent - 1.0) / exponent * u.powf(-1.0 / exponent);
        match self {
            Self::Normal => 1.0 + 0.5 * z(u),
            Self::Exponential => -u.ln(),
            Self::Bernoulli => f64::from(u8::from(u < 0.02)) * 50.0,
            Self::LogNormal => (z(u) - 0.5).exp(),
            Self::Pareto3 => pareto(3.0),
            Self::Pareto1_5 => pareto(1.5),
        }
    }

    /// Variance of a sample.
    pub const fn variance(self) -> f64 {
        match self {
            Self::Normal => 0.25,
            Self::Exponential => 1.0,
            Self::Bernoulli => 49.0,
            Self::LogNormal => std::f64::consts::E - 1.0,
            Self::Pareto3 => 1.0 / 3.0,
            Self::Pareto1_5 => f64::INFINITY,
        }
    }
}

/// How one mock differs from another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Knobs {
    /// Another distribution than the scene's.
    pub distribution: Option<Distribution>,
    /// Deviations from the mean are multiplied by this: the variance by its square.
    pub spread: f64,
    /// Added to every sample.
    pub bias: f64,
    /// Seconds per sample and value.
    pub seconds: f64,
    /// Standard deviation of the logarithm of a replicate's seconds.
    pub jitter: f64,
}

impl Default for Knobs {
    fn default() -> Self {
        Self { distribution: None, spread: 1.0, bias: 0.0, seconds: 1e-6, jitter: 0.02 }
    }
}

impl Knobs {
    /// What is wrong with them, if anything.
    pub fn check(&self) -> std::result::Result<(), String> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let allowed = [
            ("spread", self.spread, positive(self.spread), "a positive number"),
            ("bias", self.bias, self.bias.is_finite(), "a finite number"),
            ("seconds", self.seconds, positive(self.seconds), "a positive number"),
            ("jitter", self.jitter, (0.0..=1.0).contains(&self.jitter), "0 to 1"),
        ];
        match allowed.into_iter().find(|(_, _, good, _)| !good) {
            Some((key, found, _, allowed)) => Err(format!("mock.{key} = {found}: {allowed} is allowed")),
            None => Ok(()),
        }
    }
}

/// A field of samples of a distribution.
#[derive(Clone, Copy, Debug)]
pub struct Mock {
    /// Of what.
    pub distribution: Distribution,
    /// How they differ from it.
    pub knobs: Knobs,
    /// Columns and rows of the field.
    pub size: [usize; 2],
    /// How the samples of a value are arranged.
    pub sequence: Sequence,
}

impl Mock {
    /// Seconds of `samples` per value in the replicate of a key.
    fn seconds(&self, key: Key, samples: u64) -> f64 {
        let words = philox4x32([0, 0, 0, CLOCK], key);
        let z = Normal::standard().inverse_cdf(unit_f64(words[0], words[1]));
        let values = self.shape().values() as f64;
        self.knobs.seconds * values * samples as f64 * (self.knobs.jitter * z).exp()
    }
}

impl Estimator for Mock {
    fn shape(&self) -> Shape {
        Shape { width: self.size[0], height: self.size[1], channels: 1 }
    }

    fn identity(&self) -> String {
        format!("mock {} {:?} on {:?}, {:?}", self.distribution.label(), self.knobs, self.size, self.sequence)
    }

    fn dependence(&self) -> Dependence {
        dependence_of(self.sequence)
    }

    fn progressive(&self) -> bool {
        super::is_progressive(self.sequence)
    }

    fn is_timed(&self) -> bool {
        false
    }

    fn estimate(&self, cell: &Cell, checkpoint: u64, previous: &mut Option<Estimate>) -> Result<Estimate> {
        let Knobs { spread, bias, .. } = self.knobs;
        let estimate = estimate_by_samples(self.shape(), self.sequence, cell, checkpoint, previous, |draw, out| {
            let mut u = [0.0];
            super::integrand::point(draw, &mut u);
            out[0] = MEAN + bias + spread * (self.distribution.sample(u[0]) - MEAN);
        });
        let seconds = self.seconds(cell.key, checkpoint);
        Ok(Estimate { seconds, wall_seconds: seconds, ..estimate })
    }
}

/// The counter of the word that decides a replicate's seconds, apart from every group of words.
const CLOCK: u32 = u32::MAX;
