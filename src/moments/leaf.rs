//! Samples of blocks pushed into the moments of all channels at once: four channels side by side, with AVX-512 of two blocks.

use super::{BLOCK, Moments, RECIPROCAL};
use std::arch::x86_64::*;

/// Channels of a block side by side.
pub(super) const WIDTH: usize = 4;

/// Samples from which on it is quicker than one push after the other.
const WORTH_IT: u64 = 4;

/// What the update of the n-th sample multiplies with: 1/n, n − 1, n − 2, n² − 3n + 3.
static FACTORS: [[f64; 4]; BLOCK as usize + 1] = {
    let mut factors = [[0.0; 4]; BLOCK as usize + 1];
    let mut i = 1;
    while i < factors.len() {
        let n = i as f64;
        factors[i] = [RECIPROCAL[i], n - 1.0, n - 2.0, n * n - 3.0 * n + 3.0];
        i += 1;
    }
    factors
};

/// Pushes samples (`channels` values each), the first being number `first`, with the bits of [`Moments::push`]. `moments` has
/// one entry per channel, or those of two blocks one after the other, which get half of the samples each. Returns false and
/// does nothing where a sample does not count, where samples are too few to be worth it, where channels are more than four or
/// differ in what they have taken, and where the processor lacks the instructions.
pub(super) fn push(moments: &mut [Moments], channels: usize, values: &[f64], first: u64) -> bool {
    let n = moments[0].n;
    let blocks = (moments.len() / channels) as u64;
    let samples = (values.len() / channels) as u64 / blocks;
    if channels > WIDTH || samples < WORTH_IT || n + samples > BLOCK || moments.iter().any(|m| m.n != n) {
        return false;
    }
    let (avx2, avx512) = (is_x86_feature_detected!("avx2"), is_x86_feature_detected!("avx512f"));
    match blocks {
        // SAFETY: the instructions were detected.
        1 if avx2 => unsafe { push_avx2(moments, channels, values, first) },
        // SAFETY: the instructions were detected.
        2 if avx2 && avx512 => unsafe { push_avx512(moments, channels, values, first) },
        _ => false,
    }
}

/// The same operations in the same order as [`Moments::push`], on as many lanes as `$vector` has.
macro_rules! kernel {
    ($name:ident, $feature:literal, $vector:ident of $lanes:literal, $sample:ident, $counts:ident, $zeros:ident, $keep:ident,
     $load:ident $store:ident $splat:ident $add:ident $sub:ident $mul:ident $min:ident $max:ident) => {
        #[target_feature(enable = $feature)]
        fn $name(moments: &mut [Moments], channels: usize, values: &[f64], first: u64) -> bool {
            const BLOCKS: usize = $lanes / WIDTH;
            let gather = |f: fn(&Moments) -> f64| {
                let mut x = [0.0; $lanes];
                for (x, m) in x.chunks_exact_mut(WIDTH).zip(moments.chunks_exact(channels)) {
                    x.iter_mut().zip(m).for_each(|(x, m)| *x = f(m));
                }
                // SAFETY: as many readable floats, no alignment needed.
                unsafe { $load(x.as_ptr()) }
            };
            let (mut mean, mut m2) = (gather(|m| m.mean), gather(|m| m.m2));
            let (mut m3, mut m4) = (gather(|m| m.m3), gather(|m| m.m4));
            let (mut min, mut max) = (gather(|m| m.min), gather(|m| m.max));
            // Indices travel as the bits of floats.
            let mut argmax = gather(|m| f64::from_bits(m.argmax));
            let mut zeros = gather(|m| m.zeros as f64);
            let on = |k: usize| if k < channels { -1 } else { 0 };
            let mask = _mm256_set_epi64x(on(3), on(2), on(1), on(0));
            let before = moments[0].n;
            let samples = values.len() / channels / BLOCKS;
            let (three, four, six) = ($splat(3.0), $splat(4.0), $splat(6.0));
            let mut all_count = true;
            for i in 0..samples {
                let x = $sample(values, [i * channels, (samples + i) * channels], mask);
                all_count &= $counts(x);
                let [reciprocal, one_less, two_less, square] = FACTORS[before as usize + i + 1];
                let delta = $sub(x, mean);
                let dn = $mul(delta, $splat(reciprocal));
                let dn2 = $mul(dn, dn);
                let t = $mul($mul(delta, dn), $splat(one_less));
                mean = $add(mean, dn);
                let a = $mul($mul(t, dn2), $splat(square));
                m4 = $add(m4, $sub($add(a, $mul($mul(six, dn2), m2)), $mul($mul(four, dn), m3)));
                m3 = $add(m3, $sub($mul($mul(t, dn), $splat(two_less)), $mul($mul(three, dn), m2)));
                m2 = $add(m2, t);
                zeros = $zeros(zeros, x);
                min = $min(x, min);
                argmax = $keep(argmax, $splat(f64::from_bits(first + i as u64)), x, max);
                max = $max(x, max);
            }
            if !all_count {
                return false;
            }
            let store = |x: $vector| {
                let mut out = [0.0; $lanes];
                // SAFETY: as many writable floats, no alignment needed.
                unsafe { $store(out.as_mut_ptr(), x) };
                out
            };
            let (mean, m2, m3, m4) = (store(mean), store(m2), store(m3), store(m4));
            let (min, max, argmax, zeros) = (store(min), store(max), store(argmax), store(zeros));
            for (block, moments) in moments.chunks_exact_mut(channels).enumerate() {
                for (channel, m) in moments.iter_mut().enumerate() {
                    let k = block * WIDTH + channel;
                    // The later block's samples follow the earlier one's.
                    let argmax = argmax[k].to_bits() + if m.max < max[k] { (block * samples) as u64 } else { 0 };
                    let (mean, m2, m3, m4, min, max) = (mean[k], m2[k], m3[k], m4[k], min[k], max[k]);
                    let n = before + samples as u64;
                    let zeros = zeros[k] as u64;
                    *m = Moments { n, mean, m2, m3, m4, min, max, argmax, non_finite: m.non_finite, zeros };
                }
            }
            true
        }
    };
}

