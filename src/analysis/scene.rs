//! From the checkpoints of one strategy's replicates to its results.

use super::cost::{Curve, cost};
use super::curve::{CONFIDENCE, slope};
use super::efficiency::{between, efficiency_ratio, quotient, variance_ratio, within};
use super::health::{Maps, RestsOn, drift, health};
use crate::error::Result;
use crate::estimator::Shape;
use crate::moments::cell::Checkpoint;
use crate::record::{
    CheckpointResult, Dependence, Interval, Jackknifed, MetricResult, NonFinite, ProbeResult, ReferenceResult,
    StrategyResult, TargetCost, VarianceRatio,
};
use crate::sampling::Strategy;
use crate::stats::interval::{median_interval, quantile};
use crate::stats::metric::{Measured, Metric, weight};
use crate::stats::{jackknife, mean_interval};

/// Largest share of the measured squared error that the reference's own variance may make up.
pub const REFERENCE_LIMIT: f64 = 0.2;

/// What errors are measured against.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Mean of every value.
    pub mean: Vec<f64>,
    /// Variance of that mean; 0 where exact.
    pub variance: Vec<f64>,
    /// Replicates that the variance was estimated from; `None` where it is known.
    pub replicates: Option<u32>,
}

impl Reference {
    /// The part within a region: first column, first row, and those behind the last.
    #[must_use]
    pub fn crop(&self, shape: Shape, region: [u32; 4]) -> Self {
        let [mean, variance] = [&self.mean, &self.variance].map(|v| crop(v, shape, region));
        Self { mean, variance, ..*self }
    }

    /// What the record says of it, in units of the headline metric; values are independent of one another.
    pub fn describe(
        &self,
        headline: Metric,
        description: String,
        seconds: Option<f64>,
        image: Option<String>,
    ) -> ReferenceResult {
        let values = self.mean.len() as f64;
        ReferenceResult {
            description,
            mean: self.mean.iter().sum::<f64>() / values,
            mean_std_error: self.variance.iter().sum::<f64>().sqrt() / values,
            mean_degrees: self.replicates.map(|r| f64::from(r) - 1.0),
            variance: headline.reference_share(&self.mean, &self.variance),
            seconds,
            image,
        }
    }
}

/// The values of a field within a region; an empty list stays one.
fn crop<T: Copy>(values: &[T], shape: Shape, [x0, y0, x1, y1]: [u32; 4]) -> Vec<T> {
    let row = shape.width * shape.channels;
    let columns = x0 as usize * shape.channels..x1 as usize * shape.channels;
    let rows = values.chunks_exact(row.max(1)).skip(y0 as usize).take((y1 - y0) as usize);
    rows.flat_map(|row| row[columns.clone()].iter().copied()).collect()
}

impl Checkpoint {
    /// The part within a region. Non-finite samples are counted over the whole field.
    #[must_use]
    pub fn crop(&self, shape: Shape, region: [u32; 4]) -> Self {
        Self {
            mean: crop(&self.mean, shape, region),
            variance: crop(&self.variance, shape, region),
            tails: crop(&self.tails, shape, region),
            located: self.located.clone(),
            ..*self
        }
    }
}

/// What is measured, and how.
#[derive(Clone, Copy)]
pub struct Settings<'a> {
    /// Shape of the field.
    pub shape: Shape,
    /// Column and row of its first pixel: not 0 where it is a part of a larger one.
    pub origin: [u32; 2],
    /// Metrics, the headline one first.
    pub metrics: &'a [Metric],
    /// Wanted errors.
    pub targets: &'a [f64],
    /// Probe pixels.
    pub probes: &'a [[u32; 2]],
    /// Checkpoints, ascending.
    pub checkpoints: &'a [u64],
    /// Number of replicates.
    pub replicates: u32,
}

/// Who was measured.
pub struct Subject {
    /// Name of the strategy.
    pub name: String,
    /// Device.
    pub device: String,
    /// Axis values.
    pub strategy: Strategy,
    /// Hash of all that determines the samples beside seed and replicate.
    pub identity: String,
    /// Dependence class.
    pub dependence: Dependence,
    /// Seconds of set-up.
    pub setup_seconds: f64,
}

