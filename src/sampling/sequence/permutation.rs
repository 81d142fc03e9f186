//! Random permutations evaluated one element at a time.

/// Mixing steps: six make all pairs of images equally likely to about 1 % for every length.
const STEPS: usize = 6;

/// The image of `index` < `length` under the permutation of 0 … length−1 that `seed` names.
///
/// Hashed cycle walking: a bijection of the next power of two (reversible steps only: xor with a key, odd multiplication, xor of
/// the high half onto the low), repeated until the value falls below `length`, then a rotation by a hash of the seed, which makes
/// each image uniform. Source of the scheme: Kensler, "Correlated multi-jittered sampling", Pixar TM 13-01, 2013, §4.
#[inline(always)]
pub fn permute(index: u32, length: u32, seed: u32) -> u32 {
    permute_in::<false>(index, length, seed)
}

/// [`permute`]; `POWER` says that `length` is a power of two: no walk, no branches.
#[inline(always)]
pub(super) fn permute_in<const POWER: bool>(index: u32, length: u32, seed: u32) -> u32 {
    let bits = 32 - (length - 1).leading_zeros();
    // Multiplicative hashing: the upper half of the product depends on all of the seed.
    let product = (u64::from(seed) | 1 << 32).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let first = product ^ (product >> 32);
    let mut i = mixed(index, bits, first);
    while !POWER && i >= length {
        i = mixed(i, bits, first);
    }
    let length = u64::from(length);
    let rotated = u64::from(i) + ((u64::from((first as u32).rotate_left(7)) * length) >> 32);
    (if rotated >= length { rotated - length } else { rotated }) as u32
}

/// A bijection of the numbers of `bits` bits.
#[inline(always)]
fn mixed(mut i: u32, bits: u32, mut keys: u64) -> u32 {
    let mask = ((1u64 << bits) - 1) as u32;
    // Two distances, so that all bits of small indices mix.
    let half = bits.div_ceil(2);
    let shifts = [half, half.saturating_sub(1).max(1)];
    for step in 0..STEPS {
        keys = keys.wrapping_mul(0xD134_2543_DE82_EF95);
        i = (i ^ (keys >> 32) as u32).wrapping_mul((keys >> 11) as u32 | 1) & mask;
        i ^= i >> shifts[step % 2];
    }
    i
}
