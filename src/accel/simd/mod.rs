//! Lanes of f32: AVX-512, AVX2, or plain arrays, all with the same bits (no fused multiply-add, the same min/max rule for NaN).
//!
//! Code generic over [`Simd`] or [`Registers`] is `#[inline(always)]`, free of closures that touch lanes, and ends in a
//! function with `#[target_feature(enable = …)]`, for example a whole path tracer that calls
//! [`super::bvh::Bvh::closest_with`]: only there do the instructions inline.

#[cfg(target_arch = "x86_64")]
mod x86;

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512};

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