/// What is known of every value, for images and for ratios with other strategies.
pub struct Fields {
    /// Variance per sample of every value: from samples where they are independent, else N·variance of replicate means.
    pub variance: Vec<f64>,
    /// Mean over replicates at the last checkpoint.
    pub mean: Vec<f64>,
    /// Standard error of that mean, from replicates; NaN with fewer than two.
    pub std_error: Vec<f64>,
    /// Mean over replicates of the sample variance at the last checkpoint.
    pub sample_variance: Vec<f64>,
    /// How far variances can be trusted; `None` without samples, and where there is no image.
    pub health: Option<Maps>,
}

/// Analyses one strategy; `load(replicate, N)` gives its checkpoints.
pub fn analyse(
    subject: Subject,
    settings: &Settings<'_>,
    reference: &Reference,
    load: impl Fn(u32, u64) -> Result<Checkpoint>,
) -> Result<(StrategyResult, Fields)> {
    let weights: Vec<f64> = reference.mean.iter().map(|&r| weight(r)).collect();
    let shares: Vec<f64> =
        settings.metrics.iter().map(|m| m.reference_share(&reference.mean, &reference.variance)).collect();
    let mut checkpoints = Vec::new();
    let mut probes: Vec<ProbeResult> = settings.probes.iter().map(|&p| probe(p, settings.shape, reference)).collect();
    let mut last = Vec::new();
    for &n in settings.checkpoints {
        let loaded = (0..settings.replicates).map(|r| load(r, n)).collect::<Result<Vec<_>>>()?;
        checkpoints.push(checkpoint(n, &loaded, &subject, settings, reference, &shares, &weights));
        for p in &mut probes {
            p.points.extend(probe_point(p.pixel, settings.shape, n, &loaded));
        }
        last = loaded;
    }
    let n = settings.checkpoints.last().copied().unwrap_or(1);
    let (statistic, dispersion, mut fields) = spread(&last, &weights, n, subject.dependence);
    // Only images show them.
    if settings.shape.channels == 3 {
        fields.health = Maps::of(&last, n);
    }
    let relative_variance = jackknife(statistic.all, &statistic.without, CONFIDENCE);
    let squared = settings.metrics[0].squared();
    let slope = slope(&checkpoints, squared).filter(|_| settings.metrics[0].converges_to_zero());
    let pixels = settings.shape.pixels() as f64;
    let seconds: Vec<f64> = last.iter().map(|c| c.seconds / (n as f64 * pixels)).collect();
    let field_seconds: Vec<f64> = last.iter().map(|c| c.seconds / n as f64).collect();
    let field_seconds = median_interval(&field_seconds, CONFIDENCE);
    let independent = subject.dependence == Dependence::Independent;
    let curve = Curve::new(&checkpoints, squared, subject.dependence, slope.as_ref());
    let known = (independent && settings.metrics[0] == Metric::RelMse).then_some(relative_variance);
    let drift = drift(&checkpoints, squared).filter(|_| settings.metrics[0].converges_to_zero());
    let origin = (settings.shape, settings.origin);
    let health = health(&last, n, &weights, origin, drift);
    let mut cost: Vec<TargetCost> =
        settings.targets.iter().filter_map(|&t| cost(t, curve, known, field_seconds)).collect();
    if health.as_ref().is_some_and(|h| h.distrust(RestsOn::Variance).is_some()) {
        cost.iter_mut().for_each(|c| c.forecast = None);
    }
    let result = StrategyResult {
        name: subject.name,
        device: subject.device,
        strategy: subject.strategy,
        identity: subject.identity,
        dependence: subject.dependence,
        setup_seconds: subject.setup_seconds,
        seconds_per_sample: median_interval(&seconds, CONFIDENCE),
        checkpoints,
        slope,
        relative_variance,
        relative_variance_without: statistic.without,
        efficiency_ratio: None,
        variance_ratio: None,
        cost,
        means: last.iter().map(|c| c.mean.iter().sum::<f64>() / c.mean.len() as f64).collect(),
        dispersion,
        largest_deviation: largest_deviation(&last, reference),
        health,
        probes,
        non_finite: non_finite(&last),
        image: None,
    };
    Ok((result, fields))
}

