//! The registry of error metrics. Names clash in the field (relMSE has at least five meanings), so each one is printed
//! with its formula, ε and channel rule. x = estimate, r = reference; means run over pixels and channels.

use crate::record::MetricInfo;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// ε of the relative metrics. Together with `r²+ε` as in tev and SimpleImageIO.
pub const EPSILON: f64 = 0.01;

/// The fraction of largest terms that the trimmed value leaves out.
pub const TRIM: f64 = 0.001;

/// An error metric.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Metric {
    /// mean (x−r)²/(r²+0.01).
    #[default]
    #[serde(rename = "relMSE")]
    RelMse,
    /// mean (x−r)².
    #[serde(rename = "MSE")]
    Mse,
    /// √ mean (x−r)².
    #[serde(rename = "RMSE")]
    Rmse,
    /// mean |x−r|.
    #[serde(rename = "MAE")]
    Mae,
    /// mean |x−r|/(|r|+0.01).
    #[serde(rename = "MAPE")]
    Mape,
    /// mean 2|x−r|/(|x|+|r|+0.01).
    #[serde(rename = "SMAPE")]
    Smape,
    /// 10·log₁₀(max r² / mean (x−r)²).
    #[serde(rename = "PSNR")]
    Psnr,
    /// mean (x−r).
    #[serde(rename = "bias")]
    Bias,
}

/// A measured error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The metric's value.
    pub value: f64,
    /// The value without the [`TRIM`] largest terms (by size), averaged over the rest.
    pub trimmed: f64,
}

impl Metric {
    /// All metrics, in the order of tables.
    pub const ALL: [Self; 8] =
        [Self::RelMse, Self::Mse, Self::Rmse, Self::Mae, Self::Mape, Self::Smape, Self::Psnr, Self::Bias];

    /// The definition for people.
    pub fn info(self) -> MetricInfo {
        let (name, formula, unit) = match self {
            Self::RelMse => ("relMSE", "mean (x−r)²/(r²+0.01) − mean Var(r)/(r²+0.01)", "relative"),
            Self::Mse => ("MSE", "mean (x−r)² − mean Var(r)", "radiance²"),
            Self::Rmse => ("RMSE", "√ mean (x−r)²", "radiance"),
            Self::Mae => ("MAE", "mean |x−r|", "radiance"),
            Self::Mape => ("MAPE", "mean |x−r|/(|r|+0.01)", "relative"),
            Self::Smape => ("SMAPE", "mean 2|x−r|/(|x|+|r|+0.01)", "relative"),
            Self::Psnr => ("PSNR", "10 log₁₀(max r² / mean (x−r)²)", "dB"),
            Self::Bias => ("bias", "mean (x−r)", "radiance"),
        };
        MetricInfo {
            name: name.into(),
            formula: formula.into(),
            channels: "each channel of each pixel is a value of its own; means run over all values".into(),
            squared: self.squared(),
            unit: unit.into(),
        }
    }

    /// Whether it is a mean of squares: curves then show its root.
    pub const fn squared(self) -> bool {
        matches!(self, Self::RelMse | Self::Mse)
    }

    /// Whether larger errors give larger values, tending to 0: what a slope can be fitted to.
    pub const fn converges_to_zero(self) -> bool {
        !matches!(self, Self::Psnr | Self::Bias)
    }

    /// One value's term of the mean.
    fn term(self, x: f64, r: f64) -> f64 {
        let d = x - r;
        match self {
            Self::RelMse => d * d * weight(r),
            Self::Mse | Self::Rmse | Self::Psnr => d * d,
            Self::Mae => d.abs(),
            Self::Mape => d.abs() / (r.abs() + EPSILON),
            Self::Smape => 2.0 * d.abs() / (x.abs() + r.abs() + EPSILON),
            Self::Bias => d,
        }
    }

    /// The metric of the mean of its terms.
    fn finish(self, mean: f64, reference: &[f64]) -> f64 {
        match self {
            Self::Rmse => mean.sqrt(),
            Self::Psnr => {
                let peak = reference.iter().fold(0.0f64, |m, r| m.max(r.abs()));
                10.0 * (peak * peak / mean).log10()
            }
            _ => mean,
        }
    }

    /// What the reference's own variance adds to the metric's expectation: mean of w·Var(r) for squares, else 0
    /// (the other metrics are not corrected; their formulas say so).
    pub fn reference_share(self, reference: &[f64], variance: &[f64]) -> f64 {
        let n = reference.len() as f64;
        match self {
            Self::RelMse => reference.iter().zip(variance).map(|(&r, v)| v * weight(r)).sum::<f64>() / n,
            Self::Mse => variance.iter().sum::<f64>() / n,
            _ => 0.0,
        }
    }

    /// Measures an estimate against a reference; `share` is [`Self::reference_share`]. Summed in f64 in a fixed order.
    pub fn measure(self, estimate: &[f64], reference: &[f64], share: f64) -> Measured {
        let mut terms: Vec<f64> = estimate.iter().zip(reference).map(|(&x, &r)| self.term(x, r)).collect();
        let n = terms.len();
        let value = terms.iter().sum::<f64>() / n as f64;
        // Ceiling: a list of fewer than 1000 terms still loses its largest one.
        let drop = ((n as f64 * TRIM).ceil() as usize).min(n - 1);
        let kept = n - drop;
        if drop > 0 {
            terms.select_nth_unstable_by(kept, |a, b| a.abs().total_cmp(&b.abs()));
        }
        let trimmed = terms[..kept].iter().sum::<f64>() / kept as f64;
        Measured { value: self.finish(value - share, reference), trimmed: self.finish(trimmed - share, reference) }
    }
}

/// Weight of the relative metrics: 1/(r²+ε).
pub fn weight(r: f64) -> f64 {
    1.0 / (r * r + EPSILON)
}
