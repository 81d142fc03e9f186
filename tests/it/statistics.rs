//! Tests, multiplicity, power, bootstrap, tails and repeated looks: values against SciPy 1.17 (each call is beside its
//! constants), promises by simulation.

use crate::stats::{REPETITIONS, Random, binomial, contains, hits};
use crate::support::level;
use rootn::record::Interval;
use rootn::stats::bootstrap::bootstrap_t;
use rootn::stats::multiple::{benjamini_hochberg, binomial_band, holm, sidak};
use rootn::stats::power::{detectable, factor};
use rootn::stats::sequential::spend;
use rootn::stats::tail::{generalised_pareto, tail_index};
use rootn::stats::test::{Test, brown_forsythe, equivalence, kolmogorov_smirnov, welch};
use rootn::stats::{mean_interval, student_t};
use statrs::distribution::{ContinuousCDF, Normal};

const A: [f64; 10] = [3.5, -1.25, 8.0, 2.0, 2.0, 7.75, 0.5, 11.0, -4.0, 6.25];
const B: [f64; 8] = [1.0, 4.0, 2.5, 7.0, 3.0, 9.5, 0.25, 5.0];
const C: [f64; 5] = [20.5, 21.0, 19.75, 22.25, 20.0];
/// Lists that no test must stumble over.
const ODD: [&[f64]; 9] = [
    &[],
    &[1.0],
    &[1.0, 2.0],
    &[0.0; 40],
    &[f64::NAN; 40],
    &[f64::INFINITY; 40],
    &[f64::MAX; 40],
    &[1e308, -1e308, 1e308, -1e308, 1e308, -1e308],
    &[5e-324, 0.0, 5e-324, 0.0, 5e-324, 1e-323],
];

fn close(found: f64, expected: f64, relative: f64) -> bool {
    (found - expected).abs() <= relative * expected.abs()
}

#[test]
fn means_compared() {
    // r = scipy.stats.ttest_ind(x, y, equal_var=False): r.statistic, r.df, r.pvalue
    let expected = [
        (&A[..], &B[..], -0.24934046007051183, 15.568913555591172, 0.8063571456819638),
        (&A, &C, -11.156785843993461, 10.51455286098932, 3.695992541798586e-07),
        (&C, &B, 14.165144901476758, 9.069862758069924, 1.7107993137694997e-07),
    ];
    for (x, y, statistic, degrees, p) in expected {
        let t = welch(x, y).unwrap();
        assert!(close(t.statistic, statistic, 1e-12) && close(t.degrees, degrees, 1e-12), "{t:?}");
        assert!(close(t.p, p, 1e-9), "{t:?}");
        let back = welch(y, x).unwrap();
        assert!(back.statistic == -t.statistic && back.p == t.p);
    }
    // Ten times 0.1 is not 1, and must not look like a difference.
    assert_eq!(welch(&[0.1; 10], &[0.1; 3]), Some(Test { statistic: 0.0, degrees: 11.0, p: 1.0 }));
    assert_eq!(welch(&[0.1; 10], &[0.2; 3]), Some(Test { statistic: f64::NEG_INFINITY, degrees: 11.0, p: 0.0 }));
    assert!(welch(&[0.1; 3], &A).is_some_and(|t| close(t.degrees, 9.0, 1e-12)));
    assert_eq!(welch(&[1.0], &A), None);
    assert_eq!(welch(&[1.0, f64::NAN], &A), None);
}

#[test]
fn spreads_compared() {
    let tens = B.map(|x| 10.0 * x);
    // r = scipy.stats.levene(*groups, center='median'): r.statistic, r.pvalue
    let expected: [(&[&[f64]], f64, f64, f64); 3] = [
        (&[&A, &B], 16.0, 1.5540878889664484, 0.23047556660820515),
        (&[&A, &B, &C], 20.0, 3.5097721672855164, 0.04937643720162341),
        (&[&A, &tens, &C], 20.0, 8.901450894616788, 0.0017181005489944007),
    ];
    for (groups, degrees, statistic, p) in expected {
        let f = brown_forsythe(groups).unwrap();
        assert!(close(f.statistic, statistic, 1e-12) && f.degrees == degrees && close(f.p, p, 1e-9), "{f:?}");
    }
    // Two values per side of the median: no spread of distances, equal or not.
    assert_eq!(brown_forsythe(&[&[0.1, 0.1, 0.3, 0.3], &[0.2, 0.2, 0.4, 0.4]]).unwrap().p, 1.0);
    assert_eq!(brown_forsythe(&[&[0.1, 0.1, 0.3, 0.3], &[0.2, 0.2, 0.6, 0.6]]).unwrap().p, 0.0);
    assert_eq!(brown_forsythe(&[&A]), None);
    assert_eq!(brown_forsythe(&[&A, &[1.0, 2.0]]), None);
    assert_eq!(brown_forsythe(&[&A, &[1.0, 2.0, f64::NAN]]), None);
}

