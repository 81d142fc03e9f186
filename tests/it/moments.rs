//! Running moments: closed forms, merging, the block tree, samples that do not count.

use rootn::moments::{BLOCK, BlockTree, Moments};
use rootn::sampling::rng::{Key, philox4x32, unit_f64};
use std::ops::Range;

/// |a − b| relative to |b|.
fn off(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b).abs() / b.abs() }
}

/// mean, Σd², Σd³, Σd⁴ in two passes.
fn two_pass(x: &[f64]) -> [f64; 4] {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let power = |k| x.iter().map(|v| (v - mean).powi(k)).sum();
    [mean, power(2), power(3), power(4)]
}

/// Whether the moments are those of the list, up to rounding: relative to the sum of the terms' sizes.
fn agree(m: &Moments, x: &[f64]) -> bool {
    let expected = two_pass(x);
    let size = |k| x.iter().map(|v| (v - expected[0]).abs().powi(k)).sum::<f64>();
    let sizes = [x.iter().map(|v| v.abs()).sum::<f64>() / x.len() as f64, size(2), size(3), size(4)];
    four(m).iter().zip(expected).zip(sizes).all(|((a, b), size)| (a - b).abs() <= 1e-12 * size)
}

fn four(m: &Moments) -> [f64; 4] {
    [m.mean, m.m2, m.m3, m.m4]
}

/// Sample `index` of a channel of a pixel: skewed, with a spread of magnitudes.
fn sample(pixel: u32, index: u64, channel: usize) -> f64 {
    let w = philox4x32([pixel, index as u32, channel as u32, 0], Key([5, 6]));
    let u = unit_f64(w[0], w[1]);
    (-u.ln()).powi(2) * 10f64.powi((w[2] % 5) as i32 - 2)
}

/// What a batch holds: (pixel, sample), pixel by pixel.
fn identities(pixels: Range<u32>, samples: Range<u64>) -> impl Iterator<Item = (u32, u64)> {
    pixels.flat_map(move |pixel| samples.clone().map(move |sample| (pixel, sample)))
}

fn fill(channels: usize) -> impl Fn(Range<u32>, Range<u64>, &mut [f64]) + Sync {
    move |pixels, samples, out| {
        for ((pixel, index), out) in identities(pixels, samples).zip(out.chunks_exact_mut(channels)) {
            out.iter_mut().enumerate().for_each(|(c, x)| *x = sample(pixel, index, c));
        }
    }
}

/// A tree grown to `ends` one after the other.
fn grown(pixels: usize, channels: usize, ends: impl IntoIterator<Item = u64>) -> BlockTree {
    ends.into_iter().fold(BlockTree::new(channels), |tree, to| tree.extend(pixels, to, fill(channels)))
}

fn bits(tree: &BlockTree) -> (u64, &[u8]) {
    (tree.samples(), bytemuck::cast_slice(tree.nodes()))
}

#[test]
fn closed_forms() {
    // 0, 1 … n−1: uniform moments.
    for n in [1u64, 2, 3, 64, 65, 1000, 4097] {
        let m: Moments = (0..n).map(|i| i as f64).collect();
        let f = n as f64;
        let expected =
            [(f - 1.0) / 2.0, f * (f * f - 1.0) / 12.0, 0.0, f * (f * f - 1.0) * (3.0 * f * f - 7.0) / 240.0];
        assert_eq!((m.n, m.min, m.max, m.argmax, m.non_finite), (n, 0.0, f - 1.0, n - 1, 0));
        assert!(off(m.mean, expected[0]) < 1e-14 && off(m.m2, expected[1]) < 1e-12 && off(m.m4, expected[3]) < 1e-12);
        assert!(m.m3.abs() <= 1e-12 * m.m2.powf(1.5), "{n}: {}", m.m3);
    }
    // numpy: x = [1, 2, 4, 8, 16]; ((x - x.mean())**k).sum() for k = 2, 3, 4
    let m: Moments = [1.0, 2.0, 4.0, 8.0, 16.0].into_iter().collect();
    for (found, wanted) in four(&m).into_iter().zip([6.2, 148.8, 721.68, 10299.936]) {
        assert!(off(found, wanted) < 1e-14, "{found} {wanted}");
    }
    assert!(off(m.sample_variance().unwrap(), 37.2) < 1e-15);
    assert_eq!(Moments::from_iter([1.0]).sample_variance(), None);
    assert_eq!(Moments::default().sample_variance(), None);
}

