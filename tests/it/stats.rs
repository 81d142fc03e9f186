//! Intervals: quantiles against SciPy, coverage by simulation. SciPy 1.17 gave the constants; each call is beside them.

use crate::support::{level, seed};
use rootn::analysis::cost::Curve;
use rootn::analysis::curve::slope;
use rootn::analysis::efficiency::{between, within};
use rootn::analysis::{efficiency_ratio, variance_ratio};
use rootn::record::{CheckpointResult, Dependence, Interval, MetricResult, NonFinite, StrategyResult};
use rootn::sampling::rng::{Key, philox4x32, unit_f64};
use rootn::sampling::strategy::Preset;
use rootn::stats::interval::{Uncertain, log_ratio, median, median_interval, quantile};
use rootn::stats::{jackknife, mean_interval, student_t};
use statrs::distribution::{Binomial, DiscreteCDF};

/// Simulated experiments per coverage test.
pub(crate) const REPETITIONS: u64 = 2000;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-10 * b.abs()
}

/// Random numbers for simulations.
pub(crate) struct Random {
    key: Key,
    counter: u64,
}

impl Random {
    pub(crate) fn new(test: &str) -> Self {
        let s = seed(test);
        Self { key: Key([s as u32, (s >> 32) as u32]), counter: 0 }
    }

    /// Two uniform numbers in (0, 1).
    pub(crate) fn pair(&mut self) -> [f64; 2] {
        self.counter += 1;
        let w = philox4x32([self.counter as u32, (self.counter >> 32) as u32, 0, 0], self.key);
        [unit_f64(w[0], w[1]), unit_f64(w[2], w[3])]
    }

