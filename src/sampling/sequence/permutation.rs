//! Random permutations evaluated one element at a time.

/// The image of `index` < `length` under the permutation of 0 … length−1 that `seed` names.
///
/// Hashed cycle walking: a bijection of the next power of two (reversible steps only: xor with the seed, odd multiplication,
/// xor of the high part onto the low), repeated until the value falls below `length`, then a rotation by a hash of the seed,
/// which makes each image uniform. Source of the scheme: Kensler, "Correlated multi-jittered sampling", Pixar TM 13-01, 2013, §4.
#[inline(always)]
pub fn permute(index: u32, length: u32, seed: u32) -> u32 {
    let bits = 32 - (length - 1).leading_zeros();
    let mask = ((1u64 << bits) - 1) as u32;
    let half = bits.div_ceil(2);
    let [k0, k1, k2, offset] = subkeys(seed);
    let mut i = index;
    loop {
        i = (i ^ k0).wrapping_mul(k1 | 1) & mask;
        i ^= i >> half;
        i = (i ^ (k1 >> 16)).wrapping_mul(k2 | 1) & mask;
        i ^= i >> half;
        i = i.wrapping_mul(k0.rotate_left(16) | 1).wrapping_add(k2 >> 16) & mask;
        i ^= i >> half;
        if i < length {
            break;
        }
    }
    let rotated = u64::from(i) + ((u64::from(offset) * u64::from(length)) >> 32);
    if rotated >= u64::from(length) { (rotated - u64::from(length)) as u32 } else { rotated as u32 }
}

/// Four words from one: a Weyl sequence through the finaliser of MurmurHash3 (Appleby).
#[inline(always)]
fn subkeys(seed: u32) -> [u32; 4] {
    [1u32, 2, 3, 4].map(|k| {
        let mut h = seed.wrapping_add(k.wrapping_mul(0x9E37_79B9));
        h = (h ^ (h >> 16)).wrapping_mul(0x85EB_CA6B);
        h = (h ^ (h >> 13)).wrapping_mul(0xC2B2_AE35);
        h ^ (h >> 16)
    })
}
