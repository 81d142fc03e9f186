//! Samples of one block pushed into the moments of all channels at once, four side by side.

use super::{BLOCK, Moments, reciprocal};
use std::arch::x86_64::*;

/// Channels side by side.
const WIDTH: usize = 4;

/// Samples from which on it is quicker than one push after the other.
const WORTH_IT: u64 = 8;

/// Pushes samples (`leaf.len()` channels each), the first being number `first`, with the bits of [`Moments::push`]. Returns
/// false and does nothing where a sample does not count, where samples are too few to be worth it, where channels are more than
/// four or differ in what they have taken, and where the processor lacks AVX2.
pub(super) fn push(leaf: &mut [Moments], values: &[f64], first: u64) -> bool {
    let n = leaf[0].n;
    let samples = (values.len() / leaf.len()) as u64;
    let fits = leaf.len() <= WIDTH && samples >= WORTH_IT && n + samples <= BLOCK;
    // SAFETY: AVX2 was detected.
    fits && leaf.iter().all(|m| m.n == n)
        && is_x86_feature_detected!("avx2")
        && unsafe { push_avx2(leaf, values, first) }
}

/// Same operations in the same order as [`Moments::push`].
#[target_feature(enable = "avx2")]
fn push_avx2(leaf: &mut [Moments], values: &[f64], first: u64) -> bool {
    let channels = leaf.len();
    let on = |k: usize| if k < channels { -1 } else { 0 };
    let mask = _mm256_set_epi64x(on(3), on(2), on(1), on(0));
    let gather = |f: fn(&Moments) -> f64| {
        let mut x = [0.0; WIDTH];
        leaf.iter().zip(&mut x).for_each(|(m, x)| *x = f(m));
        x
    };
    let load = |x: [f64; WIDTH]| _mm256_set_pd(x[3], x[2], x[1], x[0]);
    let (mut mean, mut m2) = (load(gather(|m| m.mean)), load(gather(|m| m.m2)));
    let (mut m3, mut m4) = (load(gather(|m| m.m3)), load(gather(|m| m.m4)));
    let (mut min, mut max) = (load(gather(|m| m.min)), load(gather(|m| m.max)));
    // The index travels as the bits of a float.
    let mut argmax = load(gather(|m| f64::from_bits(m.argmax)));
    let mut n = leaf[0].n;
    let (limit, sign) = (_mm256_set1_pd(f32::MAX.into()), _mm256_set1_pd(-0.0));
    let mut count_all = _mm256_cmp_pd::<_CMP_EQ_OQ>(limit, limit);
    for (i, sample) in values.chunks_exact(channels).enumerate() {
        // SAFETY: lanes beyond the channels are masked.
        let x = unsafe { _mm256_maskload_pd(sample.as_ptr(), mask) };
        // NaN passes no comparison.
        count_all = _mm256_and_pd(count_all, _mm256_cmp_pd::<_CMP_LE_OQ>(_mm256_andnot_pd(sign, x), limit));
        let before = _mm256_set1_pd(n as f64);
        n += 1;
        let count = n as f64;
        let splat = |x: f64| _mm256_set1_pd(x);
        let delta = _mm256_sub_pd(x, mean);
        let dn = _mm256_mul_pd(delta, splat(reciprocal(n)));
        let dn2 = _mm256_mul_pd(dn, dn);
        let t = _mm256_mul_pd(_mm256_mul_pd(delta, dn), before);
        mean = _mm256_add_pd(mean, dn);
        let a = _mm256_mul_pd(_mm256_mul_pd(t, dn2), splat(count * count - 3.0 * count + 3.0));
        let b = _mm256_mul_pd(_mm256_mul_pd(splat(6.0), dn2), m2);
        let c = _mm256_mul_pd(_mm256_mul_pd(splat(4.0), dn), m3);
        m4 = _mm256_add_pd(m4, _mm256_sub_pd(_mm256_add_pd(a, b), c));
        let a = _mm256_mul_pd(_mm256_mul_pd(t, dn), splat(count - 2.0));
        let b = _mm256_mul_pd(_mm256_mul_pd(splat(3.0), dn), m2);
        m3 = _mm256_add_pd(m3, _mm256_sub_pd(a, b));
        m2 = _mm256_add_pd(m2, t);
        min = _mm256_min_pd(x, min);
        let larger = _mm256_cmp_pd::<_CMP_GT_OQ>(x, max);
        max = _mm256_max_pd(x, max);
        argmax = _mm256_blendv_pd(argmax, splat(f64::from_bits(first + i as u64)), larger);
    }
    if _mm256_movemask_pd(count_all) != 0xF {
        return false;
    }
    let store = |x: __m256d| {
        let mut out = [0.0; WIDTH];
        // SAFETY: four writable floats, no alignment needed.
        unsafe { _mm256_storeu_pd(out.as_mut_ptr(), x) };
        out
    };
    let (mean, m2, m3, m4) = (store(mean), store(m2), store(m3), store(m4));
    let (min, max, argmax) = (store(min), store(max), store(argmax));
    for (k, m) in leaf.iter_mut().enumerate() {
        let argmax = argmax[k].to_bits();
        let (mean, m2, m3, m4, min, max) = (mean[k], m2[k], m3[k], m4[k], min[k], max[k]);
        *m = Moments { n, mean, m2, m3, m4, min, max, argmax, non_finite: m.non_finite };
    }
    true
}
