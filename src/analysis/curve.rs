//! Error curves and their slopes.

use crate::record::{CheckpointResult, Slope, StrategyResult};
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

/// Slopes over log N of what `y` says of a checkpoint and a replicate, one per replicate: prefixes of one run are correlated,
/// replicates are not. `None` with fewer than three checkpoints or two replicates.
pub(super) fn slopes(points: &[&CheckpointResult], y: impl Fn(&CheckpointResult, usize) -> f64) -> Option<Vec<f64>> {
    let replicates = points.first()?.metrics[0].values.len();
    let replicate = |r| least_squares(&points.iter().map(|c| ((c.spp as f64).ln(), y(c, r))).collect::<Vec<_>>());
    (points.len() >= 3 && replicates >= 2).then(|| (0..replicates).map(replicate).collect())
}

/// Fits log error against log N in each replicate and gives the mean slope with Student's t interval. Uses the checkpoints that are not refused and positive in every replicate.
pub fn slope(checkpoints: &[CheckpointResult], squared: bool) -> Option<Slope> {
    let usable: Vec<&CheckpointResult> = checkpoints
        .iter()
        .filter(|c| c.refused.is_none() && c.metrics[0].values.iter().all(|&v| error(v, squared).is_some()))
        .collect();
    let values = slopes(&usable, |c, r| error(c.metrics[0].values[r], squared).unwrap_or(f64::NAN).ln())?;
    Some(Slope {
        slope: mean_interval(&values, CONFIDENCE),
        values,
        from: usable[0].spp,
        to: usable[usable.len() - 1].spp,
    })
}