#[test]
fn uniformity() {
    let v = [0.91, 0.02, 0.35, 0.77, 0.48, 0.13, 0.66, 0.58, 0.29, 0.84, 0.22, 0.97];
    // r = scipy.stats.kstest(x, 'uniform', method='exact'): r.statistic, r.pvalue
    let expected: [(&[f64], f64, f64); 5] = [
        (&[0.3], 0.7, 0.6),
        (&[0.02, 0.01], 0.98, 0.0008),
        (&v, 0.10333333333333339, 0.997825305092768),
        (&v.map(|x| x.powi(2)), 0.2941666666666667, 0.20480729122124686),
        (&v.map(|x| x.powi(6)), 0.5840127166506666, 0.0002028439536120958),
    ];
    for (x, statistic, p) in expected {
        let k = kolmogorov_smirnov(x).unwrap();
        assert!(close(k.statistic, statistic, 1e-12) && close(k.p, p, 1e-10), "{k:?}, not {p}");
    }
    // The same with x = ((numpy.arange(n) + 0.5) / n)**e. Above 140 values SciPy's own p is approximate where n·D² < 2.2:
    // scipy.stats._ksstats._kolmogn_DMTW(n, r.statistic, cdf=False) up to 4096; beyond, ours is approximate too.
    let expected = [
        (140, 1.3, 0.11474359864974559, 1e-10),
        (1000, 1.05, 0.8791192907942268, 1e-10),
        (1000, 1.12, 0.0554619221799137, 1e-10),
        (1000, 1.3, 1.344503207377558e-08, 1e-10),
        (4096, 1.05, 0.13616121297218461, 1e-9),
        (4097, 1.05, 0.1360736237415171, 1e-3),
        (20000, 1.02, 0.23440410111567178, 1e-3),
        (20000, 1.05, 4.83562259497132e-06, 1e-9),
    ];
    for (n, e, p, relative) in expected {
        let x: Vec<f64> = (0..n).map(|i| ((f64::from(i) + 0.5) / f64::from(n)).powf(e)).collect();
        let k = kolmogorov_smirnov(&x).unwrap();
        assert!(close(k.p, p, relative), "{n}: {k:?}, not {p}");
    }
    for n in [4096, 4097] {
        let even: Vec<f64> = (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)).collect();
        assert_eq!(kolmogorov_smirnov(&even).unwrap().p, 1.0);
    }
    assert_eq!(kolmogorov_smirnov(&[0.0; 3000]).unwrap().p, 0.0);
    assert_eq!(kolmogorov_smirnov(&[0.5, f64::NAN]), None);
}

/// How often p-values stay below 0.05, as a p-value of its own.
fn nominal(p: &[f64]) -> f64 {
    binomial(p.iter().filter(|p| **p < 0.05).count() as u64, 0.05)
}

#[test]
fn p_values_are_uniform() {
    let test = "uniform p-values";
    let mut random = Random::new(test);
    let (mut t, mut pooled, mut uniform, mut skewed) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for _ in 0..REPETITIONS {
        // Twenty values against five that spread three times as far.
        let (a, b) = (random.list(20, Random::normal), random.list(5, |r| 3.0 * r.normal()));
        let w = welch(&a, &b).unwrap();
        t.push(w.p);
        // The sabotaged twin: the same statistic taken for a normal one.
        pooled.push(2.0 * Normal::standard().sf(w.statistic.abs()));
        let x = random.list(30, |r| r.pair()[0]);
        uniform.push(kolmogorov_smirnov(&x).unwrap().p);
        // The sabotaged twin: values a little too small.
        skewed.push(kolmogorov_smirnov(&x.iter().map(|x| x.powf(1.2)).collect::<Vec<_>>()).unwrap().p);
    }
    let p = |list: &[f64]| kolmogorov_smirnov(list).unwrap().p;
    assert!(nominal(&t) > level(test) && p(&uniform) > level(test) && nominal(&uniform) > level(test));
    assert!(p(&pooled) < level(test) && p(&skewed) < level(test) && nominal(&skewed) < level(test));
}

