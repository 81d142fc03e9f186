//! What a claim's kind measures: an interval, and what could make it narrower.

use super::{Claim, Equal, Kind};
use crate::analysis::cost::Curve;
use crate::analysis::curve::common_spp;
use crate::analysis::efficiency::{time_ratio, within};
use crate::analysis::{efficiency_ratio, variance_ratio};
use crate::record::{CheckpointResult, Dependence, Health, Interval, ReferenceResult, SceneResult, StrategyResult};
use crate::stats::Metric;
use crate::stats::interval::{Uncertain, binomial_interval, without_bounds};

/// A measured quantity.
pub(super) struct Measure {
    pub interval: Interval,
    /// Degrees of freedom of the interval.
    pub degrees: f64,
    pub narrows: Narrows,
    /// Replicates that it rests on.
    pub replicates: u32,
    /// Seconds of sampling that it rests on.
    pub seconds: f64,
    /// What one step of the abscissa is called.
    pub abscissa: String,
    /// Why no verdict can rest on it.
    pub doubt: Option<String>,
    /// How far its bounds may have to move down and up for samples that were not seen, on the scale where errors are even.
    pub reach: [f64; 2],
    /// What the sentence has to say beside the figures.
    pub remark: Option<String>,
}

/// What makes an interval narrower.
pub(super) enum Narrows {
    /// More samples, of which there are so many per value and replicate.
    WithSamples(u64),
    /// More replicates only.
    WithReplicates,
}

impl Claim {
    /// What the claim speaks of, on its scene or region.
    pub(super) fn measure(&self, scene: &SceneResult, metric: Metric, confidence: f64) -> Measure {
        let (reference, strategies) = match self.region {
            None => (&scene.reference, &scene.strategies),
            Some(region) => match scene.regions.iter().find(|r| r.region == region) {
                Some(found) => (&found.reference, &found.strategies),
                None => return self.nothing(scene, "the region was not measured", confidence),
            },
        };
        let find = |name: &str| strategies.iter().find(|s| s.name == name);
        let Some(of) = find(&self.of) else { return self.nothing(scene, "the strategy was not measured", confidence) };
        let to = self.to.as_deref().and_then(find);
        let both = || [Some(of), to].into_iter().flatten();
        let replicates = both().map(|s| s.means.len() as u32).min().unwrap_or(0);
        let found = match self.kind {
            Kind::Finite => Ok((rate_of_non_finite(of, scene.shape, confidence), f64::INFINITY, None)),
            _ => self.quantity(of, to, reference, metric, confidence),
        };
        let (interval, degrees, remark) = match found {
            Ok(found) => found,
            Err(why) => return Measure { replicates, ..self.nothing(scene, &why, confidence) },
        };
        let samples = both().filter_map(|s| s.checkpoints.last()).map(|c| c.spp).min().unwrap_or(0);
        let independent = both().all(|s| s.dependence == Dependence::Independent);
        let narrows = match self.kind {
            Kind::Unbiased | Kind::Agrees => Narrows::WithSamples(samples),
            Kind::VarianceRatio if independent => Narrows::WithSamples(samples),
            _ => Narrows::WithReplicates,
        };
        let doubt = self.kind.rests_on(of).and_then(|moment| {
            let doubt = |s: &StrategyResult| Some(format!("{}: {}", s.name, s.health.as_ref()?.distrust(moment)?));
            both().find_map(doubt)
        });
        let shift = |s: Option<&StrategyResult>| s.and_then(|s| s.health.as_ref()).map_or(0.0, Health::shift);
        let spent = |s: &StrategyResult| s.checkpoints.last().map_or(0.0, |c| c.seconds.iter().sum());
        Measure {
            interval,
            degrees,
            narrows,
            replicates,
            seconds: both().map(spent).sum(),
            abscissa: scene.abscissa.clone(),
            doubt,
            reach: self.kind.reach(shift(Some(of)), shift(to)),
            remark,
        }
    }

    fn nothing(&self, scene: &SceneResult, why: &str, confidence: f64) -> Measure {
        Measure {
            interval: without_bounds(f64::NAN, confidence),
            degrees: f64::INFINITY,
            narrows: Narrows::WithReplicates,
            replicates: 0,
            seconds: 0.0,
            abscissa: scene.abscissa.clone(),
            doubt: Some(why.to_owned()),
            reach: [0.0; 2],
            remark: None,
        }
    }

