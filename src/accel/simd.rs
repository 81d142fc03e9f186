//! Eight f32 lanes: AVX2, or plain arrays that give the same bits (no fused multiply-add, the same min/max rule for NaN).
//!
//! Code generic over [`Simd`] is `#[inline(always)]`, free of closures that touch lanes, and ends in a function with
//! `#[target_feature(enable = "avx2")]`, for example a whole path tracer that calls [`super::bvh::Bvh::closest_with`]:
//! only there do the instructions inline.

/// Eight-lane f32 arithmetic. A value of an implementing type is the proof that its instructions may be used.
pub trait Simd: Copy {
    /// Eight lanes.
    type F: Copy;
    /// All lanes `x`.
    fn splat(self, x: f32) -> Self::F;
    /// The eight values.
    fn load(self, x: &[f32; 8]) -> Self::F;
    /// Back to an array.
    fn store(self, x: Self::F) -> [f32; 8];
    /// a + b
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// a − b
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// a · b
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// a / b
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// a < b ? a : b (so b where one is NaN)
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// a > b ? a : b (so b where one is NaN)
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Bit i: a\[i\] ≤ b\[i\] (false for NaN).
    fn le(self, a: Self::F, b: Self::F) -> u32;
    /// Bit i: a\[i\] = b\[i\] (false for NaN).
    fn eq(self, a: Self::F, b: Self::F) -> u32;
    /// Bit i set ? a\[i\] : b\[i\]
    fn select(self, lanes: u32, a: Self::F, b: Self::F) -> Self::F;
    /// Eight indices, below four.
    type I: Copy;
    /// The eight indices.
    fn indices(self, i: &[u32; 8]) -> Self::I;
    /// table\[i\]
    fn look_up(self, table: &[f32; 4], i: Self::I) -> Self::F;
}

/// Plain arrays.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

#[inline(always)]
fn zip(a: [f32; 8], b: [f32; 8], f: impl Fn(f32, f32) -> f32) -> [f32; 8] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn mask(a: [f32; 8], b: [f32; 8], f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..8).fold(0, |m, i| m | u32::from(f(a[i], b[i])) << i)
}

impl Simd for Portable {
    type F = [f32; 8];
    #[inline(always)]
    fn splat(self, x: f32) -> [f32; 8] {
        [x; 8]
    }
    #[inline(always)]
    fn load(self, x: &[f32; 8]) -> [f32; 8] {
        *x
    }
    #[inline(always)]
    fn store(self, x: [f32; 8]) -> [f32; 8] {
        x
    }
    #[inline(always)]
    fn add(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, a: [f32; 8], b: [f32; 8]) -> u32 {
        mask(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn eq(self, a: [f32; 8], b: [f32; 8]) -> u32 {
        mask(a, b, |a, b| a == b)
    }
    #[inline(always)]
    fn select(self, lanes: u32, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| if lanes >> i & 1 == 1 { a[i] } else { b[i] })
    }
    type I = [u32; 8];
    #[inline(always)]
    fn indices(self, i: &[u32; 8]) -> [u32; 8] {
        *i
    }
    #[inline(always)]
    fn look_up(self, table: &[f32; 4], i: [u32; 8]) -> [f32; 8] {
        i.map(|i| table[i as usize & 3])
    }
}

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::Simd;
    use std::arch::x86_64::*;

    /// AVX2 instructions. Use its methods inside a function with `#[target_feature(enable = "avx2")]`, into which they are
    /// inlined; elsewhere they are correct but slow.
    #[derive(Clone, Copy, Debug)]
    pub struct Avx2(());

    impl Avx2 {
        /// `None` where the processor lacks AVX2.
        pub fn detect() -> Option<Self> {
            is_x86_feature_detected!("avx2").then_some(Self(()))
        }

        /// Whether the processor also has the AVX-512 instructions for eight lanes: the same operations with more registers and
        /// masks, in a function with `#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq")]`.
        pub fn has_avx512(self) -> bool {
            is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
        }
    }

    impl Simd for Avx2 {
        type F = __m256;
        #[inline(always)]
        fn splat(self, x: f32) -> __m256 {
            // SAFETY: a value of `Avx2` exists only where AVX2 was detected; so for every block below.
            unsafe { _mm256_set1_ps(x) }
        }
        #[inline(always)]
        fn load(self, x: &[f32; 8]) -> __m256 {
            // SAFETY: as above; eight readable floats, no alignment needed.
            unsafe { _mm256_loadu_ps(x.as_ptr()) }
        }
        #[inline(always)]
        fn store(self, x: __m256) -> [f32; 8] {
            let mut out = [0.0; 8];
            // SAFETY: as above; eight writable floats, no alignment needed.
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), x) };
            out
        }
        #[inline(always)]
        fn add(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as in `splat`.
            unsafe { _mm256_add_ps(a, b) }
        }
        #[inline(always)]
        fn sub(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as in `splat`.
            unsafe { _mm256_sub_ps(a, b) }
        }
        #[inline(always)]
        fn mul(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as in `splat`.
            unsafe { _mm256_mul_ps(a, b) }
        }
        #[inline(always)]
        fn div(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as in `splat`.
            unsafe { _mm256_div_ps(a, b) }
        }
        #[inline(always)]
        fn min(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as in `splat`.
            unsafe { _mm256_min_ps(a, b) }
        }
        #[inline(always)]
        fn max(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as in `splat`.
            unsafe { _mm256_max_ps(a, b) }
        }
        #[inline(always)]
        fn le(self, a: __m256, b: __m256) -> u32 {
            // SAFETY: as in `splat`.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
        }
        #[inline(always)]
        fn eq(self, a: __m256, b: __m256) -> u32 {
            // SAFETY: as in `splat`.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(a, b)) as u32 }
        }
        #[inline(always)]
        fn select(self, lanes: u32, a: __m256, b: __m256) -> __m256 {
            // SAFETY: as in `splat`.
            unsafe {
                let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
                let set = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(lanes as i32), bit), bit);
                _mm256_blendv_ps(b, a, _mm256_castsi256_ps(set))
            }
        }
        type I = __m256i;
        #[inline(always)]
        fn indices(self, i: &[u32; 8]) -> __m256i {
            // SAFETY: as in `splat`; eight readable integers, no alignment needed.
            unsafe { _mm256_loadu_si256(i.as_ptr().cast()) }
        }
        #[inline(always)]
        fn look_up(self, table: &[f32; 4], i: __m256i) -> __m256 {
            // SAFETY: as in `splat`; four readable floats, no alignment needed.
            unsafe { _mm256_permutevar_ps(_mm256_broadcast_ps(&_mm_loadu_ps(table.as_ptr())), i) }
        }
    }
}