#[test]
fn equivalences() {
    // max(scipy.stats.t.sf((value - lower) / error, degrees), scipy.stats.t.cdf((value - upper) / error, degrees))
    let expected = [
        (0.1, 0.2, 15.0, -1.0, 1.0, 0.00021164888476699862),
        (0.9, 0.2, 15.0, -1.0, 1.0, 0.3121650567600378),
        (1.2, 0.2, 7.0, -1.0, 1.0, 0.8246916685898963),
        (0.02, 0.01, 31.0, -0.05, 0.05, 0.002644373344495673),
        (-3.0, 1.0, 3.5, f64::NEG_INFINITY, 0.0, 0.02368761974237321),
    ];
    for (value, error, degrees, lower, upper, p) in expected {
        let found = equivalence(value, error, degrees, lower, upper);
        assert!(close(found, p, 1e-9), "{found}, not {p}");
    }
    // p ≤ α exactly where the interval of confidence 1 − 2α lies between the margins.
    let half = 0.2 * student_t(0.9, 15.0);
    assert!(equivalence(0.5, 0.2, 15.0, -1.0, 0.5 + half + 1e-9) < 0.05);
    assert!(equivalence(0.5, 0.2, 15.0, -1.0, 0.5 + half - 1e-9) > 0.05);
    assert_eq!((equivalence(0.0, 0.0, 3.0, -1.0, 1.0), equivalence(1.0, 0.0, 3.0, -1.0, 1.0)), (0.0, 1.0));
    for nothing in [(f64::NAN, 0.1, 3.0, -1.0), (0.0, f64::NAN, 3.0, -1.0), (0.0, 0.1, 0.0, -1.0), (0.0, 0.1, 3.0, 2.0)]
    {
        assert!(equivalence(nothing.0, nothing.1, nothing.2, nothing.3, 1.0) > 0.99);
    }
    assert_eq!(equivalence(0.0, f64::INFINITY, 3.0, f64::NEG_INFINITY, f64::INFINITY), 1.0);
}

#[test]
fn adjusted_p_values() {
    let p = [0.01, 0.04, 0.03, 0.005, 0.2, 0.04];
    // o = numpy.argsort(p, kind='stable'); q[o] = numpy.maximum.accumulate((6 - numpy.arange(6)) * p[o])
    let by_holm = [0.05, 0.12, 0.12, 0.03, 0.2, 0.12];
    // -numpy.expm1(6 * numpy.log1p(-p))
    let by_sidak =
        [0.058519850599, 0.217242210304, 0.16702799507100002, 0.029627490643734374, 0.7378560000000001, 0.217242210304];
    // scipy.stats.false_discovery_control(p)
    let by_bh = [0.03, 0.048, 0.048, 0.03, 0.2, 0.048];
    for (found, expected) in [(holm(&p), by_holm), (sidak(&p), by_sidak), (benjamini_hochberg(&p), by_bh)] {
        assert!(found.iter().zip(expected).all(|(f, e)| close(*f, e, 1e-12)), "{found:?}");
    }
    // Below rounding of 1 − p.
    assert!(close(sidak(&[1e-20; 4])[0], 4e-20, 1e-12));
    let mut random = Random::new("adjusted p-values");
    for n in 0..60 {
        let p: Vec<f64> = random.list(n, |r| r.pair()[0].powi(3));
        let (holm, sidak, bh) = (holm(&p), sidak(&p), benjamini_hochberg(&p));
        for i in 0..n {
            assert!(p[i] <= bh[i] && bh[i] <= holm[i] && holm[i] <= (n as f64 * p[i]).min(1.0));
            assert!(p[i] * (1.0 - 1e-12) <= sidak[i] && sidak[i] <= 1.0);
            for j in 0..n {
                assert!(p[i] > p[j] || (holm[i] <= holm[j] && bh[i] <= bh[j] && sidak[i] <= sidak[j]));
            }
        }
    }
    for adjust in [holm, sidak, benjamini_hochberg] {
        assert!(adjust(&[]).is_empty());
        assert_eq!(adjust(&[f64::NAN, -1.0, f64::INFINITY]), [1.0, 0.0, 1.0]);
    }
}

