//! Random permutations evaluated one element at a time.

/// The image of `index` < `length` under the permutation of 0 … length−1 that `seed` names.
///
/// Hashed cycle walking: a bijection of the next power of two (reversible steps only: xor with a key, odd multiplication, xor of
/// the high half onto the low), repeated until the value falls below `length`, then a rotation by a hash of the seed, which makes
/// each image uniform. Source of the scheme: Kensler, "Correlated multi-jittered sampling", Pixar TM 13-01, 2013, §4.
#[inline(always)]
pub fn permute(index: u32, length: u32, seed: u32) -> u32 {
    let bits = 32 - (length - 1).leading_zeros();
    let mask = ((1u64 << bits) - 1) as u32;
    let half = bits.div_ceil(2);
    // A step mixes few bits little: pairs of images are uniform only after more of them.
    let steps = if bits <= 4 { 12 } else { 4 };
    let mut i = index;
    loop {
        for step in 1..=steps {
            let key = hash(seed, step);
            i = (i ^ key).wrapping_mul((key >> 15) | 1) & mask;
            i ^= i >> half;
        }
        if i < length {
            break;
        }
    }
    let length = u64::from(length);
    let rotated = u64::from(i) + ((u64::from(hash(seed, 0)) * length) >> 32);
    (if rotated >= length { rotated - length } else { rotated }) as u32
}

/// A Weyl sequence through the finaliser of MurmurHash3 (Appleby).
#[inline(always)]
fn hash(seed: u32, step: u32) -> u32 {
    let mut h = seed.wrapping_add(step.wrapping_mul(0x9E37_79B9));
    h = (h ^ (h >> 16)).wrapping_mul(0x85EB_CA6B);
    h = (h ^ (h >> 13)).wrapping_mul(0xC2B2_AE35);
    h ^ (h >> 16)
}