#[test]
fn a_million_samples_far_from_zero() {
    let n = 1_000_000u64;
    let draw = |_: Range<u32>, samples: Range<u64>, out: &mut [f64]| {
        samples.zip(out).for_each(|(i, x)| *x = 1e6 + if i % 2 == 0 { 1.0 } else { -1.0 });
    };
    let m = BlockTree::new(1).extend(1, n, draw).fold()[0];
    assert_eq!((m.n, m.min, m.max, m.argmax), (n, 999_999.0, 1_000_001.0, 0));
    assert_eq!(m.mean, 1e6);
    assert!(off(m.m2, 1e6) < 1e-11 && off(m.m4, 1e6) < 1e-11 && m.m3.abs() < 1e-9, "{m:?}");
    let pushed: Moments = (0..n).map(|i| 1e6 + if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
    assert!((pushed.mean - 1e6).abs() < 1e-6 && off(pushed.m2, 1e6) < 1e-6 && off(pushed.m4, 1e6) < 1e-5);
    // The sabotaged twin: Σx² − (Σx)²/n in the f32 of a picture is no variance.
    let (s, q) = (0..n).fold((0f32, 0f32), |(s, q), i| {
        let x = 1e6 + if i % 2 == 0 { 1.0 } else { -1.0 };
        (s + x, q + x * x)
    });
    assert!(off(f64::from(q - s * s / n as f32), 1e6) > 1e-3);
}

#[test]
fn merging_is_pooling() {
    let x: Vec<f64> = (0..500).map(|i| sample(1, i, 0)).collect();
    let whole: Moments = x.iter().copied().collect();
    for split in 0..=x.len() {
        let mut later = Moments::default();
        x.iter().enumerate().skip(split).for_each(|(i, v)| later.push(*v, i as u64));
        let merged = Moments::from_iter(x[..split].iter().copied()).merge(&later);
        assert_eq!((merged.n, merged.min, merged.max, merged.argmax), (whole.n, whole.min, whole.max, whole.argmax));
        assert!(agree(&merged, &x), "{split}: {merged:?}");
    }
    assert_eq!(Moments::default().merge(&whole), whole);
    assert_eq!(whole.merge(&Moments::default()), whole);
    // The first of equal largest samples is the one that is kept.
    let (a, b) = (Moments::from_iter([0.0, 7.0, 7.0]), Moments::from_iter([7.0]));
    assert_eq!(a.merge(&b).argmax, 1);
}

#[test]
fn a_tree_grown_in_any_steps_has_the_same_bits() {
    let end = 10 * BLOCK + 17;
    let whole = grown(3, 2, [end]);
    for split in 1..end {
        assert_eq!(bits(&grown(3, 2, [split, end])), bits(&whole), "split at {split}");
    }
    for step in [1, 7, 63, 64, 65, 128, 1000] {
        let steps = (1..).map(|i| i * step).take_while(|&n| n < end).chain([end]);
        assert_eq!(bits(&grown(3, 2, steps)), bits(&whole), "steps of {step}");
    }
    let folded: Vec<u8> = bytemuck::cast_slice(&whole.fold()).to_vec();
    assert_eq!(folded, bytemuck::cast_slice::<_, u8>(&grown(3, 2, [1, 64, 200, end]).fold()));
    // The sabotaged twin: a plain running merge of unaligned pieces has other bits.
    let piece = |r: Range<u64>| {
        let mut m = Moments::default();
        r.for_each(|i| m.push(sample(0, i, 0), i));
        m
    };
    let unaligned = piece(0..100).merge(&piece(100..end));
    assert_ne!(unaligned.m2.to_bits(), whole.fold()[0].m2.to_bits());
}

#[test]
fn a_tree_agrees_with_two_passes() {
    for n in [1, 2, 63, 64, 65, 127, 128, 1000, 4096, 5000] {
        let tree = grown(2, 2, [n]);
        for (value, m) in tree.fold().iter().enumerate() {
            let x: Vec<f64> = (0..n).map(|i| sample(value as u32 / 2, i, value % 2)).collect();
            assert_eq!(m.n, n);
            assert!(agree(m, &x), "n {n}: {m:?} {:?}", two_pass(&x));
            let largest = (0..n as usize).rev().max_by(|&a, &b| x[a].total_cmp(&x[b])).unwrap();
            assert_eq!((m.argmax, m.max), (largest as u64, x[largest]));
        }
    }
}

#[test]
fn samples_that_do_not_count_are_counted_and_located() {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 3.5e38, -1e300];
    let is_bad = |pixel: u32, i: u64| (i * 3 + u64::from(pixel)).is_multiple_of(40);
    let draw = |pixels: Range<u32>, samples: Range<u64>, out: &mut [f64]| {
        for ((pixel, i), x) in identities(pixels, samples).zip(out) {
            *x = if is_bad(pixel, i) { bad[(i % 5) as usize] } else { sample(pixel, i, 0) };
        }
    };
    let end = 300;
    let whole = BlockTree::new(1).extend(5, end, draw);
    for (pixel, m) in whole.fold().iter().enumerate() {
        let pixel = pixel as u32;
        let kept: Vec<f64> = (0..end).filter(|&i| !is_bad(pixel, i)).map(|i| sample(pixel, i, 0)).collect();
        assert_eq!((m.n, m.non_finite), (kept.len() as u64, end - kept.len() as u64));
        assert!(agree(m, &kept), "{m:?}");
    }
    let mut all: Vec<(u64, u32)> =
        (0..end).flat_map(|i| (0..5).filter(move |&p| is_bad(p, i)).map(move |p| (i, p))).collect();
    all.sort_unstable();
    let first: Vec<(u32, u64)> = all.iter().take(16).map(|&(i, p)| (p, i)).collect();
    assert_eq!(whole.non_finite(), first);
    for step in [1, 5, 64, 100] {
        let steps = (1..).map(|i| i * step).take_while(|&n| n < end).chain([end]);
        let tree = steps.fold(BlockTree::new(1), |tree, to| tree.extend(5, to, draw));
        assert_eq!((tree.non_finite(), bits(&tree)), (&first[..], bits(&whole)));
    }
    // The largest float of 32 bits still counts, and nothing overflows.
    let m: Moments = [f64::from(f32::MAX), -f64::from(f32::MAX)].into_iter().collect();
    assert_eq!((m.n, m.non_finite, m.mean), (2, 0, 0.0));
    assert!(m.m2.is_finite() && m.m4.is_finite());
    let nothing: Moments = [f64::NAN].into_iter().collect();
    assert_eq!((nothing.n, nothing.mean, nothing.non_finite), (0, 0.0, 1));
}

