//! Confidence intervals over replicates.

use crate::record::Interval;
use statrs::distribution::{Beta, Binomial, ContinuousCDF, DiscreteCDF, Normal, StudentsT};

/// Degrees of freedom from which on Student's t is all but normal.
pub(crate) const MANY: f64 = 1e4;

/// Two-sided quantile of Student's t: P(|T| ≤ t) = confidence.
pub fn student_t(confidence: f64, degrees: f64) -> f64 {
    let p = 0.5 + 0.5 * confidence;
    match StudentsT::new(0.0, 1.0, degrees) {
        Ok(t) if degrees <= MANY => t.inverse_cdf(p),
        // The limit, with the first term of its expansion (Abramowitz & Stegun 26.7.5): the inverse of statrs fails here.
        _ => {
            let z = Normal::standard().inverse_cdf(p);
            z + (z * z * z + z) / (4.0 * degrees)
        }
    }
}

/// An estimate with its standard error and the degrees of freedom of that error (of Student's t; infinite: it is known).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertain {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
    /// Degrees of freedom.
    pub degrees: f64,
}

impl Uncertain {
    /// The mean of independent values; `None` for fewer than two.
    pub fn mean(values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0);
        (values.len() >= 2).then(|| Self { value: mean, error: (variance / n).sqrt(), degrees: n - 1.0 })
    }

    /// A statistic by the delete-one jackknife: `all` is its value on all replicates, `without[i]` on all but i; `None`
    /// for fewer than two. Efron & Tibshirani, An Introduction to the Bootstrap, 1993, §11.2, with t on n − 1 degrees.
    pub fn jackknife(all: f64, without: &[f64]) -> Option<Self> {
        let n = without.len() as f64;
        let mean = without.iter().sum::<f64>() / n;
        let ss = without.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
        (without.len() >= 2).then(|| Self { value: all, error: ((n - 1.0) / n * ss).sqrt(), degrees: n - 1.0 })
    }

    /// The jackknife of a statistic's logarithm; `None` also where a value is not positive.
    pub fn log_jackknife(all: f64, without: &[f64]) -> Option<Self> {
        let logs: Vec<f64> = without.iter().map(|x| x.ln()).collect();
        Self::jackknife(all.ln(), &logs).filter(|u| u.value.is_finite() && u.error.is_finite())
    }

    /// log(a/b) of two statistics with their leave-one-out values, from independent sets of replicates.
    pub fn log_ratio(a: (f64, &[f64]), b: (f64, &[f64])) -> Option<Self> {
        Some(Self::log_jackknife(a.0, a.1)?.minus(Self::log_jackknife(b.0, b.1)?))
    }

    /// The difference to an independent estimate. Variances add; degrees of freedom by Welch (1947) and Satterthwaite (1946).
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        let error = self.error.hypot(other.error);
        let share = |u: &Self| (u.error / error).powi(4) / u.degrees;
        let degrees = match error {
            0.0 => self.degrees.min(other.degrees),
            _ => 1.0 / (share(&self) + share(&other)),
        };
        Self { value: self.value - other.value, error, degrees }
    }

    /// Everything times a constant.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self { value: self.value * factor, error: self.error * factor.abs(), ..self }
    }

    /// Estimate ± t·standard error.
    pub fn interval(self, confidence: f64) -> Interval {
        let half = student_t(confidence, self.degrees) * self.error;
        let (estimate, lower, upper) = (self.value, Some(self.value - half), Some(self.value + half));
        Interval { estimate, lower, upper, confidence }
    }

    /// The interval of e^x, where this is x.
    pub fn exp_interval(self, confidence: f64) -> Interval {
        let log = self.interval(confidence);
        let [lower, upper] = [log.lower, log.upper].map(|b| b.map(f64::exp));
        Interval { estimate: self.value.exp(), lower, upper, confidence }
    }
}

/// An estimate that nothing is known of but its value.
pub(crate) const fn without_bounds(estimate: f64, confidence: f64) -> Interval {
    Interval { estimate, lower: None, upper: None, confidence }
}

