//! What a wanted error costs: on average, and for one more run.

use super::curve::{CONFIDENCE, error, slope};
use super::efficiency::product;
use crate::record::{CheckpointResult, Dependence, Forecast, Interval, Slope, StrategyResult, TargetCost};
use crate::stats::Metric;
use crate::stats::interval::Uncertain;

/// Confidence of prediction intervals.
pub const PREDICTION: f64 = 0.9;

/// How a strategy's error falls.
#[derive(Clone, Copy)]
pub struct Curve<'a> {
    /// Checkpoints, ascending.
    checkpoints: &'a [CheckpointResult],
    /// Whether the headline metric is a square, so that errors are its root.
    squared: bool,
    /// The fitted order.
    slope: Option<&'a Slope>,
    /// d log(error) / d log(N), where it is known to be negative.
    pub order: Option<Uncertain>,
}

impl<'a> Curve<'a> {
    /// Of independent samples the error falls as N^(−½), and no order need be fitted. Of others the order's error includes by
    /// how much the second half of the curve (in log N) differs from the whole, where that has three points: the order of
    /// well-spread points often grows with N.
    pub fn new(
        checkpoints: &'a [CheckpointResult],
        squared: bool,
        dependence: Dependence,
        slope: Option<&'a Slope>,
    ) -> Self {
        let order = match dependence {
            Dependence::Independent => Some(Uncertain { value: -0.5, error: 0.0, degrees: f64::INFINITY }),
            _ => fitted_order(checkpoints, squared, slope),
        };
        Self { checkpoints, squared, slope, order }
    }

    /// A strategy's, in the headline metric.
    pub fn of(strategy: &'a StrategyResult, metric: Metric) -> Self {
        Self::new(&strategy.checkpoints, metric.squared(), strategy.dependence, strategy.slope.as_ref())
    }

    /// Samples per value and seconds that each replicate needs for an error: from the checkpoint whose mean error is nearest
    /// to it along the curve's order. `None` where that order is unknown, or an error is not positive.
    pub fn reach(&self, target: f64) -> Option<Vec<[f64; 2]>> {
        let (point, order) = (self.nearest(target)?, self.order?);
        let last = self.checkpoints.last()?;
        let replicate = |(r, &v): (usize, &f64)| {
            let spp = point.spp as f64 * (error(v, self.squared)? / target).powf(-1.0 / order.value);
            Some([spp, spp * last.seconds[r] / last.spp as f64])
        };
        point.metrics[0].values.iter().enumerate().map(replicate).collect()
    }

    /// The usable checkpoint whose error is nearest to a wanted one.
    fn nearest(&self, target: f64) -> Option<&CheckpointResult> {
        let positive = |c: &CheckpointResult| c.metrics[0].values.iter().all(|&v| error(v, self.squared).is_some());
        let distance = |c: &CheckpointResult| {
            error(c.metrics[0].mean.estimate, self.squared).map_or(f64::INFINITY, |e| (e / target).ln().abs())
        };
        let usable = self.checkpoints.iter().filter(|c| c.refused.is_none() && positive(c));
        usable.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// What one more run will need: Student's prediction interval on the logarithms of the replicates' needs (Hahn &
    /// Meeker, Statistical Intervals, 1991, §4.7), widened by the doubt about the order where that is fitted.
    pub fn forecast(&self, target: f64) -> Option<Forecast> {
        let (needs, order, point) = (self.reach(target)?, self.order?, self.nearest(target)?);
        let replicates = needs.len() as f64;
        let distance = (error(point.metrics[0].mean.estimate, self.squared)? / target).ln();
        let by_order = distance / (order.value * order.value) * order.error;
        let interval = |pick: usize| {
            let logs = Uncertain::mean(&needs.iter().map(|n| n[pick].ln()).collect::<Vec<_>>())?;
            let error = (logs.error * logs.error * (replicates + 1.0) + by_order * by_order).sqrt();
            let prediction = Uncertain { error, ..logs }.exp_interval(PREDICTION);
            prediction.estimate.is_finite().then_some(prediction)
        };
        Some(Forecast { spp: interval(0)?, seconds: interval(1)?, halving: 0.5f64.powf(1.0 / order.value) })
    }
}

fn fitted_order(checkpoints: &[CheckpointResult], squared: bool, fitted: Option<&Slope>) -> Option<Uncertain> {
    let last = checkpoints.last()?.spp as f64;
    let late = checkpoints.iter().position(|c| c.spp as f64 >= last.sqrt())?;
    let all = Uncertain::mean(&fitted?.values).filter(|o| o.value < 0.0)?;
    let bend = slope(&checkpoints[late..], squared).map_or(0.0, |late| late.slope.estimate - all.value);
    Some(Uncertain { error: all.error.hypot(bend), ..all })
}

/// Samples and seconds that reach a wanted error.
///
/// With `variance` (relative variance per sample of independent samples) N = variance/target². Otherwise N is read off
/// the measured curve and off the bounds of its band, log-linearly, and beyond its ends with the fitted slope and the
/// bounds of its interval.
pub fn cost(
    target: f64,
    curve: Curve<'_>,
    variance: Option<Interval>,
    seconds_per_sample: Interval,
) -> Option<TargetCost> {
    let Curve { checkpoints, squared, slope, .. } = curve;
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
        forecast: curve.forecast(target),
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