#[test]
fn bands_of_counts() {
    // scipy.stats.binom.interval(level, n, p)
    let expected = [
        (2000, 0.05, 0.95, (81, 120)),
        (2000, 0.95, 0.999, (1867, 1931)),
        (100, 0.5, 0.99, (37, 63)),
        (10, 0.3, 0.9, (1, 5)),
        (50, 0.001, 0.999999, (0, 3)),
        (1_000_000, 0.25, 1.0 - 1e-6, (247_884, 252_120)),
    ];
    for (n, p, level, band) in expected {
        assert_eq!(binomial_band(n, p, level), band);
    }
    assert_eq!(
        (binomial_band(0, 0.5, 0.9), binomial_band(7, 0.0, 0.9), binomial_band(7, 1.0, 0.9)),
        ((0, 0), (0, 0), (7, 7))
    );
    assert_eq!(
        (binomial_band(7, f64::NAN, 0.9), binomial_band(7, 0.5, 1.0), binomial_band(7, 0.5, 2.0)),
        ((0, 7), (0, 7), (0, 7))
    );
}

#[test]
fn detectable_distances() {
    // Distances of power ± 0.005 by scipy.optimize.brentq, where the power at d is the mean of
    // scipy.stats.nct.sf(t, degrees, d * s) over s = sqrt(scipy.stats.chi2.ppf(u, degrees) / degrees), u by Gauss and Legendre
    // on 400 points, t = scipy.stats.t.ppf(0.5 + confidence / 2, degrees).
    let expected = [
        (3.0, 0.95, 0.8, 5.632103579855051, 5.773966515957759),
        (3.0, 0.95, 0.95, 9.92176064604649, 10.71283139260788),
        (3.0, 0.99, 0.9, 13.522999134557294, 14.0931416910508),
        (3.0, 0.999, 0.8, 21.94870449695778, 22.479029644361),
        (3.0, 0.9999, 0.5, 27.78065174787032, 28.221335575057402),
        (7.0, 0.95, 0.8, 3.6660027934131705, 3.731297747159683),
        (7.0, 0.95, 0.95, 5.328889578847353, 5.583044962699933),
        (7.0, 0.99, 0.9, 6.235551758474055, 6.397805279513549),
        (7.0, 0.999, 0.8, 7.69039649170662, 7.8079675544067655),
        (7.0, 0.9999, 0.5, 7.843853685230639, 7.92550482993793),
        (15.0, 0.95, 0.8, 3.1493327102311746, 3.196855045585757),
        (15.0, 0.95, 0.95, 4.26651695034088, 4.421902835838821),
        (15.0, 0.99, 0.9, 4.756330927052888, 4.8512738150733155),
        (15.0, 0.999, 0.8, 5.399093215953843, 5.462404070971612),
        (15.0, 0.9999, 0.5, 5.217678349558405, 5.2605547769785685),
        (31.0, 0.95, 0.8, 2.9517948408410377, 2.9928535596998516),
        (31.0, 0.95, 0.95, 3.8789729776202657, 4.0016770451554216),
        (31.0, 0.99, 0.9, 4.242777894885151, 4.316239780697927),
        (31.0, 0.999, 0.8, 4.67141039190867, 4.718790073432659),
        (31.0, 0.9999, 0.5, 4.444810362299265, 4.477190853293245),
        (100.0, 0.95, 0.8, 2.8342416481494888, 2.8715498815583094),
        (100.0, 0.95, 0.95, 3.653550742840708, 3.7581823926851006),
        (100.0, 0.99, 0.9, 3.9511577632848867, 4.01293268964776),
        (100.0, 0.999, 0.8, 4.275702475853441, 4.3147486964975235),
        (100.0, 0.9999, 0.5, 4.039782122481816, 4.066897688284336),
    ];
    let mut sums_off = 0;
    for (degrees, confidence, power, low, high) in expected {
        let found = detectable(1.0, degrees, confidence, power);
        assert!((low..high).contains(&found), "{degrees} {confidence} {power}: {found} not in {low}..{high}");
        assert!(close(detectable(0.25, degrees, confidence, power), 0.25 * found, 1e-15));
        let sum = student_t(confidence, degrees) + student_t(2.0 * power - 1.0, degrees);
        sums_off += u32::from(sum < low);
    }
    // The sabotaged twin: the sum of two quantiles of t.
    assert!(sums_off > 5, "{sums_off}");
    // Many degrees: the normal distribution's sum.
    // scipy.stats.norm.ppf(0.975) + scipy.stats.norm.ppf(0.8)
    for degrees in [1e7, 1e300, f64::INFINITY] {
        assert!(close(detectable(1.0, degrees, 0.95, 0.8), 2.8015852181129683, 2e-4));
    }
    let one = detectable(0.5, 15.0, 0.95, 0.8);
    assert!(close(factor(one, 0.5, 15.0, 0.95, 0.8).unwrap(), 1.0, 1e-12));
    assert!(close(factor(-0.5 * one, 0.5, 15.0, 0.95, 0.8).unwrap(), 4.0, 1e-12));
    assert_eq!(factor(0.1, 0.0, 15.0, 0.95, 0.8), Some(0.0));
    for (distance, error) in
        [(0.0, 0.5), (0.0, 0.0), (f64::NAN, 0.5), (0.1, f64::INFINITY), (0.1, -1.0), (0.1, f64::NAN)]
    {
        assert_eq!(factor(distance, error, 15.0, 0.95, 0.8), None);
    }
    for (degrees, confidence, power) in [(0.0, 0.9, 0.8), (f64::NAN, 0.9, 0.8), (9.0, 1.0, 0.8), (9.0, 0.9, 0.0)] {
        assert_eq!(detectable(1.0, degrees, confidence, power), f64::INFINITY);
    }
}

