//! Error curves and their slopes.

use super::efficiency::within;
use crate::record::{CheckpointResult, Jackknifed, Slope, StrategyResult};
use crate::stats::mean_interval;

/// Confidence of every interval in tables and plots.
pub const CONFIDENCE: f64 = 0.95;

/// Least-squares slope of y over x.
fn least_squares(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (sxy, sxx) =
        points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + (x - mx) * (y - my), b + (x - mx) * (x - mx)));
    sxy / sxx
}

/// The error that curves show at a checkpoint: the headline metric or its root. `None` where it is not positive.
pub(super) fn error(value: f64, squared: bool) -> Option<f64> {
    let e = if squared { value.sqrt() } else { value };
    (e > 0.0 && e.is_finite()).then_some(e)
}

/// The largest N at which every strategy has an error that may be judged.
pub fn common_spp<'a>(strategies: impl IntoIterator<Item = &'a StrategyResult, IntoIter: Clone>) -> Option<u64> {
    let strategies = strategies.into_iter();
    let usable = |s: &StrategyResult, n| s.checkpoints.iter().any(|c| c.spp == n && c.refused.is_none());
    let first = strategies.clone().next()?;
    first.checkpoints.iter().rev().map(|c| c.spp).find(|&n| strategies.clone().all(|s| usable(s, n)))
}

/// Checkpoints that may be judged and whose error is positive in every replicate.
pub(super) fn usable(checkpoints: &[CheckpointResult], squared: bool) -> Vec<&CheckpointResult> {
    let positive = |c: &CheckpointResult| c.metrics[0].values.iter().all(|&v| error(v, squared).is_some());
    checkpoints.iter().filter(|c| c.refused.is_none() && positive(c)).collect()
}

/// Slope over log N of what `y` says of a checkpoint's replicates, as the jackknife's pseudo-values, one per replicate: their
/// mean is the slope, their spread its error (Tukey 1958; Efron & Tibshirani, An Introduction to the Bootstrap, 1993, §11.5).
/// Prefixes of one run are correlated, replicates are not. `None` with fewer than two checkpoints or replicates.
pub(super) fn slopes(points: &[&CheckpointResult], y: impl Fn(&CheckpointResult) -> Jackknifed) -> Option<Vec<f64>> {
    let curve: Vec<(f64, Jackknifed)> = points.iter().map(|c| ((c.spp as f64).ln(), y(c))).collect();
    let fit =
        |of: &dyn Fn(&Jackknifed) -> f64| least_squares(&curve.iter().map(|(x, y)| (*x, of(y))).collect::<Vec<_>>());
    let replicates = curve.first()?.1.without.len();
    let (n, all) = (replicates as f64, fit(&|y| y.all));
    let pseudo = |r: usize| n * all - (n - 1.0) * fit(&|y| y.without[r]);
    (points.len() >= 2 && replicates >= 2).then(|| (0..replicates).map(pseudo).collect())
}

/// [`slopes`] of the logarithm of the mean error over replicates. The mean of logarithms would bend where errors are few and
/// skewed.
pub(super) fn error_slopes(points: &[&CheckpointResult], squared: bool) -> Option<Vec<f64>> {
    let log = |mean: f64| error(mean, squared).unwrap_or(f64::NAN).ln();
    slopes(points, |c| within(&c.metrics[0].values).map(log))
}

/// Fits the logarithm of the mean error against log N over the usable checkpoints; `None` with fewer than three.
pub fn slope(checkpoints: &[CheckpointResult], squared: bool) -> Option<Slope> {
    let usable = usable(checkpoints, squared);
    let values = error_slopes(&usable, squared).filter(|_| usable.len() >= 3)?;
    Some(Slope {
        slope: mean_interval(&values, CONFIDENCE),
        values,
        from: usable[0].spp,
        to: usable[usable.len() - 1].spp,
    })
}
