//! AVX2 and AVX-512.

use super::{Registers, Simd};
use std::arch::x86_64::*;

/// Operations that are one instruction.
macro_rules! each {
    ($f:ty: $($name:ident = $intrinsic:ident),+) => {$(
        #[inline(always)]
        fn $name(self, a: $f, b: $f) -> $f {
            // SAFETY: as in `splat`.
            unsafe { $intrinsic(a, b) }
        }
    )+};
}

/// The operations of eight lanes on both halves of sixteen.
macro_rules! halfwise {
    ($($name:ident)+) => {$(
        #[inline(always)]
        fn $name(self, a: Self::F, b: Self::F) -> Self::F {
            [Simd::<8>::$name(self, a[0], b[0]), Simd::<8>::$name(self, a[1], b[1])]
        }
    )+};
}

/// AVX2 instructions. Use its methods inside a function with `#[target_feature(enable = "avx2")]`, into which they are
/// inlined; elsewhere they are correct but slow.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

impl Avx2 {
    /// `None` where the processor lacks AVX2.
    pub fn detect() -> Option<Self> {
        is_x86_feature_detected!("avx2").then_some(Self(()))
    }
}

impl Registers for Avx2 {
    type Eight = Self;
    type Sixteen = Self;
    #[inline(always)]
    fn eight(self) -> Self {
        self
    }
    #[inline(always)]
    fn sixteen(self) -> Self {
        self
    }
}

/// AVX-512 instructions (F, VL, BW, DQ), AVX2 for eight lanes; otherwise as [`Avx2`].
#[derive(Clone, Copy, Debug)]
pub struct Avx512(Avx2);

impl Avx512 {
    /// `None` where the processor lacks them.
    pub fn detect() -> Option<Self> {
        let all = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq");
        Avx2::detect().filter(|_| all).map(Self)
    }
}

impl Registers for Avx512 {
    type Eight = Avx2;
    type Sixteen = Self;
    #[inline(always)]
    fn eight(self) -> Avx2 {
        self.0
    }
    #[inline(always)]
    fn sixteen(self) -> Self {
        self
    }
    #[inline(always)]
    fn columns(self, rows: &[&[f32; 16]; 16]) -> [[f32; 16]; 16] {
        let mut columns = [[0.0; 16]; 16];
        // SAFETY: a value of `Avx512` exists only where its instructions were detected; rows are read and columns written
        // whole, without alignment.
        unsafe {
            let zero = _mm512_setzero_ps();
            let (mut a, mut b) = ([zero; 16], [zero; 16]);
            for i in 0..16 {
                a[i] = _mm512_loadu_ps(rows[i].as_ptr());
            }
            // Pairs of rows, then of pairs, within 128 bits; then quarters of four and of eight.
            for i in (0..16).step_by(2) {
                b[i] = _mm512_unpacklo_ps(a[i], a[i + 1]);
                b[i + 1] = _mm512_unpackhi_ps(a[i], a[i + 1]);
            }
            for i in (0..16).step_by(4) {
                a[i] = _mm512_shuffle_ps::<0x44>(b[i], b[i + 2]);
                a[i + 1] = _mm512_shuffle_ps::<0xEE>(b[i], b[i + 2]);
                a[i + 2] = _mm512_shuffle_ps::<0x44>(b[i + 1], b[i + 3]);
                a[i + 3] = _mm512_shuffle_ps::<0xEE>(b[i + 1], b[i + 3]);
            }
            for k in 0..4 {
                b[k] = _mm512_shuffle_f32x4::<0x88>(a[k], a[k + 4]);
                b[k + 4] = _mm512_shuffle_f32x4::<0xDD>(a[k], a[k + 4]);
                b[k + 8] = _mm512_shuffle_f32x4::<0x88>(a[k + 8], a[k + 12]);
                b[k + 12] = _mm512_shuffle_f32x4::<0xDD>(a[k + 8], a[k + 12]);
            }
            for k in 0..8 {
                a[k] = _mm512_shuffle_f32x4::<0x88>(b[k], b[k + 8]);
                a[k + 8] = _mm512_shuffle_f32x4::<0xDD>(b[k], b[k + 8]);
            }
            for i in 0..16 {
                _mm512_storeu_ps(columns[i].as_mut_ptr(), a[i]);
            }
        }
        columns
    }
}