#[test]
fn bootstraps() {
    let v: Vec<f64> = A.iter().chain(&B).chain(&C).copied().collect();
    let i = bootstrap_t(&v, 0.95, 7).unwrap();
    assert!(close(i.estimate, v.iter().sum::<f64>() / 23.0, 1e-14) && i.confidence == 0.95);
    assert_eq!(bootstrap_t(&v, 0.95, 7), Some(i));
    assert_ne!(bootstrap_t(&v, 0.95, 8), Some(i));
    assert_ne!(bootstrap_t(&v, 0.95, 7 << 32), Some(i));
    // A million resamples: b = rng.choice(v, (1000000, 23)); t = (b.mean(1) - v.mean()) / (b.std(1, ddof=1) / sqrt(23));
    // v.mean() - numpy.quantile(t, q) * v.std(ddof=1) / sqrt(23), q = 0.985, 0.965, 0.035, 0.015: three standard errors
    // that 1999 resamples leave on either side of 0.975 and 0.025.
    assert!(i.lower.is_some_and(|l| (4.048..4.626).contains(&l)), "{i:?}");
    assert!(i.upper.is_some_and(|u| (11.138..12.173).contains(&u)), "{i:?}");
    // Symmetric values, about Student's t.
    let even: Vec<f64> = (-60..=60).map(f64::from).collect();
    let (b, t) = (bootstrap_t(&even, 0.9, 1).unwrap(), mean_interval(&even, 0.9));
    assert!(close(b.lower.unwrap(), t.lower.unwrap(), 0.1) && close(b.upper.unwrap(), t.upper.unwrap(), 0.1));
    // One of twenty differs: a third of the resamples lack it and have no spread, so nothing bounds the mean from above.
    let mut rare = [0.0; 20];
    rare[3] = 1.0;
    let i = bootstrap_t(&rare, 0.95, 1).unwrap();
    assert!(i.upper.is_none() && i.lower.is_some_and(|l| l < 0.05), "{i:?}");
    assert_eq!(bootstrap_t(&v[..19], 0.95, 1), None);
    for confidence in [0.0, 0.9999, 1.0, f64::NAN] {
        assert_eq!(bootstrap_t(&v, confidence, 1), None);
    }
}