    pub(crate) fn below(&mut self, n: u64) -> u64 {
        (self.pair()[0] * n as f64) as u64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let [u, v] = self.pair();
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    pub(crate) fn exponential(&mut self) -> f64 {
        -self.pair()[0].ln()
    }

    pub(crate) fn list(&mut self, n: usize, mut draw: impl FnMut(&mut Self) -> f64) -> Vec<f64> {
        (0..n).map(|_| draw(self)).collect()
    }
}

pub(crate) fn contains(i: &Interval, truth: f64) -> bool {
    i.lower.unwrap() <= truth && truth <= i.upper.unwrap()
}

/// Two-sided p-value of this many hits in [`REPETITIONS`] where each has probability `p`.
pub(crate) fn binomial(hits: u64, p: f64) -> f64 {
    let b = Binomial::new(p, REPETITIONS).unwrap();
    let above = if hits == 0 { 1.0 } else { b.sf(hits - 1) };
    (2.0 * b.cdf(hits).min(above)).min(1.0)
}

/// How often an experiment's interval contains the truth.
pub(crate) fn hits(test: &str, mut experiment: impl FnMut(&mut Random) -> bool) -> u64 {
    let mut random = Random::new(test);
    (0..REPETITIONS).filter(|_| experiment(&mut random)).count() as u64
}

#[test]
fn quantiles_of_students_t() {
    // scipy.stats.t.ppf(0.5 + 0.5 * confidence, degrees)
    let expected = [
        (0.95, 1.0, 12.706204736174694),
        (0.95, 2.0, 4.302652729749462),
        (0.99, 3.0, 5.840909309733355),
        (0.95, 15.0, 2.131449545559776),
        (0.99, 15.0, 2.946712883475238),
        (0.5, 7.0, 0.7111417780817866),
        (0.999, 31.0, 3.6334563497583714),
        (0.95, 1e4, 1.960201239890626),
        (0.99, 12.75, 3.02212976677384),
        (0.999999, 5.0, 28.478473462183874),
        (0.9, 30.5, 1.6963751158527451),
    ];
    for (confidence, degrees, t) in expected {
        let found = student_t(confidence, degrees);
        assert!((found - t).abs() < 1e-8 * t, "t({confidence}, {degrees}) = {found}, not {t}");
    }
}

#[test]
fn quantiles_of_lists() {
    let v = [3.5, -1.25, 8.0, 2.0, 2.0, 7.75, 0.5, 11.0, -4.0, 6.25];
    // numpy.quantile(v, q)
    for (q, expected) in
        [(0.0, -4.0), (0.05, -2.7625), (0.25, 0.875), (0.5, 2.75), (0.75, 7.375), (0.95, 9.65), (1.0, 11.0)]
    {
        assert!(close(quantile(&v, q), expected), "{q}");
    }
    assert_eq!((median(&[5.0]), median(&[1.0, 2.0]), quantile(&[5.0], 0.9)), (5.0, 1.5, 5.0));
    assert!(median(&[]).is_nan());
}

#[test]
fn intervals_of_means() {
    let v = [3.5, -1.25, 8.0, 2.0, 2.0, 7.75, 0.5, 11.0, -4.0, 6.25];
    // scipy.stats.t.interval(0.95, 9, loc=numpy.mean(v), scale=scipy.stats.sem(v))
    let i = mean_interval(&v, 0.95);
    assert!(close(i.estimate, 3.575));
    assert!(
        (i.lower.unwrap() - 0.2504818774085109).abs() < 1e-8 && (i.upper.unwrap() - 6.899518122591489).abs() < 1e-8
    );
    let one = mean_interval(&[2.0], 0.95);
    assert_eq!((one.estimate, one.lower, one.upper), (2.0, None, None));
    let none = mean_interval(&[], 0.95);
    assert!(none.estimate.is_nan() && none.lower.is_none());
    let same = mean_interval(&[1.5; 4], 0.95);
    assert_eq!((same.lower, same.upper), (Some(1.5), Some(1.5)));
}

#[test]
fn jackknife_intervals() {
    // a = numpy.array([1, 4, 2.5, 7, 3, 9.5, 0.25, 5]); w[i] = numpy.delete(a, i).var(ddof=1);
    // a.var(ddof=1) ± t.ppf(0.975, 7)·sqrt(7/8·sum((w − w.mean())²))
    let a = [1.0, 4.0, 2.5, 7.0, 3.0, 9.5, 0.25, 5.0];
    let b = [2.0, 3.0, 2.5, 2.75, 3.5, 1.5];
    let variance = |x: &[f64]| {
        let m = x.iter().sum::<f64>() / x.len() as f64;
        x.iter().map(|v| (v - m).powi(2)).sum::<f64>() / (x.len() - 1) as f64
    };
    let without =
        |x: &[f64]| -> Vec<f64> { (0..x.len()).map(|i| variance(&[&x[..i], &x[i + 1..]].concat())).collect() };
    let i = jackknife(variance(&a), &without(&a), 0.95);
    assert!(close(i.estimate, 9.5078125));
    assert!((i.lower.unwrap() + 1.7563156436389011).abs() < 1e-7 && (i.upper.unwrap() - 20.7719406436389).abs() < 1e-7);
    // The same for the logarithm of a ratio, with the degrees of freedom of Welch and Satterthwaite (11.5107).
    let r = log_ratio(variance(&a), &without(&a), variance(&b), &without(&b), 0.95);
    assert!(close(r.estimate, 18.627551020408166));
    assert!(
        (r.lower.unwrap() - 2.832672528869272).abs() < 1e-7 && (r.upper.unwrap() - 122.49409470441576).abs() < 1e-6
    );
    // Leaving out one of the replicates directly gives what the downdates of `between` and `within` give.
    let fields: Vec<[f64; 2]> = a.iter().map(|&x| [x, 2.0 * x + 1.0]).collect();
    let fields: Vec<&[f64]> = fields.iter().map(|f| &f[..]).collect();
    let weights = [0.25, 3.0];
    let direct = |x: &[f64]| 5.0 * (0.25 * variance(x) + 3.0 * 4.0 * variance(x)) / 2.0;
    let between = between(&fields, &weights, 5);
    assert!(close(between.all, direct(&a)));
    for (found, i) in between.without.iter().zip(0..) {
        assert!(close(*found, direct(&[&a[..i], &a[i + 1..]].concat())));
    }
    let within = within(&a);
    assert!(close(within.all, 4.03125) && close(within.without[3], 3.607_142_857_142_857));
    // Nothing to say: too few, not positive.
    assert_eq!(jackknife(1.0, &[1.0], 0.95).lower, None);
    assert_eq!(log_ratio(0.0, &[0.0; 4], 1.0, &[1.0; 4], 0.95).lower, None);
    assert!(log_ratio(0.0, &[0.0; 4], 0.0, &[0.0; 4], 0.95).estimate.is_nan());
    let exact = log_ratio(2.0, &[2.0; 4], 1.0, &[1.0; 4], 0.95);
    assert_eq!((exact.lower, exact.upper), (Some(2.0), Some(2.0)));
}

/// Ranks of lower bounds for lists of n: with k = max(k for k in range(1, n // 2 + 1) if 2 * scipy.stats.binom.cdf(k - 1, n, 0.5) <= 1 - c)
/// and the coverages p, q = 1 - 2 * scipy.stats.binom.cdf(k - 1, n, 0.5), 1 - 2 * scipy.stats.binom.cdf(k, n, 0.5),
/// k + (n - k) * i / (k + (n - 2 * k) * i) for i = (p - c) / (p - q).
const MEDIAN_RANKS: [(usize, f64, f64); 8] = [
    (6, 0.95, 1.3571428571428577),
    (8, 0.95, 1.9356435643564358),
    (10, 0.95, 2.657657657657658),
    (16, 0.95, 4.762720103705305),
    (16, 0.99, 3.691100702576113),
    (20, 0.95, 6.235234215885948),
    (32, 0.95, 10.998446801431117),
    (100, 0.99, 37.73798346674204),
];

#[test]
fn intervals_of_medians() {
    for (n, confidence, rank) in MEDIAN_RANKS {
        let values: Vec<f64> = (1..=n).rev().map(|i| i as f64).collect();
        let i = median_interval(&values, confidence);
        let near = |bound: Option<f64>, rank: f64| bound.is_some_and(|b| (b - rank).abs() < 1e-9);
        assert!(near(i.lower, rank) && near(i.upper, (n + 1) as f64 - rank), "{n} {confidence}: {i:?}");
    }
    for (n, confidence) in [(1, 0.95), (5, 0.95), (6, 0.99)] {
        let i = median_interval(&vec![1.0; n], confidence);
        assert_eq!((i.lower, i.upper), (None, None), "{n} values cannot bound at {confidence}");
    }
    assert!(median_interval(&[], 0.95).estimate.is_nan());
    // So many that ½ⁿ underflows: the normal approximation, n/2 ± 1.96·√n/2, is good to one rank.
    let many: Vec<f64> = (1..=4000).map(f64::from).collect();
    let i = median_interval(&many, 0.95);
    assert!(
        i.lower.is_some_and(|l| (l - 1938.5).abs() < 1.5) && i.upper.is_some_and(|u| (u - 2062.5).abs() < 1.5),
        "{i:?}"
    );
}

#[test]
fn coverage_of_medians() {
    for (n, confidence) in [(16, 0.95), (20, 0.95)] {
        let hits = hits("coverage of medians", |random| {
            contains(&median_interval(&random.list(n, Random::exponential), confidence), 2f64.ln())
        });
        assert!(binomial(hits, confidence) > level("coverage of medians"), "{n}: {hits} of {REPETITIONS}");
        // The sabotaged twin: bounds a rank further in.
        assert!(binomial(hits, confidence - 0.06) < level("coverage of medians"));
    }
}

#[test]
fn coverage_of_means() {
    let normal = hits("coverage of means", |r| contains(&mean_interval(&r.list(16, Random::normal), 0.95), 0.0));
    assert!(binomial(normal, 0.95) > level("coverage of means"), "{normal}");
    // Replicates are means of many samples.
    let mean = |r: &mut Random| r.list(256, Random::exponential).iter().sum::<f64>() / 256.0;
    let skewed = hits("coverage of means", |r| contains(&mean_interval(&r.list(16, mean), 0.95), 1.0));
    assert!(binomial(skewed, 0.95) > level("coverage of means"), "{skewed}");
    // The sabotaged twin: s/√n with the normal distribution's quantile, on few replicates.
    let naive = hits("coverage of means", |r| {
        let i = mean_interval(&r.list(4, Random::normal), 0.95);
        let half = (i.upper.unwrap() - i.estimate) * 1.96 / student_t(0.95, 3.0);
        i.estimate.abs() <= half
    });
    assert!(binomial(naive, 0.95) < level("coverage of means"), "{naive}");
}

/// Mean of `values` sample variances, each of 64 normal samples of this variance.
fn variance_replicate(r: &mut Random, variance: f64) -> f64 {
    let x = r.list(64, Random::normal);
    let m = x.iter().sum::<f64>() / 64.0;
    variance * x.iter().map(|v| (v - m).powi(2)).sum::<f64>() / 63.0
}

/// A strategy's result as far as ratios need it.
fn strategy(variances: &[f64], seconds: Vec<f64>) -> StrategyResult {
    let statistic = within(variances);
    StrategyResult {
        name: "s".into(),
        device: "cpu".into(),
        strategy: Preset::Mis.strategy(),
        identity: String::new(),
        dependence: Dependence::Independent,
        setup_seconds: 0.0,
        seconds_per_sample: median_interval(&seconds, 0.95),
        checkpoints: vec![CheckpointResult {
            spp: 64,
            wall_seconds: seconds.clone(),
            seconds,
            metrics: Vec::new(),
            predicted: None,
            refused: None,
        }],
        slope: None,
        relative_variance: jackknife(statistic.all, &statistic.without, 0.95),
        relative_variance_without: statistic.without,
        efficiency_ratio: None,
        variance_ratio: None,
        cost: Vec::new(),
        probes: Vec::new(),
        means: Vec::new(),
        dispersion: None,
        largest_deviation: 0.0,
        health: None,
        non_finite: NonFinite::default(),
        image: None,
    }
}

#[test]
fn coverage_of_ratios() {
    let test = "coverage of ratios";
    let (mut variance, mut efficiency, mut tight, mut unpaired) = (0, 0, 0, 0);
    let mut random = Random::new(test);
    for _ in 0..REPETITIONS {
        let r = &mut random;
        let a = r.list(16, |r| variance_replicate(r, 1.0));
        let b = r.list(16, |r| variance_replicate(r, 4.0));
        // The machine drifts; both strategies of a replicate see the same drift.
        let drift = r.list(16, |r| (0.5 * r.normal()).exp());
        let mut times =
            |scale: f64| -> Vec<f64> { drift.iter().map(|d| scale * d * (0.1 * r.normal()).exp()).collect() };
        let (ta, tb) = (times(3.0), times(1.0));
        let (a, b) = (strategy(&a, ta.clone()), strategy(&b, tb.clone()));
        variance += u64::from(contains(&variance_ratio(&a, &b, 0.95), 0.25));
        let e = efficiency_ratio(&a, &b, 0.95);
        efficiency += u64::from(contains(&e, 4.0 / 3.0));
        // The sabotaged twins: half the width; a ratio of two variances off by a third.
        let half = 0.5 * (e.upper.unwrap() / e.estimate).ln();
        tight += u64::from((e.estimate / (4.0 / 3.0)).ln().abs() <= half);
        unpaired += u64::from(contains(&variance_ratio(&a, &b, 0.95), 0.25 * 4.0 / 3.0));
    }
    assert!(binomial(variance, 0.95) > level(test), "{variance}");
    // Order statistics of sixteen cover 97.9 % where 95 % is asked for: the product is at least as sure as it says.
    assert!(binomial(efficiency.min(1900), 0.95) > level(test), "{efficiency}");
    assert!(efficiency < 1990, "{efficiency}: so wide that it says nothing");
    assert!(binomial(tight, 0.95) < level(test) && binomial(unpaired, 0.95) < level(test), "{tight} {unpaired}");
}

/// Mean squared errors of the running means of sixteen values in one replicate, at N = 1, 2, 4 … 256.
fn errors(r: &mut Random) -> Vec<f64> {
    let mut sums = [0.0; 16];
    let mut errors = Vec::new();
    for k in 0..=8 {
        let added = if k == 0 { 1.0 } else { f64::from(1 << (k - 1)) };
        sums.iter_mut().for_each(|s| *s += added.sqrt() * r.normal());
        let n = f64::from(1 << k);
        errors.push(sums.iter().map(|s| (s / n) * (s / n)).sum::<f64>() / 16.0);
    }
    errors
}

/// Least squares over one curve, with the interval that is right for independent points.
fn naive_slope(errors: &[f64]) -> Interval {
    let points: Vec<(f64, f64)> =
        errors.iter().enumerate().map(|(k, e)| (k as f64 * 2f64.ln(), 0.5 * e.ln())).collect();
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let sxx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let estimate = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / sxx;
    let residual: f64 = points.iter().map(|p| (p.1 - my - estimate * (p.0 - mx)).powi(2)).sum();
    let half = student_t(0.95, n - 2.0) * (residual / (n - 2.0) / sxx).sqrt();
    Interval { estimate, lower: Some(estimate - half), upper: Some(estimate + half), confidence: 0.95 }
}

/// Checkpoints at N = 1, 2, 4 … with each replicate's squared errors, and their seconds by N.
fn curve(replicates: &[Vec<f64>], seconds: impl Fn(u64) -> f64) -> Vec<CheckpointResult> {
    let checkpoint = |k: usize| {
        let values: Vec<f64> = replicates.iter().map(|r| r[k]).collect();
        let seconds = vec![seconds(1 << k); values.len()];
        CheckpointResult {
            spp: 1 << k,
            wall_seconds: seconds.clone(),
            seconds,
            metrics: vec![MetricResult { mean: mean_interval(&values, 0.95), values, trimmed: None }],
            predicted: None,
            refused: None,
        }
    };
    (0..replicates[0].len()).map(checkpoint).collect()
}

/// Squared errors at N = 1, 2, 4 … of a curve with an order per octave.
fn bent(orders: &[f64]) -> Vec<f64> {
    let mut error = vec![1.0];
    orders.iter().for_each(|order| error.push(error[error.len() - 1] * 4f64.powf(*order)));
    error
}

#[test]
fn needs_along_a_bent_curve() {
    let orders = [-1.0, -1.0, -0.6, -0.6];
    let checkpoints = curve(&[bent(&orders), bent(&orders)], |n| 3.0 + 0.1 * n as f64);
    let slope = slope(&checkpoints, true);
    let curve = Curve::new(&checkpoints, true, Dependence::Dependent, slope.as_ref());
    // That of N = 4, 8, 16; the standard deviation of four steps times √(1 + 1/4), on three degrees.
    let order = curve.order.unwrap();
    assert!(close(order.value, -0.6) && close(order.error, (0.16f64 / 3.0 * 1.25).sqrt()), "{order:?}");
    assert!(close(order.degrees, 3.0), "{order:?}");
    // Between N = 2 and 4 the error is ½ to ¼, beyond 16 it falls as N^(−0.6). Seconds lie on the line, first ones included.
    for (target, spp) in [(0.125f64.sqrt(), 8f64.sqrt()), (0.25 * 16f64.powf(-0.6), 64.0)] {
        let need = curve.reach(target).unwrap()[1];
        assert!(close(need[0], spp) && close(need[1], 3.0 + 0.1 * spp), "{target}: {need:?}");
    }
    assert!(curve.doubt(0.125f64.sqrt()).unwrap().error < 1e-12);
    // From 16 on: log of the distance in errors, over the squared order, times the order's error.
    let doubt = curve.doubt(0.25 * 16f64.powf(-0.6)).unwrap();
    assert!(close(doubt.error, 4f64.ln() * 0.6 / 0.36 * order.error), "{doubt:?}");
    // Of independent samples the order is known.
    let curve = Curve::new(&checkpoints, true, Dependence::Independent, slope.as_ref());
    assert_eq!(curve.doubt(0.01).unwrap().error, 0.0);
}

/// Orders that differ from octave to octave: a forecast of the next one must allow for it.
#[test]
fn coverage_of_forecasts_of_bent_curves() {
    let test = "coverage of forecasts of bent curves";
    let mut random = Random::new(test);
    let (mut ours, mut power_law) = (0, 0);
    for _ in 0..REPETITIONS {
        let orders: Vec<f64> = (0..6).map(|_| -0.7 + 0.1 * random.normal()).collect();
        let exact = bent(&orders);
        let mut noisy = || exact.iter().map(|e| e * (0.08 * random.normal()).exp()).collect::<Vec<_>>();
        let (pilot, next): (Vec<_>, Vec<f64>) = ((0..16).map(|_| noisy()[..6].to_vec()).collect(), noisy());
        let checkpoints = curve(&pilot, |n| n as f64);
        let slope = slope(&checkpoints, true);
        let mut curve = Curve::new(&checkpoints, true, Dependence::Dependent, slope.as_ref());
        let order = curve.order.unwrap();
        let target = exact[6].sqrt();
        let needed = 64.0 * (next[6].sqrt() / target).powf(-1.0 / order.value);
        ours += u64::from(contains(&curve.forecast(target).unwrap().spp, needed));
        let fit = slope.as_ref().and_then(|s| Uncertain::mean(&s.values));
        curve.order = fit;
        power_law += u64::from(contains(&curve.forecast(target).unwrap().spp, needed));
    }
    // Degrees of freedom after Satterthwaite are an approximation: 87 to 93 % of 90.
    let (least, most) = (binomial(ours, 0.87), binomial(ours, 0.93));
    assert!(ours as f64 > 0.9 * REPETITIONS as f64 || least > level(test), "{ours}");
    assert!((ours as f64) < 0.9 * REPETITIONS as f64 || most > level(test), "{ours}");
    // The sabotaged twin knows the order as well as the fit of a straight line.
    assert!(binomial(power_law, 0.87) < level(test) && power_law < ours, "{power_law}");
}

#[test]
fn coverage_of_slopes() {
    let test = "coverage of slopes";
    let (mut ours, mut naive) = (0, 0);
    let mut random = Random::new(test);
    for _ in 0..REPETITIONS {
        let replicates: Vec<Vec<f64>> = (0..16).map(|_| errors(&mut random)).collect();
        let checkpoints = curve(&replicates, |_| 1.0);
        ours += u64::from(contains(&slope(&checkpoints, true).unwrap().slope, -0.5));
        naive += u64::from(contains(&naive_slope(&replicates[0]), -0.5));
    }
    assert!(binomial(ours, 0.95) > level(test), "{ours}");
    // The sabotaged twin: prefixes of one running mean are no independent points.
    assert!(binomial(naive, 0.95) < level(test), "{naive}");
}