#[test]
fn parts_that_do_not_fit_are_no_tree() {
    let tree = grown(3, 2, [200]);
    let nodes = || tree.nodes().to_vec();
    let build = |pixels, channels, samples, nodes| BlockTree::from_parts(pixels, channels, samples, nodes, Vec::new());
    assert_eq!(build(3, 2, 200, nodes()).unwrap(), tree);
    for samples in [0, 1, 64, 128, 199, 201, 255, 264, 1 << 40, u64::MAX] {
        assert!(build(3, 2, samples, nodes()).is_none(), "{samples}");
    }
    for (pixels, channels) in [(2, 2), (3, 1), (0, 2), (3, 0), (usize::MAX, 2), (usize::MAX / 2, usize::MAX)] {
        assert!(build(pixels, channels, 200, nodes()).is_none(), "{pixels} {channels}");
    }
    // Fewer nodes, and a node that claims other samples than its place says.
    assert!(build(3, 2, 200, nodes()[1..].to_vec()).is_none());
    for change in [|m: &mut Moments| m.n += 1, |m: &mut Moments| m.non_finite = u64::MAX] {
        let mut nodes = nodes();
        change(&mut nodes[7]);
        assert!(build(3, 2, 200, nodes).is_none());
    }
}

/// A sample that does not count in one channel leaves the others as if each were alone.
#[test]
fn channels_do_not_disturb_one_another() {
    let value = |i: u64, c: usize| if c == 1 && i % 70 == 9 { f64::NAN } else { sample(3, i, c) };
    for channels in [2, 3, 4, 5] {
        let together = BlockTree::new(channels).extend(1, 300, |_, samples, out| {
            for (i, out) in samples.zip(out.chunks_exact_mut(channels)) {
                out.iter_mut().enumerate().for_each(|(c, x)| *x = value(i, c));
            }
        });
        for (c, m) in together.fold().iter().enumerate() {
            let alone = BlockTree::new(1).extend(1, 300, |_, samples, out| {
                samples.zip(out).for_each(|(i, x)| *x = value(i, c));
            });
            assert_eq!((m.non_finite, *m), (if c == 1 { 5 } else { 0 }, alone.fold()[0]));
        }
    }
}