/// Mean of independent values with Student's t interval. No bounds for fewer than two values.
pub fn mean_interval(values: &[f64], confidence: f64) -> Interval {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    Uncertain::mean(values).map_or(without_bounds(mean, confidence), |u| u.interval(confidence))
}

/// Interval of a statistic by [`Uncertain::jackknife`].
pub fn jackknife(all: f64, without: &[f64], confidence: f64) -> Interval {
    Uncertain::jackknife(all, without).map_or(without_bounds(all, confidence), |u| u.interval(confidence))
}

/// Jackknife of the logarithm of a ratio a/b whose parts come from independent sets of replicates; bounds are those of
/// the ratio itself.
pub fn log_ratio(a: f64, a_without: &[f64], b: f64, b_without: &[f64], confidence: f64) -> Interval {
    let ratio = Uncertain::log_ratio((a, a_without), (b, b_without));
    let interval = ratio.map_or(without_bounds(a / b, confidence), |u| u.exp_interval(confidence));
    Interval { estimate: a / b, ..interval }
}

/// The middle of a list; NaN if it is empty.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// Quantile by linear interpolation between order statistics (Hyndman & Fan 1996, type 7); NaN if the list is empty.
pub fn quantile(values: &[f64], q: f64) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let mut v = values.to_vec();
    v.sort_unstable_by(f64::total_cmp);
    let x = q * (v.len() - 1) as f64;
    let (i, f) = (x.floor() as usize, x.fract());
    if f == 0.0 { v[i] } else { v[i] + f * (v[i + 1] - v[i]) }
}

/// Distribution-free interval of the median: order statistics whose binomial coverage is at least `confidence` (Conover,
/// Practical Nonparametric Statistics, §3.2), moved towards the next ones in, which have less, so far that the coverage is about
/// `confidence` (Hettmansperger and Sheather, "Confidence intervals based on interpolated order statistics", Stat. Probab.
/// Lett. 4, 1986). No bounds where the list is too short for the level.
pub fn median_interval(values: &[f64], confidence: f64) -> Interval {
    let estimate = median(values);
    let n = values.len();
    let mut v = values.to_vec();
    v.sort_unstable_by(f64::total_cmp);
    // Largest k with P(k ≤ B ≤ n−k) ≥ confidence, B ~ Binomial(n, ½); the bounds are the k-th values from both ends.
    let flips = Binomial::new(0.5, n as u64).expect("½ is a probability");
    let miss = |k: usize| 2.0 * flips.cdf(k as u64 - 1);
    let allowed = 1.0 - confidence;
    let k = (1..=n / 2).take_while(|&k| miss(k) <= allowed).count();
    if k == 0 {
        return without_bounds(estimate, confidence);
    }
    let spare = if 2 * k < n { (allowed - miss(k)) / (miss(k + 1) - miss(k)) } else { 0.0 };
    let (rank, total) = (k as f64, n as f64);
    let part = (total - rank) * spare / (rank + (total - 2.0 * rank) * spare);
    let between = |outer: f64, inner: f64| outer + part * (inner - outer);
    let (lower, upper) = match part {
        0.0 => (v[k - 1], v[n - k]),
        _ => (between(v[k - 1], v[k]), between(v[n - k], v[n - k - 1])),
    };
    Interval { estimate, lower: Some(lower), upper: Some(upper), confidence }
}

/// Exact interval of a probability from `found` of `trials` (Clopper & Pearson 1934). Where nothing was found all of the
/// error probability goes to the upper bound, which is then about 3/trials at 95 % (the rule of three).
pub fn binomial_interval(found: u64, trials: u64, confidence: f64) -> Interval {
    let (x, n) = (found as f64, trials as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let alpha = (1.0 - confidence) / 2.0;
    let lower = if found == 0 { 0.0 } else { quantile(x, n - x + 1.0, alpha) };
    let upper = match found {
        0 if trials == 0 => 1.0,
        // 1 − α^(1/n)
        0 => -((1.0 - confidence).ln() / n).exp_m1(),
        _ if found >= trials => 1.0,
        _ => quantile(x + 1.0, n - x, 1.0 - alpha),
    };
    Interval { estimate: x / n, lower: Some(lower), upper: Some(upper), confidence }
}