impl Simd for Avx2 {
    type F = __m256;
    each!(__m256: add = _mm256_add_ps, sub = _mm256_sub_ps, mul = _mm256_mul_ps, div = _mm256_div_ps, min = _mm256_min_ps, max = _mm256_max_ps);
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

/// Halves of sixteen values.
#[inline(always)]
fn halves<T>(x: &[T; 16]) -> (&[T; 8], &[T; 8]) {
    let (halves, _) = x.as_chunks::<8>();
    (&halves[0], &halves[1])
}

/// Two registers.
impl Simd<16> for Avx2 {
    type F = [__m256; 2];
    halfwise!(add sub mul div min max);
    #[inline(always)]
    fn splat(self, x: f32) -> [__m256; 2] {
        [Simd::<8>::splat(self, x); 2]
    }
    #[inline(always)]
    fn load(self, x: &[f32; 16]) -> [__m256; 2] {
        let (low, high) = halves(x);
        [self.load(low), self.load(high)]
    }
    #[inline(always)]
    fn store(self, x: [__m256; 2]) -> [f32; 16] {
        let mut out = [0.0; 16];
        let (low, high) = out.split_at_mut(8);
        low.copy_from_slice(&Simd::<8>::store(self, x[0]));
        high.copy_from_slice(&Simd::<8>::store(self, x[1]));
        out
    }
    #[inline(always)]
    fn le(self, a: [__m256; 2], b: [__m256; 2]) -> u32 {
        Simd::<8>::le(self, a[0], b[0]) | Simd::<8>::le(self, a[1], b[1]) << 8
    }
    #[inline(always)]
    fn eq(self, a: [__m256; 2], b: [__m256; 2]) -> u32 {
        Simd::<8>::eq(self, a[0], b[0]) | Simd::<8>::eq(self, a[1], b[1]) << 8
    }
    #[inline(always)]
    fn select(self, lanes: u32, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
        [Simd::<8>::select(self, lanes, a[0], b[0]), Simd::<8>::select(self, lanes >> 8, a[1], b[1])]
    }
    type I = [__m256i; 2];
    #[inline(always)]
    fn indices(self, i: &[u32; 16]) -> [__m256i; 2] {
        let (low, high) = halves(i);
        [self.indices(low), self.indices(high)]
    }
    #[inline(always)]
    fn look_up(self, table: &[f32; 4], i: [__m256i; 2]) -> [__m256; 2] {
        [Simd::<8>::look_up(self, table, i[0]), Simd::<8>::look_up(self, table, i[1])]
    }
}

impl Simd<16> for Avx512 {
    type F = __m512;
    each!(__m512: add = _mm512_add_ps, sub = _mm512_sub_ps, mul = _mm512_mul_ps, div = _mm512_div_ps, min = _mm512_min_ps, max = _mm512_max_ps);
    #[inline(always)]
    fn splat(self, x: f32) -> __m512 {
        // SAFETY: a value of `Avx512` exists only where its instructions were detected; so for every block below.
        unsafe { _mm512_set1_ps(x) }
    }
    #[inline(always)]
    fn load(self, x: &[f32; 16]) -> __m512 {
        // SAFETY: as above; sixteen readable floats, no alignment needed.
        unsafe { _mm512_loadu_ps(x.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, x: __m512) -> [f32; 16] {
        let mut out = [0.0; 16];
        // SAFETY: as above; sixteen writable floats, no alignment needed.
        unsafe { _mm512_storeu_ps(out.as_mut_ptr(), x) };
        out
    }
    #[inline(always)]
    fn le(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as in `splat`.
        u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) })
    }
    #[inline(always)]
    fn eq(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as in `splat`.
        u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(a, b) })
    }
    #[inline(always)]
    fn select(self, lanes: u32, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as in `splat`.
        unsafe { _mm512_mask_blend_ps(lanes as u16, b, a) }
    }
    type I = __m512i;
    #[inline(always)]
    fn indices(self, i: &[u32; 16]) -> __m512i {
        // SAFETY: as in `splat`; sixteen readable integers, no alignment needed.
        unsafe { _mm512_loadu_si512(i.as_ptr().cast()) }
    }
    #[inline(always)]
    fn look_up(self, table: &[f32; 4], i: __m512i) -> __m512 {
        // SAFETY: as in `splat`; four readable floats, no alignment needed.
        unsafe { _mm512_permutevar_ps(_mm512_broadcast_f32x4(_mm_loadu_ps(table.as_ptr())), i) }
    }
}
