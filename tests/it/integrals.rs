//! Integrands with known values, and what the harness makes of them.

use crate::support::{level, seed};
use rootn::estimator::integrand::{Integrand, IntegrandEstimator};
use rootn::estimator::mock::{Distribution, Knobs, Mock};
use rootn::estimator::{Cell, Estimator};
use rootn::record::{Interval, SceneResult, StrategyResult};
use rootn::run::{Contender, Options, Plan, PlannedScene, ReferencePlan, Stop, powers_of_two, run};
use rootn::sampling::strategy::{Preset, Strategy};
use rootn::sampling::{Key, Sequence};
use rootn::stats::metric::weight;
use rootn::stats::{Metric, mean_interval};

/// Side of the field: 144 estimates side by side.
const SIDE: usize = 12;

/// Midpoint sums of f and f² over a grid of n points per dimension.
fn midpoint(integrand: Integrand, n: usize) -> [f64; 2] {
    let at = |i: usize| (i as f64 + 0.5) / n as f64;
    let mut sums = [0.0; 2];
    let mut add = |f: f64| {
        sums[0] += f;
        sums[1] += f * f;
    };
    match integrand.dimensions() {
        1 => (0..n).for_each(|i| add(integrand.eval(&[at(i)]))),
        _ => (0..n * n).for_each(|k| add(integrand.eval(&[at(k / n), at(k % n)]))),
    }
    sums.map(|s| s / (n as f64).powi(integrand.dimensions() as i32))
}

/// Integrals of f and f², numerically.
fn quadrature(integrand: Integrand) -> [f64; 2] {
    match integrand {
        Integrand::Gaussian2d => midpoint(integrand, 1000),
        Integrand::Disc => midpoint(integrand, 3000),
        // x = t⁴ takes the pole away.
        Integrand::Root | Integrand::InverseSqrt => {
            let n = 100_000;
            let t = (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n));
            let power = |k| t.clone().map(|t| integrand.eval(&[t.powi(4)]).powi(k) * 4.0 * t.powi(3)).sum::<f64>();
            [power(1), power(2)].map(|s| s / f64::from(n))
        }
        // A product of equal factors: one of them, then its power.
        Integrand::ProductPeak6d => {
            let factor = |x: f64| integrand.eval(&[x; 6]).powf(1.0 / 6.0);
            let u = [0.1, 0.9, 0.35, 0.5, 0.77, 0.02];
            let product: f64 = u.iter().map(|&x| factor(x)).product();
            assert!((product - integrand.eval(&u)).abs() < 1e-12 * product);
            let n = 10_000;
            let x = (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n));
            [1, 2].map(|k| (x.clone().map(|x| factor(x).powi(k)).sum::<f64>() / f64::from(n)).powi(6))
        }
        _ => midpoint(integrand, 10_000),
    }
}

#[test]
fn stated_integrals_and_variances_are_right() {
    for integrand in Integrand::ALL {
        let [f, f2] = quadrature(integrand);
        // The grid sees a curved edge to about a part in 10⁵.
        let tolerance = if integrand == Integrand::Disc { 1e-4 } else { 1e-6 };
        assert!((f - integrand.integral()).abs() < tolerance * f, "{}: {f}", integrand.label());
        let variance = integrand.variance();
        if variance.is_infinite() {
            // ∫ f² over (t₀⁴, 1) grows without end as t₀ falls; the midpoint sum grows with its number of points.
            assert!(f2 > 40.0, "{f2}");
        } else {
            let found = f2 - f * f;
            assert!((found - variance).abs() < 10.0 * tolerance * f2, "{}: {found}", integrand.label());
        }
        assert_eq!(serde_json::to_value(integrand).unwrap(), integrand.label());
    }
}

