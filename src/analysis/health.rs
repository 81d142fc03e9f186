//! How far figures on variance can be trusted: the checks of MCNP and of Geant4's G4ConvergenceTester, for whole fields.

use super::curve::{CONFIDENCE, slopes, usable};
use super::efficiency::{quotient, within};
use crate::estimator::Shape;
use crate::moments::cell::{Checkpoint, Tail};
use crate::record::{CheckpointResult, Health, Interval, LargestSample};
use crate::stats::mean_interval;
use crate::stats::number::{about, significant};
use crate::stats::tail::{LEAST, tail_index};

/// How many samples are named.
const NAMED: usize = 8;
/// Share of the weighted variance whose tail is looked at.
const MOST: f64 = 0.9;
/// The tail index where nothing is known: its prior's mean and error.
const UNKNOWN: [f64; 2] = [0.5, 0.5];
/// Share of values that counts as the top.
const TOP: f64 = 0.001;

/// Relative standard error of a variance beyond which it is doubtful (MCNP's limit on the relative error of a tally).
const UNSURE: f64 = 0.1;
/// The figure of merit falls: at least the square root of what it was after sixteen times the samples.
const DRIFT: f64 = -0.25;

/// What the last checkpoint's samples say, over all replicates; `None` for estimators without samples, and for less than
/// two samples per value. `samples` per value, `weights` as in the relative variance; pixels are counted from `origin`.
pub fn health(
    last: &[Checkpoint],
    samples: u64,
    weights: &[f64],
    (shape, origin): (Shape, [u32; 2]),
    drift: Option<Interval>,
) -> Option<Health> {
    let values = weights.len();
    if last.is_empty() || !last.iter().all(|c| is_complete(c, values)) {
        return None;
    }
    let n = samples as f64;
    let (mut sum, mut error2, mut zeros) = (0.0, 0.0, 0.0);
    let mut parts = Vec::with_capacity(last.len() * values);
    // (weighted deviation of the largest sample, replicate, value)
    let mut largest = Vec::with_capacity(last.len() * values);
    for (r, c) in last.iter().enumerate() {
        for (i, &w) in weights.iter().enumerate() {
            let (m2, tail) = (c.variance[i] * (n - 1.0), &c.tails[i]);
            parts.push(w * m2);
            sum += w * m2;
            error2 += w * w * m2 * m2 * relative_variance(tail, n);
            zeros += f64::from(tail.zeros);
            largest.push((w.sqrt() * (f64::from(tail.max) - c.mean[i]).max(0.0), r, i));
        }
    }
    let top = ((TOP * parts.len() as f64).ceil() as usize).clamp(1, parts.len());
    parts.select_nth_unstable_by(top - 1, |a, b| b.total_cmp(a));
    let mut maxima = standardised(last, weights);
    let few = maxima.len() < LEAST && maxima.iter().any(|m| *m != maxima[0]);
    let tail_index = tail_index(&mut maxima).map(|t| [t.k, t.error]).or(few.then_some(UNKNOWN));
    let named = NAMED.min(largest.len());
    largest.select_nth_unstable_by(named - 1, |a, b| b.0.total_cmp(&a.0));
    largest.truncate(named);
    largest.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let share = |x: f64| if sum > 0.0 { x / sum } else { 0.0 };
    let name = |&(deviation, r, i): &(f64, usize, usize)| {
        let (pixel, channel) = (i / shape.channels, i % shape.channels);
        let (x, y) = (pixel % shape.width, pixel / shape.width);
        LargestSample {
            replicate: r as u32,
            pixel: [origin[0] + x as u32, origin[1] + y as u32],
            channel: channel as u32,
            sample: last[r].tails[i].argmax(),
            value: last[r].tails[i].max.into(),
            share: share(deviation * deviation),
        }
    };
    let largest: Vec<LargestSample> = largest.iter().filter(|l| l.0 > 0.0).map(name).collect();
    Some(Health {
        variance_of_variance: if sum > 0.0 { error2 / (sum * sum) } else { 0.0 },
        tail_index,
        largest_share: largest.first().map_or(0.0, |l| l.share),
        top_share: share(parts[..top].iter().sum()),
        drift,
        zero_fraction: zeros / (last.len() * values) as f64,
        largest,
    })
}

/// Per value, over all replicates: what [`Health`] says of whole fields.
pub struct Maps {
    /// Variance of the variance, relative.
    pub variance_of_variance: Vec<f64>,
    /// Share of the largest sample in the sum of squared deviations.
    pub largest_share: Vec<f64>,
    /// Fraction of samples that were exactly 0.
    pub zero_fraction: Vec<f64>,
}