    /// Interval, degrees of freedom and remark; or why there is none.
    fn quantity(
        &self,
        of: &StrategyResult,
        to: Option<&StrategyResult>,
        reference: &ReferenceResult,
        metric: Metric,
        confidence: f64,
    ) -> Result<(Interval, f64, Option<String>), String> {
        let few = || "it takes at least two replicates".to_owned();
        let degrees = |values: usize| (values as f64 - 1.0).max(1.0);
        let plain = |i: Interval, replicates: usize| Ok((i, degrees(replicates), None));
        let linear = |u: Option<Uncertain>| u.map(|u| (u.interval(confidence), u.degrees, None)).ok_or_else(few);
        let ratio = |u: Uncertain| (u.exp_interval(confidence), u.degrees, None);
        let other = || to.ok_or_else(|| "the strategy to compare with was not measured".to_owned());
        match self.kind {
            Kind::VarianceRatio => plain(variance_ratio(of, other()?, confidence), of.means.len()),
            Kind::EfficiencyRatio => plain(efficiency_ratio(of, other()?, confidence), of.means.len()),
            Kind::CostRatio => plain(time_ratio(of, other()?, confidence), of.means.len()),
            Kind::ErrorRatio => self.error_ratio(of, other()?, metric).map(ratio),
            Kind::TimeToErrorRatio => self.time_to_error_ratio(of, other()?, metric).map(ratio),
            Kind::Unbiased | Kind::Agrees => {
                let paired = to.is_some_and(|to| of.strategy == to.strategy);
                let difference = match to {
                    Some(to) => difference(of, to, paired),
                    None => bias(of, reference),
                };
                let (interval, degrees, _) = linear(difference)?;
                Ok((interval, degrees, paired.then(|| PAIRED.to_owned())))
            }
            Kind::Slope => linear(of.slope.as_ref().and_then(|s| Uncertain::mean(&s.values))),
            Kind::VarianceOfMean => {
                let d = of.dispersion.as_ref().ok_or("the estimator has no samples of its own")?;
                if d.all == 0.0 {
                    // Replicates that are all the same: nothing varies, not even this.
                    let none = Interval { lower: Some(0.0), upper: Some(0.0), ..without_bounds(0.0, confidence) };
                    return Ok((none, f64::INFINITY, None));
                }
                let log = Uncertain::log_jackknife(d.all, &d.without).ok_or("it takes at least three replicates")?;
                Ok(ratio(log))
            }
            Kind::Exact if reference.variance > 0.0 => Err("the reference is an estimate, not exact".into()),
            Kind::Exact => {
                let x = of.largest_deviation;
                let remark = Some(format!("over {} replicates", of.means.len()));
                Ok((
                    Interval { lower: Some(x), upper: Some(x), ..without_bounds(x, confidence) },
                    f64::INFINITY,
                    remark,
                ))
            }
            Kind::Finite => unreachable!("measured before"),
        }
    }

    /// log(error of `of` / error of `to`): jackknife of the mean error over replicates.
    fn error_ratio(&self, of: &StrategyResult, to: &StrategyResult, metric: Metric) -> Result<Uncertain, String> {
        let at = match self.equal.unwrap_or_default() {
            Equal::Spp => {
                At::Spp(common_spp([of, to]).ok_or("there is no N at which the reference can judge both errors")?)
            }
            Equal::Seconds => At::Seconds(quickest(of).min(quickest(to))),
        };
        let part = |s: &StrategyResult| {
            let errors = errors(s, at).filter(|e| e.len() >= 2).ok_or_else(|| below_noise(s))?;
            let mean = within(&errors);
            Uncertain::log_jackknife(mean.all, &mean.without).ok_or_else(|| below_noise(s))
        };
        let root = if metric.squared() { 0.5 } else { 1.0 };
        Ok(part(of)?.minus(part(to)?).times(root))
    }