/// The result of measuring an integrand with points of a sequence.
fn measured(test: &str, integrand: Integrand, sequences: &[Sequence], samples: u64) -> SceneResult {
    let out = tempfile::tempdir().unwrap();
    let contender = |&sequence: &Sequence| Contender {
        name: format!("{sequence:?}"),
        device: "cpu".into(),
        strategy: Strategy { sequence, ..Preset::Mis.strategy() },
        estimator: Box::new(IntegrandEstimator { integrand, size: [SIDE; 2], sequence }),
    };
    let plan = Plan {
        name: "test".into(),
        question: None,
        experiment: String::new(),
        seed: seed(test),
        replicates: 16,
        stop: Stop::Never,
        checkpoints: powers_of_two(samples),
        metrics: vec![Metric::RelMse],
        targets: vec![0.01],
        probes: Vec::new(),
        log_pixels: false,
        scenes: vec![PlannedScene {
            name: integrand.label().into(),
            contenders: sequences.iter().map(contender).collect(),
            reference: ReferencePlan::Exact(integrand.integral()),
            max_depth: None,
            rendered: true,
        }],
        claims: Vec::new(),
        devices: Vec::new(),
        warnings: Vec::new(),
    };
    let options = Options { out: out.path().to_owned(), fresh: false, quiet: true };
    run(&plan, &options).unwrap().0.scenes.remove(0)
}

fn contains(i: &Interval, truth: f64) -> bool {
    i.lower.unwrap() <= truth && truth <= i.upper.unwrap()
}

/// The slope with an interval at the test's level.
fn slope(test: &str, s: &StrategyResult) -> Interval {
    mean_interval(&s.slope.as_ref().unwrap().values, 1.0 - level(test))
}

#[test]
fn independent_samples_converge_as_one_over_root_n() {
    let test = "order of independent samples";
    for integrand in
        [Integrand::Linear, Integrand::Gaussian2d, Integrand::Step, Integrand::Disc, Integrand::ProductPeak6d]
    {
        let scene = measured(test, integrand, &[Sequence::Independent], 256);
        let s = &scene.strategies[0];
        let slope = slope(test, s);
        assert!(contains(&slope, -0.5), "{}: {slope:?}", integrand.label());
        // Narrow enough to exclude what a bug would give.
        assert!(!contains(&slope, -0.55) && !contains(&slope, -0.45), "{slope:?}");
        // Relative variance: w·σ².
        let expected = weight(integrand.integral()) * integrand.variance();
        let variances =
            rootn::stats::jackknife(s.relative_variance.estimate, &s.relative_variance_without, 1.0 - level(test));
        assert!(contains(&variances, expected), "{}: {variances:?} {expected}", integrand.label());
        assert!(!contains(&variances, expected * 1.1) || integrand == Integrand::ProductPeak6d);
        // σ/√N predicts the measured error.
        let last = s.checkpoints.last().unwrap();
        let predicted = last.predicted.unwrap();
        let relative = mean_interval(&last.metrics[0].values, 1.0 - level(test));
        assert!(contains(&relative, predicted), "{}: {relative:?} {predicted}", integrand.label());
        assert!(!contains(&relative, 2.0 * predicted));
        // Cost: σ²/target².
        let cost = s.cost.iter().find(|c| c.target == 0.01).unwrap();
        assert!((cost.spp - s.relative_variance.estimate / 1e-4).abs() < 1e-9 * cost.spp);
        assert_eq!(cost.extrapolated, cost.spp > 256.0);
    }
}

