//! Confidence intervals over replicates.

use crate::record::Interval;
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, StudentsT};

/// Two-sided quantile of Student's t: P(|T| ≤ t) = confidence.
pub fn student_t(confidence: f64, degrees: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees).expect("positive degrees of freedom").inverse_cdf(0.5 + 0.5 * confidence)
}

/// Mean of independent values with Student's t interval. No bounds for fewer than two values.
pub fn mean_interval(values: &[f64], confidence: f64) -> Interval {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    if values.len() < 2 {
        return Interval { estimate: mean, lower: None, upper: None, confidence };
    }
    let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0);
    around(mean, (variance / n).sqrt(), n - 1.0, confidence)
}

/// Estimate ± t·standard error.
fn around(estimate: f64, standard_error: f64, degrees: f64, confidence: f64) -> Interval {
    let half = student_t(confidence, degrees) * standard_error;
    Interval { estimate, lower: Some(estimate - half), upper: Some(estimate + half), confidence }
}

/// Delete-one jackknife interval of a statistic: `all` is its value on all replicates, `without[i]` on all but i.
/// Efron & Tibshirani, An Introduction to the Bootstrap, 1993, §11.2 (standard error), with t on n − 1 degrees.
pub fn jackknife(all: f64, without: &[f64], confidence: f64) -> Interval {
    let n = without.len() as f64;
    if without.len() < 2 {
        return Interval { estimate: all, lower: None, upper: None, confidence };
    }
    let mean = without.iter().sum::<f64>() / n;
    let ss = without.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
    around(all, ((n - 1.0) / n * ss).sqrt(), n - 1.0, confidence)
}

/// Jackknife of the logarithm of a ratio a/b whose parts come from independent sets of replicates; bounds are those of
/// the ratio itself. Variances of the two logarithms add; degrees of freedom by Welch and Satterthwaite.
pub fn log_ratio(a: f64, a_without: &[f64], b: f64, b_without: &[f64], confidence: f64) -> Interval {
    let estimate = a / b;
    let none = Interval { estimate, lower: None, upper: None, confidence };
    if a_without.len() < 2 || b_without.len() < 2 || !(a > 0.0 && b > 0.0) {
        return none;
    }
    let part = |without: &[f64]| {
        let n = without.len() as f64;
        let logs: Vec<f64> = without.iter().map(|x| x.ln()).collect();
        let mean = logs.iter().sum::<f64>() / n;
        ((n - 1.0) / n * logs.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>(), n - 1.0)
    };
    let ((va, da), (vb, db)) = (part(a_without), part(b_without));
    let v = va + vb;
    if !v.is_finite() {
        return none;
    }
    if v == 0.0 {
        return Interval { lower: Some(estimate), upper: Some(estimate), ..none };
    }
    let degrees = v * v / (va * va / da + vb * vb / db);
    let log = around(estimate.ln(), v.sqrt(), degrees, confidence);
    Interval { lower: log.lower.map(f64::exp), upper: log.upper.map(f64::exp), ..none }
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

/// Distribution-free interval of the median: order statistics whose binomial coverage is at least `confidence`
/// (Conover, Practical Nonparametric Statistics, §3.2). No bounds where the list is too short for the level.
pub fn median_interval(values: &[f64], confidence: f64) -> Interval {
    let estimate = median(values);
    let n = values.len();
    let mut v = values.to_vec();
    v.sort_unstable_by(f64::total_cmp);
    // Largest k with P(k ≤ B ≤ n−k) ≥ confidence, B ~ Binomial(n, ½); the bounds are the k-th values from both ends.
    let flips = Binomial::new(0.5, n as u64).expect("½ is a probability");
    let k = (0..n / 2).take_while(|&k| 2.0 * flips.cdf(k as u64) <= 1.0 - confidence).count();
    if k == 0 {
        return Interval { estimate, lower: None, upper: None, confidence };
    }
    Interval { estimate, lower: Some(v[k - 1]), upper: Some(v[n - k]), confidence }
}