fn checkpoint(
    n: u64,
    loaded: &[Checkpoint],
    subject: &Subject,
    settings: &Settings<'_>,
    reference: &Reference,
    shares: &[f64],
    weights: &[f64],
) -> CheckpointResult {
    let metrics: Vec<MetricResult> = settings
        .metrics
        .iter()
        .zip(shares)
        .map(|(m, &share)| {
            let measured: Vec<Measured> = loaded.iter().map(|c| m.measure(&c.mean, &reference.mean, share)).collect();
            let values: Vec<f64> = measured.iter().map(|m| m.value).collect();
            let trimmed = measured.iter().map(|m| m.trimmed).sum::<f64>() / measured.len() as f64;
            let trimmed = trimmed.is_finite().then_some(trimmed);
            MetricResult { mean: mean_interval(&values, CONFIDENCE), values, trimmed }
        })
        .collect();
    let predicted = (subject.dependence == Dependence::Independent && settings.metrics[0] == Metric::RelMse)
        .then(|| loaded.iter().filter_map(|c| weighted_variance(&c.variance, weights)).collect::<Vec<_>>())
        .filter(|v| v.len() == loaded.len())
        .map(|v| v.iter().sum::<f64>() / v.len() as f64 / n as f64);
    CheckpointResult {
        spp: n,
        seconds: loaded.iter().map(|c| c.seconds).collect(),
        wall_seconds: loaded.iter().map(|c| c.wall_seconds).collect(),
        refused: refusal(&metrics, settings, shares),
        metrics,
        predicted,
    }
}

/// Upper bound of the mean error over replicates, in the root of the headline metric, with one-sided confidence; `None`
/// where there is none, or the reference is too noisy to judge.
pub fn headline_bound(
    metrics: &[Metric],
    loaded: &[Checkpoint],
    reference: &Reference,
    confidence: f64,
) -> Option<f64> {
    let mean = |metric: Metric| {
        let share = metric.reference_share(&reference.mean, &reference.variance);
        let values: Vec<f64> = loaded.iter().map(|c| metric.measure(&c.mean, &reference.mean, share).value).collect();
        (mean_interval(&values, 2.0 * confidence - 1.0), share)
    };
    let headline = metrics.first()?;
    let too_noisy = judge(metrics).map(|i| mean(metrics[i])).is_some_and(|(m, share)| is_too_noisy(share, m.estimate));
    let upper = mean(*headline).0.upper.filter(|_| !too_noisy)?;
    Some(if headline.squared() { upper.max(0.0).sqrt() } else { upper })
}

/// The metric that tells whether the reference can judge an error: the first square, whose share of the reference is known.
fn judge(metrics: &[Metric]) -> Option<usize> {
    metrics.iter().position(|m| m.squared())
}

/// Whether the reference's own variance makes up too much of a square, of which it was subtracted.
fn is_too_noisy(share: f64, corrected: f64) -> bool {
    share > REFERENCE_LIMIT * (corrected + share)
}

/// Why the reference cannot judge a checkpoint, if so.
fn refusal(metrics: &[MetricResult], settings: &Settings<'_>, shares: &[f64]) -> Option<String> {
    let judge = judge(settings.metrics)?;
    let (share, corrected) = (shares[judge], metrics[judge].mean.estimate);
    is_too_noisy(share, corrected).then(|| {
        format!(
            "the reference's own variance is {:.0} % of the measured {} (limit {:.0} %)",
            100.0 * share / (corrected + share),
            settings.metrics[judge].info().name,
            100.0 * REFERENCE_LIMIT
        )
    })
}

/// Mean over values of w·s²; `None` where a variance is not defined.
fn weighted_variance(variance: &[f64], weights: &[f64]) -> Option<f64> {
    let sum: f64 = variance.iter().zip(weights).map(|(v, w)| v * w).sum();
    (variance.len() == weights.len() && sum.is_finite()).then(|| sum / weights.len() as f64)
}

/// Largest |x − r| of any value in any replicate, over the mean of |r| (absolute where that is 0).
fn largest_deviation(last: &[Checkpoint], reference: &Reference) -> f64 {
    let size = reference.mean.iter().map(|r| r.abs()).sum::<f64>() / reference.mean.len() as f64;
    let deviations = last.iter().flat_map(|c| c.mean.iter().zip(&reference.mean)).map(|(x, r)| (x - r).abs());
    // NaN must not get lost.
    let largest = deviations.fold(0.0, |m: f64, d| if d > m || d.is_nan() { d } else { m });
    if size > 0.0 { largest / size } else { largest }
}

