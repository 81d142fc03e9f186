//! Lanes of f32: AVX-512, AVX2, or plain arrays, all with the same bits (no fused multiply-add, the same min/max rule for NaN).
//!
//! Code generic over [`Simd`] or [`Registers`] is `#[inline(always)]`, free of closures that touch lanes, and ends in a
//! function with `#[target_feature(enable = …)]`, for example a whole path tracer that calls
//! [`super::bvh::Bvh::closest_with`]: only there do the instructions inline.

/// What a processor offers: eight lanes for one ray against the eight children of a node, sixteen for as many rays.
pub trait Registers: Copy {
    /// Eight lanes.
    type Eight: Simd;
    /// Sixteen lanes.
    type Sixteen: Simd<16>;
    /// Proof for eight lanes.
    fn eight(self) -> Self::Eight;
    /// Proof for sixteen lanes.
    fn sixteen(self) -> Self::Sixteen;

    /// Column i: number i of each row.
    #[inline(always)]
    fn columns(self, rows: &[&[f32; 16]; 16]) -> [[f32; 16]; 16] {
        let mut columns = [[0.0; 16]; 16];
        for (lane, row) in rows.iter().enumerate() {
            for (column, x) in columns.iter_mut().zip(row.iter()) {
                column[lane] = *x;
            }
        }
        columns
    }
}

/// `N`-lane f32 arithmetic. A value of an implementing type is the proof that its instructions may be used.
pub trait Simd<const N: usize = 8>: Copy {
    /// The lanes.
    type F: Copy;
    /// All lanes `x`.
    fn splat(self, x: f32) -> Self::F;
    /// From an array.
    fn load(self, x: &[f32; N]) -> Self::F;
    /// Back to an array.
    fn store(self, x: Self::F) -> [f32; N];
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
    /// Indices below four.
    type I: Copy;
    /// Indices from an array.
    fn indices(self, i: &[u32; N]) -> Self::I;
    /// table\[i\]
    fn look_up(self, table: &[f32; 4], i: Self::I) -> Self::F;
}

/// Plain arrays.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

impl Registers for Portable {
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

#[inline(always)]
fn zip<const N: usize>(a: [f32; N], b: [f32; N], f: impl Fn(f32, f32) -> f32) -> [f32; N] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn mask<const N: usize>(a: [f32; N], b: [f32; N], f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..N).fold(0, |m, i| m | u32::from(f(a[i], b[i])) << i)
}

impl<const N: usize> Simd<N> for Portable {
    type F = [f32; N];
    #[inline(always)]
    fn splat(self, x: f32) -> [f32; N] {
        [x; N]
    }
    #[inline(always)]
    fn load(self, x: &[f32; N]) -> [f32; N] {
        *x
    }
    #[inline(always)]
    fn store(self, x: [f32; N]) -> [f32; N] {
        x
    }
    #[inline(always)]
    fn add(self, a: [f32; N], b: [f32; N]) -> [f32; N] {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: [f32; N], b: [f32; N]) -> [f32; N] {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: [f32; N], b: [f32; N]) -> [f32; N] {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: [f32; N], b: [f32; N]) -> [f32; N] {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: [f32; N], b: [f32; N]) -> [f32; N] {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: [f32; N], b: [f32; N]) -> [f32; N] {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, a: [f32; N], b: [f32; N]) -> u32 {
        mask(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn eq(self, a: [f32; N], b: [f32; N]) -> u32 {
        mask(a, b, |a, b| a == b)
    }
    #[inline(always)]
    fn select(self, lanes: u32, a: [f32; N], b: [f32; N]) -> [f32; N] {
        std::array::from_fn(|i| if lanes >> i & 1 == 1 { a[i] } else { b[i] })
    }
    type I = [u32; N];
    #[inline(always)]
    fn indices(self, i: &[u32; N]) -> [u32; N] {
        *i
    }
    #[inline(always)]
    fn look_up(self, table: &[f32; 4], i: [u32; N]) -> [f32; N] {
        i.map(|i| table[i as usize & 3])
    }
}

#[cfg(test)]
mod tests {
    use super::Registers;

    fn transposes(registers: impl Registers) {
        let rows: [[f32; 16]; 16] = std::array::from_fn(|r| std::array::from_fn(|c| (100 * r + c) as f32));
        let columns = registers.columns(&std::array::from_fn(|r| &rows[r]));
        for (c, column) in columns.iter().enumerate() {
            assert_eq!(*column, std::array::from_fn(|r| rows[r][c]));
        }
    }

    #[test]
    fn columns_are_those_of_the_rows() {
        transposes(super::Portable);
        #[cfg(target_arch = "x86_64")]
        if let Some(avx512) = super::Avx512::detect() {
            transposes(avx512);
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Registers, Simd};
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
    /// Halves of sixteen values.
    #[inline(always)]
    fn halves<T>(x: &[T; 16]) -> (&[T; 8], &[T; 8]) {
        let (halves, _) = x.as_chunks::<8>();
        (&halves[0], &halves[1])
    }

    /// Two registers.
    impl Simd<16> for Avx2 {
        type F = [__m256; 2];
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
        fn add(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            [Simd::<8>::add(self, a[0], b[0]), Simd::<8>::add(self, a[1], b[1])]
        }
        #[inline(always)]
        fn sub(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            [Simd::<8>::sub(self, a[0], b[0]), Simd::<8>::sub(self, a[1], b[1])]
        }
        #[inline(always)]
        fn mul(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            [Simd::<8>::mul(self, a[0], b[0]), Simd::<8>::mul(self, a[1], b[1])]
        }
        #[inline(always)]
        fn div(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            [Simd::<8>::div(self, a[0], b[0]), Simd::<8>::div(self, a[1], b[1])]
        }
        #[inline(always)]
        fn min(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            [Simd::<8>::min(self, a[0], b[0]), Simd::<8>::min(self, a[1], b[1])]
        }
        #[inline(always)]
        fn max(self, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            [Simd::<8>::max(self, a[0], b[0]), Simd::<8>::max(self, a[1], b[1])]
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
        fn add(self, a: __m512, b: __m512) -> __m512 {
            // SAFETY: as in `splat`.
            unsafe { _mm512_add_ps(a, b) }
        }
        #[inline(always)]
        fn sub(self, a: __m512, b: __m512) -> __m512 {
            // SAFETY: as in `splat`.
            unsafe { _mm512_sub_ps(a, b) }
        }
        #[inline(always)]
        fn mul(self, a: __m512, b: __m512) -> __m512 {
            // SAFETY: as in `splat`.
            unsafe { _mm512_mul_ps(a, b) }
        }
        #[inline(always)]
        fn div(self, a: __m512, b: __m512) -> __m512 {
            // SAFETY: as in `splat`.
            unsafe { _mm512_div_ps(a, b) }
        }
        #[inline(always)]
        fn min(self, a: __m512, b: __m512) -> __m512 {
            // SAFETY: as in `splat`.
            unsafe { _mm512_min_ps(a, b) }
        }
        #[inline(always)]
        fn max(self, a: __m512, b: __m512) -> __m512 {
            // SAFETY: as in `splat`.
            unsafe { _mm512_max_ps(a, b) }
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
}