#[test]
fn coverage_of_bootstraps() {
    let test = "coverage of bootstraps";
    let mut seed = 0;
    let mut cover = |values: &[f64]| {
        seed += 1;
        bootstrap_t(values, 0.95, seed).unwrap()
    };
    let normal = hits(test, |r| contains(&cover(&r.list(20, Random::normal)), 0.0));
    let (mut ours, mut students, mut mirrored) = (0, 0, 0);
    let mut random = Random::new(test);
    for _ in 0..REPETITIONS {
        let values = random.list(20, Random::exponential);
        let i = cover(&values);
        ours += u64::from(contains(&i, 1.0));
        students += u64::from(contains(&mean_interval(&values, 0.95), 1.0));
        // The sabotaged twin: quantiles on the wrong sides.
        let mirror = |b: Option<f64>| b.map(|b| 2.0 * i.estimate - b);
        mirrored += u64::from(contains(&Interval { lower: mirror(i.upper), upper: mirror(i.lower), ..i }, 1.0));
    }
    assert!(binomial(normal, 0.95) > level(test), "{normal}");
    assert!(binomial(ours, 0.95) > level(test), "{ours}");
    assert!(binomial(students, 0.95) < level(test), "{students}");
    assert!(binomial(mirrored, 0.95) < level(test), "{mirrored}");
}

/// A generalised Pareto number of scale 1.
fn pareto(k: f64, u: f64) -> f64 {
    if k == 0.0 { -u.ln() } else { (u.powf(-k) - 1.0) / k }
}

#[test]
fn pareto_fits() {
    // x = 2·scipy.stats.genpareto.ppf((numpy.arange(n) + 0.5) / n, k), fitted by a separate NumPy program:
    // q = 1/x[-1] + (1 − sqrt(m/(j − ½)))/(3·x[⌊n/4 + ½⌋ − 1]), j = 1 … m = 30 + ⌊√n⌋; κ = mean(log1p(−q·x));
    // l = n·(log(−q/κ) − κ − 1); w = 1/sum(exp(l − l_j)); q = sum(w·q); κ = mean(log1p(−q·x));
    // (n·κ + 5)/(n + 10), −κ/q
    let expected = [
        (-0.5, 20, -0.07180131029795091, 1.7558411924483552),
        (-0.5, 200, -0.4362903095972198, 1.9665497770790057),
        (0.0, 20, 0.2275576462537701, 1.8071141077210253),
        (0.0, 200, 0.03437334540487337, 1.9748265161133691),
        (0.3, 20, 0.40260692024553885, 1.858330798787745),
        (0.3, 200, 0.3150712424607649, 1.9839929753913088),
        (0.75, 20, 0.6628619244401951, 1.9517580993318686),
        (0.75, 200, 0.736107272240911, 1.9981078635851706),
    ];
    for (k, n, shape, scale) in expected {
        let x: Vec<f64> = (0..n).map(|i| 2.0 * pareto(k, 1.0 - (f64::from(i) + 0.5) / f64::from(n))).collect();
        let fit = generalised_pareto(&x).unwrap();
        assert!(close(fit.shape, shape, 1e-9) && close(fit.scale, scale, 1e-9), "{k} {n}: {fit:?}");
        let unit = generalised_pareto(&x.iter().rev().map(|x| 1e-9 * x).collect::<Vec<_>>()).unwrap();
        assert!(close(unit.shape, shape, 1e-9) && close(unit.scale, 1e-9 * scale, 1e-9));
    }
    let ties = generalised_pareto(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 5.0]).unwrap();
    assert!(close(ties.shape, 0.15106309923811803, 1e-9) && close(ties.scale, 2.603548618281542, 1e-9));
    for nothing in [&[1.0; 30][..], &[1.0, 2.0, 3.0, 4.0], &[0.0, 1.0, 2.0, 3.0, 4.0], &[-1.0, 1.0, 2.0, 3.0, 4.0]] {
        assert_eq!(generalised_pareto(nothing), None);
    }
}

#[test]
fn tail_indices() {
    let test = "tails";
    let mut random = Random::new(test);
    let allowed = Normal::standard().inverse_cdf(1.0 - 0.5 * level(test));
    for k in [-0.5, 0.0, 0.25, 0.5, 0.75] {
        let mut x = random.list(100_000, |r| pareto(k, r.pair()[0]));
        let found = tail_index(&mut x).unwrap();
        assert_eq!(found.used, 949);
        assert!((found.k - k).abs() < allowed * found.error, "{k}: {found:?}");
        // The sabotaged twins: tails that differ by one half.
        assert!(
            [k - 0.5, k + 0.5].iter().all(|other| (found.k - other).abs() > allowed * found.error),
            "{k}: {found:?}"
        );
    }
}

