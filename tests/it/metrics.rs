//! Error metrics against values worked out by hand.

use rootn::stats::Metric;
use rootn::stats::metric::{EPSILON, weight};

const X: [f64; 3] = [1.0, 3.0, 0.5];
const R: [f64; 3] = [2.0, 1.0, 0.0];
/// Variance of the reference's values.
const V: [f64; 3] = [0.04, 0.02, 0.03];

/// Value of each metric for `X` against `R`: differences are −1, 2, ½.
fn by_hand(metric: Metric) -> f64 {
    match metric {
        Metric::RelMse => (1.0 / 4.01 + 4.0 / 1.01 + 0.25 / 0.01) / 3.0,
        Metric::Mse => 5.25 / 3.0,
        Metric::Rmse => 1.75f64.sqrt(),
        Metric::Mae => 3.5 / 3.0,
        Metric::Mape => (1.0 / 2.01 + 2.0 / 1.01 + 0.5 / 0.01) / 3.0,
        Metric::Smape => (2.0 / 3.01 + 4.0 / 4.01 + 1.0 / 0.51) / 3.0,
        // 10 log₁₀(4/1.75)
        Metric::Psnr => 3.590_219_426_416_679,
        Metric::Bias => 0.5,
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-13 * b.abs()
}

#[test]
fn values_by_hand() {
    for metric in Metric::ALL {
        let found = metric.measure(&X, &R, 0.0).value;
        assert!(close(found, by_hand(metric)), "{metric:?}: {found}");
        // All values differ, so a formula in another's place would be seen.
        for other in Metric::ALL.into_iter().filter(|&o| o != metric) {
            assert!(!close(found, by_hand(other)), "{metric:?} {other:?}");
        }
    }
    assert_eq!(EPSILON, 0.01);
    assert!(close(weight(0.3), 10.0));
    // Other ε that are in use would be seen.
    let with = |epsilon: f64| (1.0 / (4.0 + epsilon) + 4.0 / (1.0 + epsilon) + 0.25 / epsilon) / 3.0;
    for epsilon in [1e-2f64.powi(2), 1e-3, 0.1] {
        assert!(!close(Metric::RelMse.measure(&X, &R, 0.0).value, with(epsilon)));
    }
}

#[test]
fn no_error_is_no_error() {
    for metric in Metric::ALL {
        let m = metric.measure(&R, &R, 0.0);
        let expected = if metric == Metric::Psnr { f64::INFINITY } else { 0.0 };
        assert_eq!((m.value, m.trimmed), (expected, expected), "{metric:?}");
    }
}

#[test]
fn the_references_own_variance_is_taken_off_squares() {
    let relative = (0.04 / 4.01 + 0.02 / 1.01 + 0.03 / 0.01) / 3.0;
    assert!(close(Metric::RelMse.reference_share(&R, &V), relative));
    assert!(close(Metric::Mse.reference_share(&R, &V), 0.03));
    for metric in Metric::ALL.into_iter().filter(|m| !m.squared()) {
        assert_eq!(metric.reference_share(&R, &V), 0.0, "{metric:?}");
    }
    let corrected = Metric::RelMse.measure(&X, &R, relative).value;
    assert!(close(corrected, by_hand(Metric::RelMse) - relative));
    assert!(Metric::Mse.measure(&R, &R, 0.03).value < 0.0, "never clamped");
}

#[test]
fn the_trimmed_value_leaves_out_a_thousandth() {
    // 2000 terms: the two largest go, whatever their sign.
    let reference = vec![0.0; 2000];
    let mut x = vec![1.0; 2000];
    x[17] = 100.0;
    x[1900] = -50.0;
    let m = Metric::Mse.measure(&x, &reference, 0.0);
    assert!(close(m.value, (1998.0 + 10_000.0 + 2500.0) / 2000.0) && close(m.trimmed, 1.0));
    let m = Metric::Bias.measure(&x, &reference, 0.0);
    assert!(close(m.value, 2048.0 / 2000.0) && close(m.trimmed, 1.0));
    // A third outlier stays.
    x[3] = 10.0;
    assert!(close(Metric::Mse.measure(&x, &reference, 0.0).trimmed, (1997.0 + 100.0) / 1998.0));
    // Short lists lose one term; a single term stays.
    assert!(close(Metric::Mae.measure(&X, &R, 0.0).trimmed, 0.75));
    assert_eq!(Metric::Mae.measure(&[3.0], &[1.0], 0.0).trimmed, 2.0);
}

#[test]
fn definitions_say_what_is_computed() {
    for metric in Metric::ALL {
        let info = metric.info();
        assert_eq!(serde_json::to_value(metric).unwrap(), info.name.as_str());
        assert_eq!(info.squared, metric.squared());
        let has_epsilon = matches!(metric, Metric::RelMse | Metric::Mape | Metric::Smape);
        assert_eq!(info.formula.contains("0.01"), has_epsilon, "{metric:?}");
    }
}
