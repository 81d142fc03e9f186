//! Generator, sequences, discrete tables, heuristics.

use crate::chi2::pearson;
use crate::support::{level, seed};
use proptest::prelude::*;
use rootn::math::LANES;
use rootn::sampling::dimension::{Decision, group};
use rootn::sampling::discrete::Discrete;
use rootn::sampling::rng::{philox4x32, unit_f32, unit_f64};
use rootn::sampling::sequence::{permute, sobol};
use rootn::sampling::strategy::Heuristic;
use rootn::sampling::{Draw, Key, Role, Sequence};
use statrs::distribution::{ContinuousCDF, Normal};

const ALL: [Sequence; 4] = [Sequence::Independent, Sequence::Stratified, Sequence::LatinHypercube, Sequence::Sobol];

fn draw(test: &str, sequence: Sequence, length: u64) -> Draw {
    let key = Key::new(seed(test), Role::Run, "test", 0);
    Draw { key, pixel: 7, sample: 0, length, sequence }
}

/// Known answers of Random123 1.14 (kat_vectors, philox4x32 with 10 rounds).
#[test]
fn philox_known_answers() {
    let cases = [
        ([0; 4], [0; 2], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
        ([u32::MAX; 4], [u32::MAX; 2], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
        (
            [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
            [0xa409_3822, 0x299f_31d0],
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
        ),
    ];
    for (counter, key, answer) in cases {
        assert_eq!(philox4x32(counter, Key(key)), answer);
    }
}

#[test]
fn unit_floats_stay_inside() {
    assert_eq!((unit_f32(0), unit_f32(u32::MAX)), (0.0, 1.0 - f32::EPSILON / 2.0));
    assert_eq!(unit_f64(0, 0), f64::EPSILON / 2.0);
    assert_eq!(unit_f64(u32::MAX, u32::MAX), 1.0 - f64::EPSILON / 2.0);
    assert_eq!(unit_f64(1 << 31, 0), 0.5 + f64::EPSILON / 2.0);
}

/// Whether `count` words fall into `count` equal intervals, one each.
fn one_per_interval(words: &[u32]) -> bool {
    let n = words.len() as u64;
    let mut seen = vec![false; words.len()];
    words.iter().for_each(|&w| seen[((u64::from(w) * n) >> 32) as usize] = true);
    seen.iter().all(|&s| s)
}

/// Whether pairs of words fall into the cells of the grid of rows that `stratified` promises, one each.
fn one_per_cell(pairs: &[[u32; 2]]) -> bool {
    let n = pairs.len() as u64;
    let rows = if n.is_power_of_two() { 1 << (n.ilog2() / 2) } else { n.isqrt() };
    let first = |row: u64| (row * n).div_ceil(rows);
    let mut seen = vec![false; pairs.len()];
    for [x, y] in pairs.iter().map(|p| p.map(u64::from)) {
        let row = (0..rows).rfind(|&r| first(r) << 32 <= y * n).unwrap();
        let columns = first(row + 1) - first(row);
        seen[(first(row) + ((x * columns) >> 32)) as usize] = true;
    }
    seen.iter().all(|&s| s)
}

const COUNTS: [u64; 11] = [1, 2, 3, 5, 7, 12, 16, 64, 100, 1000, 4096];

#[test]
fn every_stratum_gets_one_sample() {
    for n in COUNTS {
        for (group, pixel, block) in [(0, 0, 0), (1, 5, 0), (9, 123_456, 3)] {
            let words = |sequence, shift: u64| -> Vec<[u32; 4]> {
                let d = draw("strata", sequence, n);
                (0..n).map(|i| Draw { pixel, sample: block * n + i + shift, ..d }.words(group)).collect()
            };
            let column = |words: &[[u32; 4]], k: usize| words.iter().map(|w| w[k]).collect::<Vec<_>>();
            let hypercube = words(Sequence::LatinHypercube, 0);
            assert!((0..4).all(|k| one_per_interval(&column(&hypercube, k))), "Latin hypercube, {n}");
            let grid = words(Sequence::Stratified, 0);
            assert!(one_per_cell(&grid.iter().map(|w| [w[0], w[1]]).collect::<Vec<_>>()), "grid, {n}");
            assert!((2..4).all(|k| one_per_interval(&column(&grid, k))), "intervals, {n}");
            // A window that straddles two blocks is not stratified, nor are independent points.
            if n >= 64 {
                let off = words(Sequence::LatinHypercube, 1 + n / 2);
                assert!(!one_per_interval(&column(&off, 0)), "shifted window, {n}");
                let free = words(Sequence::Independent, 0);
                assert!(!one_per_cell(&free.iter().map(|w| [w[0], w[1]]).collect::<Vec<_>>()), "independent, {n}");
            }
        }
    }
}

#[test]
fn long_runs_get_further_blocks() {
    for sequence in ALL {
        let d = draw("long", sequence, u64::MAX);
        let mut words: Vec<_> =
            [0, 1, 1 << 31, 1 << 32, 1 << 33, u64::MAX].map(|sample| Draw { sample, ..d }.words(0)).to_vec();
        words.push(Draw { length: 0, ..d }.words(0));
        words.push(Draw { length: u64::from(u32::MAX), sample: u64::from(u32::MAX) - 1, ..d }.words(0));
        words.sort_unstable();
        words.dedup();
        assert!(words.len() >= 7, "{sequence:?}");
    }
}

#[test]
fn permutations_are_bijections() {
    for length in (1..=130).chain([1000, 4096, 65_537, (1 << 18) - 3]) {
        for seed in [0, 1, 0xDEAD_BEEF] {
            let mut seen = vec![false; length as usize];
            (0..length).for_each(|i| seen[permute(i, length, seed) as usize] = true);
            assert!(seen.iter().all(|&s| s), "length {length}, seed {seed}");
        }
    }
    assert!((0..1000).all(|i| permute(u32::MAX - 1 - i, u32::MAX, i) < u32::MAX));
}

/// Images of two indices: each ordered pair of distinct values equally often.
#[test]
fn permutations_are_uniform_in_pairs() {
    for n in [2u32, 3, 4, 5, 6, 7, 8, 16, 25] {
        let mut worst = 1.0f64;
        for (i, j) in [(0, 1), (0, n - 1), (n / 2, n / 2 - 1)] {
            let mut counts = vec![0; (n * n) as usize];
            let samples = 40_000u32;
            for s in 0..samples {
                let key = philox4x32([s, n, i, j], Key([seed("permutations") as u32, 0]))[0];
                counts[(permute(i, n, key) * n + permute(j, n, key)) as usize] += 1;
            }
            let expected = |k: u32| if k / n == k % n { 0.0 } else { f64::from(samples) / f64::from(n * (n - 1)) };
            worst = worst.min(pearson(&counts, &(0..n * n).map(expected).collect::<Vec<_>>()));
        }
        assert!(worst > level("permutations"), "length {n}: p = {worst:e}");
    }
}

#[test]
fn sobol_starts_as_published() {
    // Joe and Kuo's direction numbers, natural order.
    let eighths = [[0, 0, 0, 0], [4, 4, 4, 4], [2, 6, 6, 6], [6, 2, 2, 2], [1, 5, 3, 1], [5, 1, 7, 5]];
    for (i, point) in (0u32..).zip(eighths) {
        assert_eq!(sobol(i), point.map(|e: u32| e << 29), "point {i}");
    }
}

/// Whether every elementary interval with `bits` digits in two dimensions has the same number of points.
fn equidistributed(points: &[[u32; 4]], dims: [usize; 2], bits: u32) -> bool {
    (0..=bits).all(|a| {
        let mut counts = vec![0usize; 1 << bits];
        for p in points {
            let x = u64::from(p[dims[0]]) >> (32 - a);
            let y = u64::from(p[dims[1]]) >> (32 - (bits - a));
            counts[((x << (bits - a)) | y) as usize] += 1;
        }
        counts.iter().all(|&c| c == points.len() >> bits)
    })
}

/// Quality of a pair of dimensions: t ≤ Σ (degree − 1) (Sobol 1967; Niederreiter 1992, §4.5).
const QUALITY: [u32; 4] = [0, 0, 1, 2];

/// The two four-dimensional points that a direction at a vertex and the light at the next one share.
fn sobol_sets(d: Draw, vertex: u32) -> [[u32; 4]; 2] {
    let direction = d.words(group(vertex, Decision::Direction));
    let light = d.words(group(vertex + 1, Decision::Light));
    [0, 2].map(|k| [direction[k], direction[k + 1], light[k], light[k + 1]])
}

#[test]
fn sobol_fills_elementary_intervals() {
    for (vertex, set) in [(0, 0), (0, 1), (2, 0)] {
        let d = draw("sobol", Sequence::Sobol, 4096);
        for start in [0u64, 4096, 1 << 32] {
            let points: Vec<_> = (0..4096).map(|i| sobol_sets(Draw { sample: start + i, ..d }, vertex)[set]).collect();
            for k in 0..=12 {
                let points = &points[..1 << k];
                for (i, ti) in QUALITY.into_iter().enumerate() {
                    for (j, tj) in QUALITY.into_iter().enumerate() {
                        // One dimension alone is perfect.
                        let t = if i == j { 0 } else { ti + tj };
                        let bits = u32::saturating_sub(k, t);
                        let filled =
                            if i == j { intervals(points, i, k) } else { equidistributed(points, [i, j], bits) };
                        assert!(
                            filled,
                            "vertex {vertex}, set {set}, dimensions {i} and {j}, 2^{k} points from {start}"
                        );
                    }
                }
            }
        }
    }
    let d = draw("sobol", Sequence::Independent, 4096);
    let points: Vec<_> = (0..4096).map(|i| Draw { sample: i, ..d }.words(0)).collect();
    assert!(!equidistributed(&points, [0, 1], 4), "independent points must not pass");
}

fn intervals(points: &[[u32; 4]], dim: usize, bits: u32) -> bool {
    let mut seen = vec![false; 1 << bits];
    points.iter().for_each(|p| seen[(u64::from(p[dim]) >> (32 - bits)) as usize] = true);
    seen.iter().all(|&s| s)
}

/// p-value of pairs of words on a 16 × 16 grid, and of their correlation.
fn independence(pairs: &[[u32; 2]]) -> f64 {
    let mut counts = vec![0; 256];
    pairs.iter().for_each(|p| counts[((p[0] >> 28 << 4) | (p[1] >> 28)) as usize] += 1);
    let n = pairs.len() as f64;
    let p = pearson(&counts, &vec![n / 256.0; 256]);
    let centred = |w: u32| (f64::from(w) + 0.5) / 4_294_967_296.0 - 0.5;
    // Products of independent uniforms have variance 1/144.
    let z = pairs.iter().map(|p| centred(p[0]) * centred(p[1])).sum::<f64>() * 12.0 / n.sqrt();
    p.min(2.0 * Normal::standard().sf(z.abs()))
}

/// Two words of a draw and its neighbours.
type Pair<'a> = &'a dyn Fn(Draw) -> [u32; 2];

/// For one sample index, over pixels: words of a group, of two groups, neighbouring pixels, replicates, roles, strategies and
/// far samples are pairs of independent uniforms, whatever the sequence.
#[test]
fn words_are_uniform_and_independent() {
    const TEST: &str = "words";
    for sequence in ALL {
        for length in [12, 256] {
            let d = draw(TEST, sequence, length);
            let other = |role, strategy, replicate| Key::new(seed(TEST), role, strategy, replicate);
            let pairs =
                |f: Pair| -> Vec<[u32; 2]> { (0..30_000).map(|i| f(Draw { pixel: 2 * i, sample: 5, ..d })).collect() };
            let cases: [(&str, Pair); 9] = [
                ("words 0, 1", &|d| [d.words(3)[0], d.words(3)[1]]),
                ("words 1, 2", &|d| [d.words(3)[1], d.words(3)[2]]),
                ("words 2, 3", &|d| [d.words(3)[2], d.words(3)[3]]),
                ("groups", &|d| [d.words(3)[0], d.words(4)[0]]),
                ("pixels", &|d| [d.words(3)[0], Draw { pixel: d.pixel + 1, ..d }.words(3)[0]]),
                ("replicates", &|d| [d.words(3)[1], Draw { key: other(Role::Run, "test", 1), ..d }.words(3)[1]]),
                ("roles", &|d| [d.words(3)[0], Draw { key: other(Role::Reference, "test", 0), ..d }.words(3)[0]]),
                ("strategies", &|d| [d.words(3)[2], Draw { key: other(Role::Run, "else", 0), ..d }.words(3)[2]]),
                ("blocks", &|d| [d.words(3)[0], Draw { sample: d.sample + (1 << 33), ..d }.words(3)[0]]),
            ];
            for (name, f) in cases {
                let p = independence(&pairs(f));
                assert!(p > level(TEST), "{sequence:?}, length {length}, {name}: p = {p:e}");
            }
            let same = pairs(&|d| [d.words(3)[0], Draw { length: d.length, ..d }.words(3)[0]]);
            assert!(independence(&same) < level(TEST), "a number paired with itself must fail");
        }
    }
}

/// Within one run, over samples: uniform words; and words of independent samples that follow each other are independent.
#[test]
fn runs_are_uniform() {
    const TEST: &str = "runs";
    for sequence in ALL {
        let d = draw(TEST, sequence, 65_536);
        let words: Vec<_> = (0..65_536).map(|i| Draw { sample: i, ..d }.words(2)).collect();
        for k in 0..4 {
            let mut counts = vec![0; 101];
            words.iter().for_each(|w| counts[((u64::from(w[k]) * 101) >> 32) as usize] += 1);
            // Stratified points are more even than chance: only the upper tail counts.
            let p = pearson(&counts, &[65_536.0 / 101.0; 101]);
            assert!(p > level(TEST), "{sequence:?}, word {k}: p = {p:e}");
        }
        if sequence == Sequence::Independent {
            let p = independence(&words.windows(2).map(|w| [w[0][0], w[1][0]]).collect::<Vec<_>>());
            assert!(p > level(TEST), "successive samples: p = {p:e}");
        }
    }
}

#[test]
fn discrete_tables_are_exact() {
    for weights in [vec![1.0], vec![1.0, 1.0], vec![1.0, 2.0, 3.0], vec![1e-30, 1.0, 1e30, 1e-30], vec![0.1; 1000]] {
        let table = Discrete::new(&weights);
        let total: f64 = weights.iter().sum();
        let pmf: Vec<f64> = (0..weights.len()).map(|i| f64::from(table.pmf(i))).collect();
        assert!((pmf.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        for (p, w) in pmf.iter().zip(&weights) {
            assert!(*p > 0.0 && (p - w / total).abs() < 1e-6 * (w / total) + 1e-9, "{p} for {w}");
        }
        // Each outcome is picked by as many words as its probability says.
        let first = |i: usize| -> u64 {
            let (mut low, mut high) = (0u64, 1 << 32);
            while low < high {
                let middle = u64::midpoint(low, high);
                if table.pick(middle as u32) < i { low = middle + 1 } else { high = middle }
            }
            low
        };
        for (i, p) in pmf.iter().enumerate() {
            assert_eq!((first(i + 1) - first(i)) as f32 / 4_294_967_296.0, *p as f32, "outcome {i}");
        }
    }
    assert!(Discrete::new(&[]).is_empty());
}

const COMBINING: [Heuristic; 4] = [Heuristic::Balance, Heuristic::Power, Heuristic::Cutoff, Heuristic::Maximum];

proptest! {
    /// All finite positive densities, by bit pattern: subnormal to the largest.
    #[test]
    fn weights_of_two_techniques_sum_to_one(a in 1u32..0x7f80_0000, b in 1u32..0x7f80_0000) {
        let (p, q) = (f32::from_bits(a), f32::from_bits(b));
        for h in COMBINING {
            let (v, w) = (h.weight(p, q), h.weight(q, p));
            prop_assert!((0.0..=1.0).contains(&v) && (0.0..=1.0).contains(&w));
            prop_assert!((v + w - 1.0).abs() <= 2.0 * f32::EPSILON, "{h:?}: w({p:e}, {q:e}) = {v}, swapped {w}");
            prop_assert!(p < q || v >= w, "{h:?} prefers the smaller density");
        }
        prop_assert_eq!(Heuristic::None.weight(p, q), 1.0);
    }

    /// Near equal densities, where the textbook form works: the same numbers.
    #[test]
    fn weights_follow_the_textbook(p in 0.01f32..100.0, r in 0.01f32..100.0) {
        let q = p * r;
        let (a, b) = (f64::from(p), f64::from(q));
        let near = |w: f32, v: f64| (f64::from(w) - v).abs() < 1e-6;
        prop_assert!(near(Heuristic::Balance.weight(p, q), a / (a + b)));
        prop_assert!(near(Heuristic::Power.weight(p, q), a * a / (a * a + b * b)));
        let larger = if a.min(b) > 0.9991 * a.max(b) { 0.5 } else if a > b { 1.0 } else { 0.0 };
        let clear = !(0.9989..0.9991).contains(&(a.min(b) / a.max(b)));
        prop_assert!(!clear || near(Heuristic::Maximum.weight(p, q), larger));
        let cutoff = if a < 0.0999 * b { Some(0.0) } else if b < 0.0999 * a { Some(1.0) }
            else if a > 0.1001 * b && b > 0.1001 * a { Some(a / (a + b)) } else { None };
        prop_assert!(cutoff.is_none_or(|c| near(Heuristic::Cutoff.weight(p, q), c)));
    }
}

#[test]
fn weights_survive_extremes() {
    for h in COMBINING {
        for (p, q, w) in [
            (1.0, 0.0, 1.0),
            (0.0, 1.0, 0.0),
            (1.0, f32::INFINITY, 0.0),
            (f32::INFINITY, 1.0, 1.0),
            (f32::INFINITY, f32::INFINITY, 0.5),
            (0.0, 0.0, 0.5),
            (1e30, 1e30, 0.5),
            (1e-40, 1e-40, 0.5),
            (1e-30, 0.0, 1.0),
            (1.85e19, 1.0, 1.0),
            (f32::MAX, 1e-45, 1.0),
        ] {
            assert_eq!(h.weight(p, q), w, "{h:?} at {p:e}, {q:e}");
        }
    }
}

/// What a packet of samples gets is what each sample gets on its own: any length, pixels mixed, beyond the announced end.
#[test]
fn words_of_lanes_are_those_of_their_samples() {
    let sequences = [Sequence::Independent, Sequence::Stratified, Sequence::LatinHypercube, Sequence::Sobol];
    for (sequence, length) in sequences.into_iter().flat_map(|s| [0, 1, 100, 128, 1 << 31, 1 << 32].map(|n| (s, n))) {
        for (stride, mixed) in [(1, 0), (1, 1), ((1 << 31) - 1, 0), (37, 1)] {
            let draw = Draw { key: Key([1, 2]), pixel: 9, sample: 0, length, sequence };
            let pixels: [u32; LANES] = std::array::from_fn(|lane| 5 + mixed * (lane as u32 / 3));
            let samples: [u64; LANES] = std::array::from_fn(|lane| 90 + stride * lane as u64);
            for group in [2, 3] {
                let words = draw.words_lanes(&pixels, &samples, group);
                for lane in 0..LANES {
                    let alone = Draw { pixel: pixels[lane], sample: samples[lane], ..draw }.words(group);
                    assert_eq!(words.map(|w| w[lane]), alone, "{sequence:?}, length {length}, lane {lane}");
                }
            }
        }
    }
}