impl Maps {
    /// From the last checkpoint; `None` where [`health`] gives none.
    pub fn of(last: &[Checkpoint], samples: u64) -> Option<Self> {
        let values = last.first()?.mean.len();
        if !last.iter().all(|c| is_complete(c, values)) {
            return None;
        }
        let n = samples as f64;
        let ratio = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
        let all = |i: usize| {
            let (mut sum, mut error2, mut largest, mut zeros) = (0.0, 0.0, 0.0f64, 0.0);
            for c in last {
                let (m2, tail) = (c.variance[i] * (n - 1.0), &c.tails[i]);
                sum += m2;
                error2 += m2 * m2 * relative_variance(tail, n);
                largest = largest.max((f64::from(tail.max) - c.mean[i]).powi(2));
                zeros += f64::from(tail.zeros);
            }
            [ratio(error2, sum * sum), ratio(largest, sum), zeros / last.len() as f64]
        };
        let found: Vec<[f64; 3]> = (0..values).map(all).collect();
        let column = |k: usize| found.iter().map(|f| f[k]).collect();
        Some(Self { variance_of_variance: column(0), largest_share: column(1), zero_fraction: column(2) })
    }
}

/// Var(S²)/σ⁴ = (μ₄/σ⁴ − (n−3)/(n−1))/n of n samples. Kendall & Stuart, The Advanced Theory of Statistics 1, §10.9.
fn relative_variance(tail: &Tail, n: f64) -> f64 {
    // Equal samples have neither.
    if tail.fourth == 0.0 { 0.0 } else { (f64::from(tail.fourth) - (n - 3.0) / (n * (n - 1.0))).max(0.0) }
}

/// Whether a checkpoint has samples, at least two per value.
fn is_complete(c: &Checkpoint, values: usize) -> bool {
    c.tails.len() == values && c.variance.iter().all(|v| v.is_finite())
}

/// The largest sample of every value and replicate as a deviation from the mean, over the standard deviation of that value in
/// the *other* replicates: so values of very different size can be looked at together, and a large sample does not hide behind
/// a deviation that it has made itself. Of the values that make [`MOST`] of the weighted variance only: the tail of the others
/// decides nothing. Those that all other replicates found constant have no such scale and are left out.
fn standardised(last: &[Checkpoint], weights: &[f64]) -> Vec<f64> {
    let others = last.len() as f64 - 1.0;
    let of_value = |i: usize| {
        let (mean, variance) = last.iter().fold((0.0, 0.0), |(m, v), c| (m + c.mean[i], v + c.variance[i]));
        last.iter().filter_map(move |c| {
            let scale = ((variance - c.variance[i]) / others).sqrt();
            let deviation = f64::from(c.tails[i].max) - (mean - c.mean[i]) / others;
            // What differs by rounding is equal: two-valued samples have no tail.
            (scale > 0.0 && deviation > 0.0).then(|| (deviation / scale * 65536.0).round() / 65536.0)
        })
    };
    let share = |i: usize| weights[i] * last.iter().map(|c| c.variance[i]).sum::<f64>();
    let mut values: Vec<(f64, usize)> = (0..weights.len()).map(|i| (share(i), i)).collect();
    values.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let wanted = MOST * values.iter().map(|v| v.0).sum::<f64>();
    let before = values.iter().scan(0.0, |sum, v| {
        let before = *sum;
        *sum += v.0;
        Some(before)
    });
    let needed = before.take_while(|b| *b < wanted).count();
    values[..needed].iter().flat_map(|v| of_value(v.1)).collect()
}

/// Slope of log(1/(error² × seconds)) over log N in the second half of the curve (in log N), by the jackknife over replicates.
/// `None` with fewer than three usable checkpoints there or two replicates.
pub fn drift(checkpoints: &[CheckpointResult], squared: bool) -> Option<Interval> {
    let last = checkpoints.last()?.spp as f64;
    let error2 = |v: f64| if squared { v } else { v * v };
    let usable: Vec<_> = usable(checkpoints, squared).into_iter().filter(|c| c.spp as f64 >= last.sqrt()).collect();
    if usable.len() < 3 || usable.iter().any(|c| c.seconds.iter().any(|s| *s <= 0.0)) {
        return None;
    }
    let slopes = slopes(&usable, |c| {
        let errors: Vec<f64> = c.metrics[0].values.iter().map(|&v| error2(v)).collect();
        quotient(&within(&errors).map(f64::recip), &within(&c.seconds)).map(f64::ln)
    })?;
    Some(mean_interval(&slopes, CONFIDENCE))
}

