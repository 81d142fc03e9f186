//! Many tests at once: adjusted p-values, in the order of the input. One that is not a number counts as 1: it shows
//! nothing.

use statrs::distribution::{Binomial, DiscreteCDF};

/// Adjusted p-values of Holm, "A simple sequentially rejective multiple test procedure", Scand. J. Stat. 6, 1979:
/// rejecting those ≤ α makes any false rejection at most α likely, however the tests depend on each other.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut adjusted = valid(p);
    let mut largest = 0.0f64;
    for (rank, i) in ascending(&adjusted).into_iter().enumerate() {
        largest = largest.max((p.len() - rank) as f64 * adjusted[i]).min(1.0);
        adjusted[i] = largest;
    }
    adjusted
}

/// Adjusted p-values of Šidák, "Rectangular confidence regions for the means of multivariate normal distributions",
/// JASA 62, 1967: 1 − (1 − p)^m. Rejecting those ≤ α makes any false rejection at most α likely if the tests are
/// independent.
pub fn sidak(p: &[f64]) -> Vec<f64> {
    let m = p.len() as f64;
    valid(p).into_iter().map(|p| -(m * (-p).ln_1p()).exp_m1()).collect()
}

/// Adjusted p-values of Benjamini and Hochberg, "Controlling the false discovery rate", J. R. Stat. Soc. B 57, 1995:
/// of those ≤ q at most the share q is expected to be false, if the tests are independent or positively dependent.
pub fn benjamini_hochberg(p: &[f64]) -> Vec<f64> {
    let mut adjusted = valid(p);
    let m = p.len() as f64;
    let mut smallest = 1.0f64;
    for (rank, i) in ascending(&adjusted).into_iter().enumerate().rev() {
        smallest = smallest.min(m / (rank + 1) as f64 * adjusted[i]);
        adjusted[i] = smallest;
    }
    adjusted
}

fn valid(p: &[f64]) -> Vec<f64> {
    p.iter().map(|p| if p.is_nan() { 1.0 } else { p.clamp(0.0, 1.0) }).collect()
}

/// Indices from the smallest value to the largest.
fn ascending(p: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&i, &j| p[i].total_cmp(&p[j]));
    order
}

/// Smallest and largest count that `n` independent events of probability `p` give, leaving out at most (1 − level)/2 of
/// probability on either side. All counts where `p` or `level` is no probability.
pub fn binomial_band(n: u64, p: f64, level: f64) -> (u64, u64) {
    match (Binomial::new(p, n), Binomial::new(1.0 - p, n)) {
        (Ok(events), Ok(others)) if (0.0..=1.0).contains(&level) => {
            let tail = 0.5 * (1.0 - level);
            (lower_quantile(&events, n, tail), n - lower_quantile(&others, n, tail))
        }
        _ => (0, n),
    }
}

/// Smallest count whose cumulative probability is at least `tail`.
fn lower_quantile(counts: &Binomial, n: u64, tail: f64) -> u64 {
    let (mut low, mut high) = (0, n);
    while low < high {
        let middle = low + (high - low) / 2;
        if counts.cdf(middle) < tail {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}