kernel!(push_avx2, "avx2", __m256d of 4, one_sample, count_4, zeros_4, keep_4,
        _mm256_loadu_pd _mm256_storeu_pd _mm256_set1_pd _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_min_pd _mm256_max_pd);
kernel!(push_avx512, "avx2,avx512f", __m512d of 8, two_samples, count_8, zeros_8, keep_8,
        _mm512_loadu_pd _mm512_storeu_pd _mm512_set1_pd _mm512_add_pd _mm512_sub_pd _mm512_mul_pd _mm512_min_pd _mm512_max_pd);

/// The channels of the sample that starts at the first place.
#[target_feature(enable = "avx2")]
fn one_sample(values: &[f64], at: [usize; 2], mask: __m256i) -> __m256d {
    let sample = &values[at[0]..];
    // SAFETY: lanes beyond the channels are masked.
    unsafe { _mm256_maskload_pd(sample.as_ptr(), mask) }
}

/// The channels of the samples that start at both places.
#[target_feature(enable = "avx2,avx512f")]
fn two_samples(values: &[f64], at: [usize; 2], mask: __m256i) -> __m512d {
    let (a, b) = (one_sample(values, at, mask), one_sample(values, [at[1]; 2], mask));
    _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(a), b)
}

/// Whether all are finite and within the range of f32; NaN passes no comparison.
#[target_feature(enable = "avx2")]
fn count_4(x: __m256d) -> bool {
    let size = _mm256_andnot_pd(_mm256_set1_pd(-0.0), x);
    _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(size, _mm256_set1_pd(f32::MAX.into()))) == 0xF
}

#[target_feature(enable = "avx512f")]
fn count_8(x: __m512d) -> bool {
    _mm512_cmp_pd_mask::<_CMP_LE_OQ>(_mm512_abs_pd(x), _mm512_set1_pd(f32::MAX.into())) == 0xFF
}

/// One more where x is 0.
#[target_feature(enable = "avx2")]
fn zeros_4(zeros: __m256d, x: __m256d) -> __m256d {
    let is_zero = _mm256_cmp_pd::<_CMP_EQ_OQ>(x, _mm256_setzero_pd());
    _mm256_add_pd(zeros, _mm256_and_pd(is_zero, _mm256_set1_pd(1.0)))
}

#[target_feature(enable = "avx512f")]
fn zeros_8(zeros: __m512d, x: __m512d) -> __m512d {
    let is_zero = _mm512_cmp_pd_mask::<_CMP_EQ_OQ>(x, _mm512_setzero_pd());
    _mm512_mask_add_pd(zeros, is_zero, zeros, _mm512_set1_pd(1.0))
}

/// `new` where x > max, else `old`.
#[target_feature(enable = "avx2")]
fn keep_4(old: __m256d, new: __m256d, x: __m256d, max: __m256d) -> __m256d {
    _mm256_blendv_pd(old, new, _mm256_cmp_pd::<_CMP_GT_OQ>(x, max))
}

#[target_feature(enable = "avx512f")]
fn keep_8(old: __m512d, new: __m512d, x: __m512d, max: __m512d) -> __m512d {
    _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(x, max), old, new)
}