#[test]
fn orders_of_points_that_are_spread() {
    let test = "orders of spread points";
    use Sequence::{LatinHypercube, Sobol, Stratified};
    let linear = measured(test, Integrand::Linear, &[Stratified, LatinHypercube, Sobol], 256);
    for s in &linear.strategies {
        let slope = slope(test, s);
        assert!(contains(&slope, -1.5), "{}: {slope:?}", s.name);
        assert!(!contains(&slope, -1.4) && !contains(&slope, -1.6) && !contains(&slope, -1.0), "{slope:?}");
    }
    let plane = measured(test, Integrand::Gaussian2d, &[Stratified, LatinHypercube, Sobol], 256);
    let slopes: Vec<Interval> = plane.strategies.iter().map(|s| slope(test, s)).collect();
    assert!(contains(&slopes[0], -1.0) && !contains(&slopes[0], -0.9), "{:?}", slopes[0]);
    // A Latin hypercube takes the additive part away, no more.
    assert!(slopes[1].upper.unwrap() < -0.6 && slopes[1].lower.unwrap() > -0.8, "{:?}", slopes[1]);
    assert!(slopes[2].upper.unwrap() < -1.3 && slopes[2].lower.unwrap() > -1.55, "{:?}", slopes[2]);
    assert!(plane.strategies[2].variance_ratio.as_ref().unwrap().ratio.upper.unwrap() < 0.1);
    let jump = measured(test, Integrand::Step, &[Stratified, Sobol], 256);
    for s in &jump.strategies {
        let slope = slope(test, s);
        assert!(slope.upper.unwrap() < -0.9 && slope.lower.unwrap() > -1.1, "{slope:?}");
    }
}

#[test]
fn a_constant_has_no_error_and_no_ratios() {
    use Sequence::{Independent, LatinHypercube, Sobol, Stratified};
    let scene = measured("", Integrand::Constant, &[Independent, Stratified, LatinHypercube, Sobol], 100);
    for s in &scene.strategies {
        assert!(s.checkpoints.iter().flat_map(|c| &c.metrics[0].values).all(|&v| v == 0.0));
        assert_eq!(s.relative_variance.estimate, 0.0);
        assert!(s.slope.is_none() && s.efficiency_ratio.is_none() && s.variance_ratio.is_none() && s.cost.is_empty());
    }
    assert_eq!(
        scene.strategies[0].checkpoints.iter().map(|c| c.spp).collect::<Vec<_>>(),
        [1, 2, 4, 8, 16, 32, 64, 100]
    );
}

#[test]
fn rare_and_unbounded_values_are_told() {
    let test = "rare values";
    let spike = measured(test, Integrand::Spike, &[Sequence::Independent, Sequence::Stratified], 1024);
    let s = &spike.strategies[0];
    let interval =
        rootn::stats::jackknife(s.relative_variance.estimate, &s.relative_variance_without, 1.0 - level(test));
    assert!(contains(&interval, weight(1.0) * 999.0), "{interval:?}");
    // Infinite variance: the estimate still converges, and nothing is NaN.
    let pole = measured(test, Integrand::InverseSqrt, &[Sequence::Independent, Sequence::Sobol], 256);
    for s in &pole.strategies {
        assert!(s.slope.as_ref().unwrap().slope.upper.unwrap() < -0.2);
        assert!(s.relative_variance.estimate.is_finite());
    }
}

#[test]
fn mocks_have_the_mean_and_the_variance_that_they_say() {
    use Distribution::{Bernoulli, Exponential, LogNormal, Normal, Pareto3};
    for distribution in [Normal, Exponential, Bernoulli, LogNormal, Pareto3] {
        let knobs = Knobs { spread: 2.0, bias: 0.5, ..Knobs::default() };
        let mock = Mock { distribution, knobs, size: [16, 16], sequence: Sequence::Stratified };
        // Strata leave next to no noise in the mean, and little in the variance of 2²⁰ samples.
        let cell = Cell { key: Key([7, 9]), length: 4096 };
        let estimate = mock.estimate(&cell, 4096, &mut None).unwrap();
        let mean = estimate.field.iter().sum::<f64>() / 256.0;
        assert!((mean - 1.5).abs() < 0.005, "{distribution:?}: {mean}");
        let variances = estimate.moments.unwrap().fold_map(|m| m.sample_variance().unwrap());
        let variance = variances.iter().sum::<f64>() / 256.0;
        // Pareto 3 has no fourth moment, and its variance converges slowly.
        assert!((variance / (4.0 * distribution.variance()) - 1.0).abs() < 0.1, "{distribution:?}: {variance}");
        assert!((estimate.seconds / (256.0 * 4096.0 * 1e-6) - 1.0).abs() < 0.1, "{distribution:?}");
    }
}