/// Which moment of the samples a statement rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RestsOn {
    /// Means: intervals need to know the variance, but roughly.
    Mean,
    /// Variances and squared errors.
    Variance,
    /// The variance of means over that of samples, whose errors depend on each other.
    Dispersion,
    /// Errors from so many times fewer samples up to all.
    Curve(f64),
}

impl RestsOn {
    /// Largest share of the variance that may be expected in samples that were not seen.
    const fn unseen_limit(self) -> f64 {
        match self {
            Self::Curve(_) => 0.2,
            Self::Mean => 0.1,
            Self::Variance | Self::Dispersion => 0.05,
        }
    }

    /// Largest variance of the variance.
    const fn unsure_limit(self) -> f64 {
        match self {
            Self::Mean => 0.25,
            Self::Variance => f64::INFINITY,
            Self::Dispersion => UNSURE * UNSURE,
            Self::Curve(span) => 0.25 / span,
        }
    }
}

/// Tail indices beyond this are as good as ½, where the variance becomes infinite.
const HEAVIEST: f64 = 0.475;
/// What was not seen is part of the variance's own error up to this part of it.
const SWALLOWED: f64 = 0.5;

impl Health {
    /// Share of the variance to be expected in samples larger than the largest seen. Where P(X > x) falls as x^(−1/k), the
    /// mean of X² beyond the point that one of n samples passes is 1/(1 − 2k) of what that sample contributes.
    pub fn unseen_share(&self) -> f64 {
        let k = self.tail_index.map_or(0.0, |[k, _]| k.clamp(0.0, HEAVIEST));
        self.largest_share / (1.0 - 2.0 * k)
    }

    /// [`Self::unseen_share`] where it could shift the variance by much of its standard error, else 0: for tails up to k = ¼ it
    /// falls faster than that error as samples grow, for heavier ones it stays of its size.
    pub fn shift(&self) -> f64 {
        let unseen = self.unseen_share();
        if unseen > SWALLOWED * self.variance_of_variance.sqrt() { unseen } else { 0.0 }
    }

    /// Why no interval of this kind may be trusted, if so: too much of the variance lies in samples that were not seen, or the
    /// variance is not known well enough.
    pub fn distrust(&self, rests_on: RestsOn) -> Option<String> {
        let limit = rests_on.unsure_limit();
        if self.unseen_share() < rests_on.unseen_limit() && self.variance_of_variance <= limit {
            return None;
        }
        if self.unseen_share() < rests_on.unseen_limit() {
            let [found, limit] = [self.variance_of_variance, limit].map(|v| about(v.sqrt()));
            return Some(format!("the variance is known to ± {found} only; {limit} are needed"));
        }
        let share = about(self.largest_share);
        Some(match self.tail_index {
            Some([k, error]) if k > 0.0 => {
                let (k, error) = (significant(k, 2), significant(error, 1));
                format!(
                    "one sample makes {share} of the variance, and larger ones are to be expected (tail index {k} ± {error})"
                )
            }
            _ => format!("one sample makes {share} of the variance"),
        })
    }

    /// In few words: "good", or what is wrong.
    pub fn word(&self) -> String {
        let found: Vec<_> = self.findings().into_iter().map(|f| f.0).collect();
        if found.is_empty() { "good".into() } else { found.join(", ") }
    }

    /// What is doubtful, each in a sentence; empty where all is well.
    pub fn doubts(&self) -> impl Iterator<Item = String> {
        self.findings().into_iter().map(|f| f.1)
    }

    /// What is doubtful: in two words, and in a sentence.
    fn findings(&self) -> Vec<(&'static str, String)> {
        let tail = self.distrust(RestsOn::Variance);
        let error = self.variance_of_variance.sqrt();
        let falls = self.drift.and_then(|d| d.upper).filter(|&u| u < DRIFT);
        let findings = [
            tail.map(|t| ("heavy tail", format!("{t}: σ/√N is not to be relied on"))),
            (error > UNSURE).then(|| ("variance unsure", format!("the variance is known to ± {} only", about(error)))),
            falls.map(|upper| {
                let power = significant(upper, 2);
                ("merit falls", format!("the figure of merit falls as N to the power {power} or faster"))
            }),
        ];
        findings.into_iter().flatten().collect()
    }
}
