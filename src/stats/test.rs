//! Hypothesis tests. Samples are independent values of finite size; where a list says nothing the answer is `None`.

use super::interval::{Uncertain, median};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};
use statrs::function::factorial::{ln_binomial, ln_factorial};

/// Outcome of a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Test {
    /// What was compared with its distribution under the null hypothesis; infinite where there is no spread at all.
    pub statistic: f64,
    /// Degrees of freedom of the spread; for [`kolmogorov_smirnov`] the number of values.
    pub degrees: f64,
    /// Probability, under the null hypothesis, of a statistic at least as extreme.
    pub p: f64,
}

/// Whether two means are equal: Welch, "The generalization of 'Student's' problem when several different population
/// variances are involved", Biometrika 34, 1947; degrees of freedom by Satterthwaite, Biometrics Bulletin 2, 1946.
/// Two-sided. Lists that both lack spread differ for certain (p = 0) or not at all (p = 1).
/// `None` for fewer than two values in a list or values that are not finite.
pub fn welch(a: &[f64], b: &[f64]) -> Option<Test> {
    let ((ma, va), (mb, vb)) = (moments(a)?, moments(b)?);
    let (na, nb) = (a.len() as f64, b.len() as f64);
    let mean = |value: f64, variance: f64, n: f64| Uncertain { value, error: (variance / n).sqrt(), degrees: n - 1.0 };
    let difference = mean(ma, va, na).minus(mean(mb, vb, nb));
    if !difference.value.is_finite() || !difference.error.is_finite() {
        return None;
    }
    if difference.error == 0.0 {
        return Some(without_spread(difference.value, na + nb - 2.0));
    }
    let (statistic, degrees) = (difference.value / difference.error, difference.degrees);
    let p = 2.0 * StudentsT::new(0.0, 1.0, degrees).ok()?.sf(statistic.abs());
    Some(Test { statistic, degrees, p: p.min(1.0) })
}

/// Whether groups have equal variances: Levene's test on distances from the medians; Brown and Forsythe, "Robust tests
/// for the equality of variances", JASA 69, 1974. F on k − 1 and N − k degrees of freedom, N − k reported. Approximate:
/// with few values per group, above all an odd number, it rejects less often than it says.
/// `None` for fewer than two groups, fewer than three values in a group (two are equally far from their median, which
/// looks like certainty) or values that are not finite.
pub fn brown_forsythe(groups: &[&[f64]]) -> Option<Test> {
    if groups.len() < 2 || groups.iter().any(|g| g.len() < 3 || !g.iter().all(|x| x.is_finite())) {
        return None;
    }
    let distances: Vec<Vec<f64>> = groups
        .iter()
        .map(|g| {
            let middle = median(g);
            g.iter().map(|x| (x - middle).abs()).collect()
        })
        .collect();
    let n = groups.iter().map(|g| g.len()).sum::<usize>() as f64;
    let k = groups.len() as f64;
    let grand = distances.iter().flatten().sum::<f64>() / n;
    let (mut between, mut within) = (0.0, 0.0);
    for d in &distances {
        let mean = d.iter().sum::<f64>() / d.len() as f64;
        between += d.len() as f64 * (mean - grand) * (mean - grand);
        within += d.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
    }
    if !(between + within).is_finite() {
        return None;
    }
    // Groups of two different values are equally far from their median but for rounding, which is no spread.
    let largest = groups.iter().flat_map(|g| g.iter()).fold(0.0, |m: f64, x| m.max(x.abs()));
    let rounding = n * (4.0 * f64::EPSILON * largest).powi(2);
    if within <= rounding {
        return Some(without_spread(if between <= rounding { 0.0 } else { between }, n - k));
    }
    let statistic = between / (k - 1.0) / (within / (n - k));
    let p = FisherSnedecor::new(k - 1.0, n - k).ok()?.sf(statistic);
    Some(Test { statistic, degrees: n - k, p })
}

/// Mean and sample variance; exactly the value and 0 where all values are the same.
/// `None` for fewer than two values or one that is not finite.
fn moments(values: &[f64]) -> Option<(f64, f64)> {
    if values.len() < 2 || !values.iter().all(|x| x.is_finite()) {
        return None;
    }
    let n = values.len() as f64;
    let mean = values[0] + values.iter().map(|x| x - values[0]).sum::<f64>() / n;
    Some((mean, values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0)))
}

/// The verdict on a difference that is known exactly.
fn without_spread(difference: f64, degrees: f64) -> Test {
    if difference == 0.0 {
        Test { statistic: 0.0, degrees, p: 1.0 }
    } else {
        Test { statistic: difference.signum() * f64::INFINITY, degrees, p: 0.0 }
    }
}

/// Most values for which [`kolmogorov_smirnov`] is exact.
const EXACT: usize = 4096;

/// Whether p-values are independent and uniform on \[0, 1\], two-sided. The statistic is the largest distance between
/// the empirical distribution and the diagonal. Exact for up to 4096 values, beyond them right to one part in a
/// thousand. Ties make it conservative, so discrete p-values are welcome. `None` for an empty list or values that are
/// not finite.
pub fn kolmogorov_smirnov(p_values: &[f64]) -> Option<Test> {
    if p_values.is_empty() || !p_values.iter().all(|x| x.is_finite()) {
        return None;
    }
    let mut sorted = p_values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let distance = |(i, x): (usize, &f64)| {
        let x = x.clamp(0.0, 1.0);
        (x - i as f64 / n).max((i + 1) as f64 / n - x)
    };
    let statistic = sorted.iter().enumerate().map(distance).fold(0.0, f64::max);
    Some(Test { statistic, degrees: n, p: kolmogorov_tail(sorted.len(), statistic).clamp(0.0, 1.0) })
}

