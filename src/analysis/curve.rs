//! Error curves: slopes and the cost of a wanted error.

use super::efficiency::product;
use crate::record::{CheckpointResult, Interval, Slope, TargetCost};
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
fn error(value: f64, squared: bool) -> Option<f64> {
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

/// Samples and seconds that reach a wanted error.
///
/// With `variance` (relative variance per sample of independent samples) N = variance/target². Otherwise N is read off
/// the measured curve and off the bounds of its band, log-linearly, and beyond its ends with the fitted slope and the
/// bounds of its interval.
pub fn cost(
    target: f64,
    checkpoints: &[CheckpointResult],
    squared: bool,
    variance: Option<Interval>,
    slope: Option<&Slope>,
    seconds_per_sample: Interval,
) -> Option<TargetCost> {
    let largest = checkpoints.last()?.spp as f64;
    let spp = match variance {
        Some(v) if squared => {
            let n = |x: f64| x / (target * target);
            Interval { estimate: n(v.estimate), lower: v.lower.map(n), upper: v.upper.map(n), ..v }
        }
        _ => {
            let slope = slope?.slope;
            let read = |pick: fn(&Interval) -> Option<f64>, slope: f64| {
                let points: Vec<(f64, f64)> = checkpoints
                    .iter()
                    .filter(|c| c.refused.is_none())
                    .filter_map(|c| Some(((c.spp as f64).ln(), error(pick(&c.metrics[0].mean)?, squared)?.ln())))
                    .collect();
                solve(&points, target.ln(), slope)
            };
            // Which of the slopes reaches the error first depends on the end that the curve is left at.
            let bound =
                |pick, first: fn(f64, f64) -> f64| Some(first(read(pick, slope.lower?)?, read(pick, slope.upper?)?));
            Interval {
                estimate: read(|i| Some(i.estimate), slope.estimate)?,
                lower: bound(|i| i.lower, f64::min),
                upper: bound(|i| i.upper, f64::max),
                confidence: CONFIDENCE,
            }
        }
    };
    (spp.estimate.is_finite() && spp.estimate > 0.0).then(|| TargetCost {
        target,
        spp: spp.estimate,
        seconds: Some(product(&spp, &seconds_per_sample)),
        extrapolated: spp.estimate > largest,
    })
}

/// exp of the abscissa at which the falling log-log curve first meets `y`; beyond its ends with the given slope.
fn solve(points: &[(f64, f64)], y: f64, slope: f64) -> Option<f64> {
    if slope >= 0.0 {
        return None;
    }
    let (first, last) = (points.first()?, points.last()?);
    let beyond = |p: &(f64, f64)| p.0 + (y - p.1) / slope;
    let x = if first.1 <= y {
        beyond(first)
    } else {
        let crossing = points.windows(2).find(|w| w[0].1 > y && w[1].1 <= y);
        crossing.map_or_else(|| beyond(last), |w| w[0].0 + (w[1].0 - w[0].0) * (y - w[0].1) / (w[1].1 - w[0].1))
    };
    Some(x.exp())
}
