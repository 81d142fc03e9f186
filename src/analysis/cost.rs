//! What a wanted error costs: on average, and for one more run.

use super::curve::{CONFIDENCE, error, error_slopes, usable};
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
    /// Of independent samples the error falls as N^(−½), and no order need be fitted. Of others the order is that of the second
    /// half of the curve (in log N), where that has three points: well-spread points often fall back to N^(−½). Its error is
    /// that of a step not yet measured: the slopes between neighbouring checkpoints are taken as draws from one population
    /// (random effects; DerSimonian and Laird, "Meta-analysis in clinical trials", Control. Clin. Trials 7, 1986, §2, without
    /// weights), whose spread is what they differ by beyond their noise.
    pub fn new(
        checkpoints: &'a [CheckpointResult],
        squared: bool,
        dependence: Dependence,
        slope: Option<&'a Slope>,
    ) -> Self {
        let order = match dependence {
            Dependence::Independent => Some(Uncertain { value: -0.5, error: 0.0, degrees: f64::INFINITY }),
            _ => slope.and_then(|_| fitted_order(checkpoints, squared)),
        };
        Self { checkpoints, squared, slope, order }
    }

    /// A strategy's, in the headline metric.
    pub fn of(strategy: &'a StrategyResult, metric: Metric) -> Self {
        Self::new(&strategy.checkpoints, metric.squared(), strategy.dependence, strategy.slope.as_ref())
    }

    /// Samples per value and seconds that each replicate needs for an error: from the checkpoint whose mean error is nearest
    /// to it along the curve's order there. `None` where that is unknown, or an error is not positive.
    pub fn reach(&self, target: f64) -> Option<Vec<[f64; 2]>> {
        let (point, order) = (self.nearest(target)?, self.order_at(target)?);
        let replicate = |(r, &v): (usize, &f64)| {
            let spp = point.spp as f64 * (error(v, self.squared)? / target).powf(-1.0 / order.value);
            Some([spp, self.seconds(r, spp)])
        };
        point.metrics[0].values.iter().enumerate().map(replicate).collect()
    }

    /// The order at a wanted error: of curves whose order is fitted, and between two checkpoints, that of their mean errors.
    pub fn order_at(&self, target: f64) -> Option<Uncertain> {
        let order = self.order?;
        let mean = |c: &CheckpointResult| error(c.metrics[0].mean.estimate, self.squared).unwrap_or(f64::NAN);
        let usable = usable(self.checkpoints, self.squared);
        let around = usable.windows(2).find(|w| mean(w[0]) >= target && target > mean(w[1]));
        let Some(around) = around.filter(|_| order.error > 0.0) else { return Some(order) };
        Uncertain::mean(&error_slopes(around, self.squared)?)
    }

    /// Seconds of a replicate for so many samples: on straight lines between checkpoints and beyond, for the first samples
    /// often cost more than the others.
    fn seconds(&self, replicate: usize, spp: f64) -> f64 {
        let points: Vec<(f64, f64)> = self.checkpoints.iter().map(|c| (c.spp as f64, c.seconds[replicate])).collect();
        let next = points.iter().position(|p| p.0 >= spp).unwrap_or(points.len() - 1);
        let (a, b) = if next == 0 { ((0.0, 0.0), points[0]) } else { (points[next - 1], points[next]) };
        let line = b.1 + (spp - b.0) * (b.1 - a.1) / (b.0 - a.0);
        // Clocks are noisy, and a line may fall.
        if b.1 > a.1 { line } else { b.1 * spp / b.0 }
    }

    /// The usable checkpoint whose error is nearest to a wanted one.
    fn nearest(&self, target: f64) -> Option<&CheckpointResult> {
        let distance = |c: &CheckpointResult| {
            error(c.metrics[0].mean.estimate, self.squared).map_or(f64::INFINITY, |e| (e / target).ln().abs())
        };
        let usable = usable(self.checkpoints, self.squared).into_iter();
        usable.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// What not knowing the order adds to the logarithm of samples or seconds that a wanted error needs: 0 with its error.
    pub fn doubt(&self, target: f64) -> Option<Uncertain> {
        let (order, point) = (self.order_at(target)?, self.nearest(target)?);
        let distance = (error(point.metrics[0].mean.estimate, self.squared)? / target).ln();
        Some(Uncertain { value: 0.0, ..order.times(distance / (order.value * order.value)) })
    }

    /// What one more run will need: Student's prediction interval on the logarithms of the replicates' needs (Hahn &
    /// Meeker, Statistical Intervals, 1991, §4.7), widened by the doubt about the order where that is fitted.
    pub fn forecast(&self, target: f64) -> Option<Forecast> {
        let (needs, order, doubt) = (self.reach(target)?, self.order?, self.doubt(target)?);
        let one_more = (needs.len() as f64 + 1.0).sqrt();
        let interval = |pick: usize| {
            let logs = Uncertain::mean(&needs.iter().map(|n| n[pick].ln()).collect::<Vec<_>>())?;
            let next = Uncertain { error: logs.error * one_more, ..logs };
            let prediction = next.minus(doubt).exp_interval(PREDICTION);
            prediction.estimate.is_finite().then_some(prediction)
        };
        Some(Forecast { spp: interval(0)?, seconds: interval(1)?, halving: 0.5f64.powf(1.0 / order.value) })
    }
}

fn fitted_order(checkpoints: &[CheckpointResult], squared: bool) -> Option<Uncertain> {
    let usable = usable(checkpoints, squared);
    let middle = (usable.last()?.spp as f64).sqrt();
    let late = usable.iter().position(|c| c.spp as f64 >= middle)?.min(usable.len().checked_sub(3)?);
    let order = Uncertain::mean(&error_slopes(&usable[late..], squared)?).filter(|o| o.value < 0.0)?;
    let steps =
        usable.windows(2).map(|pair| Uncertain::mean(&error_slopes(pair, squared)?)).collect::<Option<Vec<_>>>()?;
    let mean = Uncertain::mean(&steps.iter().map(|s| s.value).collect::<Vec<_>>())?;
    let n = steps.len() as f64;
    let noise = steps.iter().map(|s| s.error * s.error).sum::<f64>() / n;
    let spread = (mean.error * mean.error * n - noise).max(0.0) * (1.0 + 1.0 / n);
    let next = Uncertain { value: 0.0, error: spread.sqrt(), ..mean };
    Some(order.minus(next))
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
