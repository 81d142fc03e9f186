//! Looking at data more than once.

/// Level of each look at data that grow to the given shares of the final amount, such that all looks together raise a
/// false alarm with probability `alpha` at most: increments of the spending function alpha·t² (Lan and DeMets,
/// "Discrete sequential boundaries for clinical trials", Biometrika 70, 1983; Kim and DeMets, "Design and analysis of
/// group sequential tests based on the type I error spending rate function", Biometrika 74, 1987, power family).
///
/// Each increment is its look's own level, and by the union bound their sum holds whatever the dependence between looks.
/// Exact boundaries would spend what earlier looks leave, but need the looks' joint distribution: t statistics on few
/// replicates are not jointly normal.
///
/// Shares rise to 1; one that does not rise, or is not a number, gets nothing. All get nothing if `alpha` is no
/// probability.
pub fn spend(fractions: &[f64], alpha: f64) -> Vec<f64> {
    let alpha = if (0.0..=1.0).contains(&alpha) { alpha } else { 0.0 };
    let mut spent = 0.0;
    fractions
        .iter()
        .map(|t| {
            let t = t.clamp(0.0, 1.0);
            let total = if t.is_nan() { spent } else { (alpha * t * t).max(spent) };
            let level = total - spent;
            spent = total;
            level
        })
        .collect()
}