#[test]
fn tails_of_few_different_values() {
    let mut random = Random::new("tails of few values");
    // Events of probability ½, 0.02, 0.001.
    for p in [0.5, 0.02, 0.001] {
        assert_eq!(tail_index(&mut random.list(4096, |r| f64::from(r.pair()[0] < p))), None);
    }
    let mut levels = random.list(4096, |r| (100.0 * r.pair()[0]).floor());
    let bounded = tail_index(&mut levels).unwrap();
    assert!(bounded.k + 3.0 * bounded.error < 0.0, "{bounded:?}");
    // Mostly zero: what is above the threshold is all that is not zero.
    let found = tail_index(&mut random.list(4096, |r| if r.below(50) == 0 { pareto(0.5, r.pair()[0]) } else { 0.0 }));
    assert!(found.is_some_and(|f| (40..=130).contains(&f.used) && (f.k - 0.5).abs() < 4.0 * f.error), "{found:?}");
    assert_eq!(tail_index(&mut random.list(95, Random::normal)), None);
    assert_eq!(tail_index(&mut random.list(96, Random::normal)).unwrap().used, 20);
    let mut broken = random.list(1000, Random::normal);
    broken[500] = f64::NAN;
    assert_eq!(tail_index(&mut broken), None);
}

#[test]
fn repeated_looks() {
    let test = "repeated looks";
    let sizes = [4, 8, 16, 32];
    let levels = spend(&sizes.map(|n| n as f64 / 32.0), 0.05);
    let expected = [1.0, 3.0, 12.0, 48.0].map(|x| 0.05 * x / 64.0);
    assert!(levels.iter().zip(expected).all(|(l, e)| close(*l, e, 1e-12)), "{levels:?}");
    let alarm = |a: &[f64], b: &[f64], levels: [f64; 4]| {
        sizes.iter().zip(levels).any(|(&n, level)| welch(&a[..n], &b[..n]).unwrap().p <= level)
    };
    let (mut ours, mut naive) = (0, 0);
    let mut random = Random::new(test);
    for _ in 0..REPETITIONS {
        let (a, b) = (random.list(32, Random::normal), random.list(32, Random::normal));
        ours += u64::from(alarm(&a, &b, expected));
        naive += u64::from(alarm(&a, &b, [0.05; 4]));
    }
    let most = binomial_band(REPETITIONS, 0.05, 1.0 - 2.0 * level(test)).1;
    assert!(ours <= most, "{ours} > {most}");
    // The sabotaged twin: every look at the full level.
    assert!(naive > most, "{naive}");
    // Anything but rising shares gets nothing, and never more than alpha in all.
    assert_eq!(spend(&[0.5, 0.2, f64::NAN, 0.5, 1.0, 3.0], 1.0), [0.25, 0.0, 0.0, 0.0, 0.75, 0.0]);
    assert_eq!(spend(&[-1.0, 1.0], f64::NAN), [0.0, 0.0]);
    assert!(spend(&[], 0.05).is_empty());
}

#[test]
fn odd_lists() {
    let finite =
        |t: Option<Test>| t.is_none_or(|t| !t.statistic.is_nan() && t.degrees > 0.0 && (0.0..=1.0).contains(&t.p));
    for a in ODD {
        for b in ODD {
            assert!(finite(welch(a, b)) && finite(brown_forsythe(&[a, b])), "{a:?} {b:?}");
        }
        assert!(finite(kolmogorov_smirnov(a)), "{a:?}");
        assert!(generalised_pareto(a).is_none_or(|f| f.shape.is_finite() && f.scale.is_finite()), "{a:?}");
        assert!(tail_index(&mut a.repeat(20)).is_none_or(|f| f.k.is_finite() && f.error > 0.0), "{a:?}");
        let bootstrapped = bootstrap_t(&a.repeat(20), 0.9, 1);
        assert!(bootstrapped.is_none_or(|i| !i.estimate.is_nan() && i.lower <= i.upper || i.upper.is_none()), "{a:?}");
    }
}
