//! Variance and efficiency of strategies against each other.

use crate::record::{Interval, Jackknifed, StrategyResult};
use crate::stats::interval::{log_ratio, median_interval};

/// Weighted mean variance per sample from the samples' own variances (independent samples): `per_replicate[r]` is the
/// mean over values of w·s² in replicate r.
pub fn within(per_replicate: &[f64]) -> Jackknifed {
    let n = per_replicate.len() as f64;
    let sum: f64 = per_replicate.iter().sum();
    Jackknifed {
        all: sum / n,
        without: per_replicate.iter().filter(|_| n > 1.0).map(|x| (sum - x) / (n - 1.0)).collect(),
    }
}

/// Weighted mean variance per sample from the spread of replicate means: N·mean of w·Var(mean of N), for samples that
/// depend on one another. `means[r]` is the field of replicate r. Leave-one-out values by downdating Σ(x−x̄)²:
/// without replicate r it is smaller by (x_r−x̄)²·R/(R−1). NaN for fewer than two replicates; leave-one-out needs three.
pub fn between(means: &[&[f64]], weights: &[f64], samples: u64) -> Jackknifed {
    let r = means.len() as f64;
    let values = weights.len() as f64;
    // About the first, so that equal means have exactly no spread.
    let average = |i: usize| means[0][i] + means.iter().map(|m| m[i] - means[0][i]).sum::<f64>() / r;
    let average: Vec<f64> = (0..weights.len()).map(average).collect();
    let squares: Vec<f64> = means
        .iter()
        .map(|m| m.iter().zip(&average).zip(weights).map(|((x, a), w)| w * (x - a) * (x - a)).sum::<f64>() / values)
        .collect();
    let total: f64 = squares.iter().sum();
    let n = samples as f64;
    Jackknifed {
        all: n * total / (r - 1.0),
        without: squares.iter().filter(|_| r > 2.0).map(|q| n * (total - q * r / (r - 1.0)) / (r - 2.0)).collect(),
    }
}

/// Quotient of two statistics of the same replicates.
pub fn quotient(a: &Jackknifed, b: &Jackknifed) -> Jackknifed {
    let without = a.without.iter().zip(&b.without).map(|(a, b)| a / b).collect();
    Jackknifed { all: a.all / b.all, without }
}

/// Weighted variance per sample of `a` over that of `b`: jackknife of the logarithm.
pub fn variance_ratio(a: &StrategyResult, b: &StrategyResult, confidence: f64) -> Interval {
    let (a, b) = (a.variance_statistic(), b.variance_statistic());
    log_ratio(a.all, &a.without, b.all, &b.without, confidence)
}

/// Seconds per sample of `a` over those of `b`: median of the per-replicate ratio. Strategies take turns within a
/// replicate, so drift of the machine cancels.
pub fn time_ratio(a: &StrategyResult, b: &StrategyResult, confidence: f64) -> Interval {
    let last = |s: &StrategyResult| s.checkpoints.last().map(|c| (c.seconds.clone(), c.spp as f64)).unwrap_or_default();
    let ((ta, na), (tb, nb)) = (last(a), last(b));
    let ratios: Vec<f64> = ta.iter().zip(&tb).map(|(x, y)| (x / na) / (y / nb)).collect();
    median_interval(&ratios, confidence)
}

/// Efficiency of `a` over that of `b`: 1/(variance ratio × time ratio). The half-widths of the two logarithms add in
/// quadrature (they are independent).
pub fn efficiency_ratio(a: &StrategyResult, b: &StrategyResult, confidence: f64) -> Interval {
    let inverse = product(&variance_ratio(a, b, confidence), &time_ratio(a, b, confidence));
    Interval {
        estimate: 1.0 / inverse.estimate,
        lower: inverse.upper.map(|x| 1.0 / x),
        upper: inverse.lower.map(|x| 1.0 / x),
        confidence,
    }
}

/// Product of independent positive quantities with intervals of the same confidence.
pub fn product(x: &Interval, y: &Interval) -> Interval {
    let side = |a: Option<f64>, b: Option<f64>| {
        let (da, db) = ((a? / x.estimate).ln(), (b? / y.estimate).ln());
        Some(da.hypot(db))
    };
    let estimate = x.estimate * y.estimate;
    Interval {
        estimate,
        lower: side(x.lower, y.lower).map(|d| estimate * (-d).exp()).filter(|b| b.is_finite()),
        upper: side(x.upper, y.upper).map(|d| estimate * d.exp()).filter(|b| b.is_finite()),
        confidence: x.confidence,
    }
}