    /// log(seconds of `of` / seconds of `to`) to the wanted error: mean over replicates, which strategies take turns in.
    fn time_to_error_ratio(
        &self,
        of: &StrategyResult,
        to: &StrategyResult,
        metric: Metric,
    ) -> Result<Uncertain, String> {
        let target = self.error.expect("checked on loading");
        let curves = [Curve::of(of, metric), Curve::of(to, metric)];
        let needs = |i: usize| {
            let known = curves[i].reach(target).zip(curves[i].doubt(target));
            known.ok_or_else(|| format!("{}: the curve does not tell when that error is reached", [of, to][i].name))
        };
        let ((a, a_doubt), (b, b_doubt)) = (needs(0)?, needs(1)?);
        let logs: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (a[1] / b[1]).ln()).collect();
        let ratio = Uncertain::mean(&logs).map(|u| u.minus(a_doubt).minus(b_doubt));
        ratio.filter(|u| u.value.is_finite()).ok_or_else(|| "no seconds were measured".into())
    }
}

/// Where on a curve.
#[derive(Clone, Copy)]
enum At {
    Spp(u64),
    Seconds(f64),
}

/// Seconds of a strategy's quickest replicate.
fn quickest(s: &StrategyResult) -> f64 {
    s.checkpoints.last().map_or(f64::NAN, |c| c.seconds.iter().copied().fold(f64::INFINITY, f64::min))
}

fn below_noise(s: &StrategyResult) -> String {
    format!("the error of {} is below the reference's own noise, or cannot be judged by it", s.name)
}

/// The headline metric per replicate: at a checkpoint, or between two of them, log-linearly in seconds.
fn errors(s: &StrategyResult, at: At) -> Option<Vec<f64>> {
    let usable: Vec<&CheckpointResult> = s.checkpoints.iter().filter(|c| c.refused.is_none()).collect();
    match at {
        At::Spp(n) => Some(usable.iter().find(|c| c.spp == n)?.metrics[0].values.clone()),
        At::Seconds(seconds) => {
            let replicate = |r: usize| {
                let pair = usable.windows(2).find(|w| w[0].seconds[r] <= seconds && seconds <= w[1].seconds[r])?;
                let point = |c: &CheckpointResult| (c.seconds[r].ln(), c.metrics[0].values[r].ln());
                let ((x0, y0), (x1, y1)) = (point(pair[0]), point(pair[1]));
                let t = if x1 > x0 { (seconds.ln() - x0) / (x1 - x0) } else { 1.0 };
                Some((y0 + t * (y1 - y0)).exp()).filter(|e| e.is_finite())
            };
            (0..usable.first()?.seconds.len()).map(replicate).collect()
        }
    }
}

/// What a sentence says of differences of equal samples.
pub(super) const PAIRED: &str = "same samples, paired";

/// Relative difference of a strategy's mean from the reference's.
fn bias(of: &StrategyResult, reference: &ReferenceResult) -> Option<Uncertain> {
    let degrees = reference.mean_degrees.unwrap_or(f64::INFINITY);
    let truth = Uncertain { value: reference.mean, error: reference.mean_std_error, degrees };
    Some(relative(Uncertain::mean(&of.means)?.minus(truth), truth.value))
}

/// Relative difference of the means of two strategies; `paired`: they drew the same random numbers, so only the difference
/// varies.
pub(super) fn difference(of: &StrategyResult, to: &StrategyResult, paired: bool) -> Option<Uncertain> {
    let (a, b) = (Uncertain::mean(&of.means)?, Uncertain::mean(&to.means)?);
    let difference = match paired && of.means.len() == to.means.len() {
        true => Uncertain::mean(&of.means.iter().zip(&to.means).map(|(a, b)| a - b).collect::<Vec<_>>())?,
        false => a.minus(b),
    };
    Some(relative(difference, b.value))
}

/// Over a size; absolute where there is nothing to be relative to.
fn relative(u: Uncertain, size: f64) -> Uncertain {
    if size == 0.0 { u } else { u.times(1.0 / size.abs()) }
}

/// Rate of samples that are not finite.
fn rate_of_non_finite(of: &StrategyResult, shape: [usize; 3], confidence: f64) -> Interval {
    let values = shape.iter().product::<usize>() as u64;
    let samples = of.checkpoints.last().map_or(0, |c| c.spp.saturating_mul(c.seconds.len() as u64));
    binomial_interval(of.non_finite.count, samples.saturating_mul(values), confidence)
}
