//! Error curves and their slopes.

use crate::record::{CheckpointResult, Slope};
use crate::stats::mean_interval;

/// Confidence of every interval in tables and plots.
pub const CONFIDENCE: f64 = 0.95;

/// Least-squares slope of y over x.
pub(super) fn least_squares(points: &[(f64, f64)]) -> f64 {
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

/// Fits log error against log N in each replicate and gives the mean slope with Student's t interval: prefixes of one
/// run are correlated, replicates are not. Uses the checkpoints that are not refused and positive in every replicate.
pub fn slope(checkpoints: &[CheckpointResult], squared: bool) -> Option<Slope> {
    let usable: Vec<&CheckpointResult> = checkpoints
        .iter()
        .filter(|c| c.refused.is_none() && c.metrics[0].values.iter().all(|&v| error(v, squared).is_some()))
        .collect();
    let replicates = usable.first()?.metrics[0].values.len();
    if usable.len() < 3 || replicates < 2 {
        return None;
    }
    let values: Vec<f64> = (0..replicates)
        .map(|r| {
            let points: Vec<(f64, f64)> = usable
                .iter()
                .filter_map(|c| Some(((c.spp as f64).ln(), error(c.metrics[0].values[r], squared)?.ln())))
                .collect();
            least_squares(&points)
        })
        .collect();
    Some(Slope {
        slope: mean_interval(&values, CONFIDENCE),
        values,
        from: usable[0].spp,
        to: usable[usable.len() - 1].spp,
    })
}