/// P(Dₙ ≥ d). The choice between the three follows Simard and L'Ecuyer, "Computing the two-sided Kolmogorov–Smirnov
/// distribution", J. Stat. Softw. 39(11), 2011.
fn kolmogorov_tail(n: usize, d: f64) -> f64 {
    let square = n as f64 * d * d;
    if square >= 4.0 {
        // Both sides exceed d together with a relative probability of e^(−6nd²) only.
        2.0 * one_sided_tail(n as u64, d)
    } else if n <= EXACT {
        1.0 - durbin(n, d)
    } else {
        limit_tail(n as f64, square.sqrt())
    }
}

/// P(Dₙ⁺ ≥ d): Birnbaum and Tingey, Ann. Math. Stat. 22, 1951, (3.0).
fn one_sided_tail(n: u64, d: f64) -> f64 {
    let size = n as f64;
    let term = |j: u64| {
        let x = j as f64 / size;
        let rest = (1.0 - d - x).max(0.0);
        (ln_binomial(n, j) + (j as f64 - 1.0) * (d + x).ln() + (size - j as f64) * rest.ln()).exp()
    };
    d * (0..=(size * (1.0 - d)).floor().max(0.0) as u64).map(term).sum::<f64>()
}

/// P(Dₙ < d): Durbin's matrix as Marsaglia, Tsang and Wang, "Evaluating Kolmogorov's distribution", J. Stat. Softw.
/// 8(18), 2003; the matrix carries a factor 1/e, so that its powers stay in range.
fn durbin(n: usize, d: f64) -> f64 {
    let nd = n as f64 * d;
    let k = nd.floor() as usize + 1;
    let m = 2 * k - 1;
    let h = k as f64 - nd;
    let mut inverse_factorials = vec![1.0; m + 1];
    for i in 1..=m {
        inverse_factorials[i] = inverse_factorials[i - 1] / i as f64;
    }
    let edge = |i: usize| (1.0 - h.powi(i as i32)) * inverse_factorials[i];
    let entry = |i: usize, j: usize| match (i, j) {
        (i, 0) if i + 1 == m => {
            (1.0 - 2.0 * h.powi(m as i32) + (2.0 * h - 1.0).max(0.0).powi(m as i32)) * inverse_factorials[m]
        }
        (i, 0) => edge(i + 1),
        (i, j) if i + 1 == m => edge(m - j),
        (i, j) if i + 1 >= j => inverse_factorials[i + 1 - j],
        _ => 0.0,
    };
    let scale = (-1f64).exp();
    let mut square: Vec<f64> = (0..m * m).map(|x| scale * entry(x / m, x % m)).collect();
    let mut row = vec![0.0; m];
    row[k - 1] = 1.0;
    let mut left = n;
    while left > 0 {
        if left % 2 == 1 {
            row = product(&row, &square, m);
        }
        left /= 2;
        if left > 0 {
            square = product(&square, &square, m);
        }
    }
    let n = n as f64;
    row[k - 1] * (ln_factorial(n as u64) + n - n * n.ln()).exp()
}

/// Rows of `a` times the m × m matrix `b`.
fn product(a: &[f64], b: &[f64], m: usize) -> Vec<f64> {
    let mut c = vec![0.0; a.len()];
    for (a, c) in a.chunks_exact(m).zip(c.chunks_exact_mut(m)) {
        for (&a, b) in a.iter().zip(b.chunks_exact(m)) {
            if a != 0.0 {
                c.iter_mut().zip(b).for_each(|(c, b)| *c += a * b);
            }
        }
    }
    c
}

/// P(√n·Dₙ ≥ x) by Kolmogorov's limit with the correction of Vrbik, "Small-sample corrections to Kolmogorov–Smirnov
/// test statistic", Pioneer J. Theor. Appl. Stat. 15, 2018. For large n and x < 2, where four terms are enough unless x
/// is so small that the probability is 1.
fn limit_tail(n: f64, x: f64) -> f64 {
    let x = x + 1.0 / (6.0 * n.sqrt()) + (x - 1.0) / (4.0 * n);
    if x < 0.2 {
        return 1.0;
    }
    let term = |k: i32| f64::from(2 * (k % 2) - 1) * (-2.0 * f64::from(k * k) * x * x).exp();
    2.0 * (1..=20).map(term).sum::<f64>()
}

/// p-value of the claim that a truth lies strictly between two margins, from an estimate of it with a standard error
/// on so many degrees of freedom: the larger of two one-sided t tests. Schuirmann, "A comparison of the two one-sided
/// tests procedure and the power approach …", J. Pharmacokinet. Biopharm. 15, 1987. An estimate without error decides
/// by itself; input that is no estimate shows nothing (p = 1).
pub fn equivalence(value: f64, error: f64, degrees: f64, lower: f64, upper: f64) -> f64 {
    if !value.is_finite() || !(error >= 0.0) || lower.is_nan() || upper.is_nan() {
        return 1.0;
    }
    if error == 0.0 {
        return if lower < value && value < upper { 0.0 } else { 1.0 };
    }
    let Ok(t) = StudentsT::new(0.0, 1.0, degrees) else { return 1.0 };
    let tail = |x: f64| match x {
        f64::INFINITY => 0.0,
        f64::NEG_INFINITY => 1.0,
        x => t.sf(x),
    };
    if error.is_infinite() { 1.0 } else { tail((value - lower) / error).max(tail((upper - value) / error)) }
}