/// Relative variance per sample, from samples where they are independent, else from replicates;
/// [`StrategyResult::dispersion`]; and what they come from.
fn spread(
    last: &[Checkpoint],
    weights: &[f64],
    n: u64,
    dependence: Dependence,
) -> (Jackknifed, Option<Jackknifed>, Fields) {
    let r = last.len() as f64;
    let values = weights.len();
    let average = |pick: fn(&Checkpoint) -> &Vec<f64>| -> Vec<f64> {
        (0..values).map(|i| last.iter().map(|c| pick(c).get(i).copied().unwrap_or(f64::NAN)).sum::<f64>() / r).collect()
    };
    let mean = average(|c| &c.mean);
    let sample_variance = average(|c| &c.variance);
    let between_variance: Vec<f64> =
        (0..values).map(|i| last.iter().map(|c| (c.mean[i] - mean[i]).powi(2)).sum::<f64>() / (r - 1.0)).collect();
    let std_error = between_variance.iter().map(|v| (v / r).sqrt()).collect();
    let of_samples: Vec<f64> =
        last.iter().map(|c| weighted_variance(&c.variance, weights).unwrap_or(f64::NAN)).collect();
    let of_samples = within(&of_samples);
    let means: Vec<&[f64]> = last.iter().map(|c| &c.mean[..]).collect();
    let of_means = between(&means, weights, n);
    let dispersion = of_samples.all.is_finite().then(|| quotient(&of_means, &of_samples));
    let (statistic, variance) = match dependence {
        Dependence::Independent => (of_samples, sample_variance.clone()),
        _ => (of_means, between_variance.iter().map(|v| v * n as f64).collect()),
    };
    (statistic, dispersion, Fields { variance, mean, std_error, sample_variance, health: None })
}

/// Fills in the ratios with the first strategy; left out where they are 0/0 or without bound.
pub fn compare_with_first(analysed: &mut [(StrategyResult, Fields)]) {
    let Some(((first, first_fields), others)) = analysed.split_first_mut() else { return };
    for (other, fields) in others {
        let ratios: Vec<f64> = fields
            .variance
            .iter()
            .zip(&first_fields.variance)
            .filter(|(a, b)| **a > 0.0 && **b > 0.0)
            .map(|(a, b)| a / b)
            .collect();
        let quantiles = (!ratios.is_empty()).then(|| [0.05, 0.25, 0.5, 0.75, 0.95].map(|q| quantile(&ratios, q)));
        let defined = |ratio: Interval| ratio.estimate.is_finite().then_some(ratio);
        other.efficiency_ratio = defined(efficiency_ratio(other, first, CONFIDENCE));
        let ratio = defined(variance_ratio(other, first, CONFIDENCE));
        other.variance_ratio = ratio.map(|ratio| VarianceRatio { ratio, quantiles });
    }
}

/// Mean over channels of a pixel.
fn pixel_mean(field: &[f64], pixel: [u32; 2], shape: Shape) -> f64 {
    let first = (pixel[1] as usize * shape.width + pixel[0] as usize) * shape.channels;
    field[first..][..shape.channels].iter().sum::<f64>() / shape.channels as f64
}

fn probe(pixel: [u32; 2], shape: Shape, reference: &Reference) -> ProbeResult {
    ProbeResult { pixel, reference: pixel_mean(&reference.mean, pixel, shape), points: Vec::new() }
}

fn probe_point(pixel: [u32; 2], shape: Shape, n: u64, loaded: &[Checkpoint]) -> Option<(u64, f64, f64, f64)> {
    let values: Vec<f64> = loaded.iter().map(|c| pixel_mean(&c.mean, pixel, shape)).collect();
    let i = mean_interval(&values, CONFIDENCE);
    Some((n, i.estimate, i.lower?, i.upper?))
}

fn non_finite(last: &[Checkpoint]) -> NonFinite {
    let located = last.iter().enumerate().flat_map(|(r, c)| c.located.iter().map(move |&(p, s)| (r as u32, p, s)));
    NonFinite { count: last.iter().map(|c| c.non_finite).sum(), first: located.take(16).collect() }
}
