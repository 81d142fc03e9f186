//! Owen-scrambled Sobol points, padded in sets of four dimensions.
//!
//! A set joins the two decisions whose product carries most of the variance: where a path goes on (or, at the camera, the
//! position on the film) and the point on the light that is drawn at the next vertex. Sets are shuffled against one another,
//! which in base 2 makes interactions between them up to 4/3 as large as those of independent points; inside a set there
//! is no such loss. On the Cornell box this lowers the error at 256 spp by 5 % against a set per decision.
//!
//! Sources: Burley, "Practical hash-based Owen scrambling", JCGT 9(4), 2020 (padding, shuffling); Joe, Kuo, "Constructing Sobol
//! sequences with better two-dimensional projections", 2008 (primitive polynomials and first direction numbers); Vegdahl,
//! "Building a better LK hash", 2021 (the scrambling hash).

use super::{Draw, Lanes, set};
use crate::math::LANES;
use crate::math::lanes::lane_of;

/// Recurrences of dimensions 1 to 3 (dimension 0 is van der Corput's): degree, inner coefficients of the primitive polynomial,
/// first direction numbers.
const RECURRENCES: [(usize, u32, [u32; 3]); 3] = [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

/// The 32 direction numbers of dimension 1, 2 or 3, as fractions of 2³².
const fn directions(dimension: usize) -> [u32; 32] {
    let (degree, inner, first) = RECURRENCES[dimension - 1];
    let mut v = [0u32; 32];
    let mut i = 0;
    while i < 32 {
        v[i] = if i < degree {
            first[i] << (31 - i)
        } else {
            let mut x = v[i - degree] ^ (v[i - degree] >> degree);
            let mut k = 1;
            while k < degree {
                if (inner >> (degree - 1 - k)) & 1 == 1 {
                    x ^= v[i - k];
                }
                k += 1;
            }
            x
        };
        i += 1;
    }
    v
}

/// For each byte of the index and each value of it: what dimensions 2 and 3 get, with reversed bits.
static TABLE: [[[u32; 2]; 256]; 4] = table();

const fn table() -> [[[u32; 2]; 256]; 4] {
    let v = [directions(2), directions(3)];
    let mut t = [[[0u32; 2]; 256]; 4];
    let mut i = 0;
    while i < 4 * 256 * 8 {
        let (byte, value, bit) = (i >> 11, (i >> 3) & 255, i & 7);
        if (value >> bit) & 1 == 1 {
            t[byte][value][0] ^= v[0][8 * byte + bit].reverse_bits();
            t[byte][value][1] ^= v[1][8 * byte + bit].reverse_bits();
        }
        i += 1;
    }
    t
}

/// Dimensions 0 and 1 of point `index` of the unscrambled sequence with reversed bits: bit 0 is the first binary digit after
/// the point.
#[inline(always)]
fn low_reversed(index: u32) -> [u32; 2] {
    // Dimension 1 has the matrix of binomial coefficients mod 2, a Kronecker power: five butterflies.
    let mut p = index;
    p ^= (p & 0xAAAA_AAAA) >> 1;
    p ^= (p & 0xCCCC_CCCC) >> 2;
    p ^= (p & 0xF0F0_F0F0) >> 4;
    p ^= (p & 0xFF00_FF00) >> 8;
    p ^= (p & 0xFFFF_0000) >> 16;
    [index, p]
}

/// The same of dimensions 2 and 3.
#[inline(always)]
fn high_reversed(index: u32) -> [u32; 2] {
    let [b0, b1, b2, b3] = index.to_le_bytes();
    let (t0, t1, t2, t3) = (TABLE[0][b0 as usize], TABLE[1][b1 as usize], TABLE[2][b2 as usize], TABLE[3][b3 as usize]);
    [t0[0] ^ t1[0] ^ t2[0] ^ t3[0], t0[1] ^ t1[1] ^ t2[1] ^ t3[1]]
}

/// Point `index` of the unscrambled four-dimensional Sobol sequence, as fractions of 2³².
pub fn sobol(index: u32) -> [u32; 4] {
    let ([a, b], [c, d]) = (low_reversed(index), high_reversed(index));
    [a, b, c, d].map(u32::reverse_bits)
}

/// Owen scrambling of a word with reversed bits: bit i changes by a hash of the bits below it.
#[inline(always)]
fn owen_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3D20_ADEA);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6C56);
    x ^ x.wrapping_mul(0x53A2_2864)
}

/// What all samples of a value have in common in one set: how its points are shuffled and scrambled.
#[derive(Clone, Copy)]
struct Set {
    shuffle: u32,
    scramble: [u32; 4],
}

/// Marks the counters of sets' seeds, apart from those of groups.
const SETS: u32 = 1 << 30;

impl Set {
    #[inline(always)]
    fn new(seeds: [u32; 4]) -> Self {
        let [a, b, c, d] = seeds;
        // Any four of the five seeds are independent.
        Self { shuffle: a ^ b.rotate_left(8) ^ c.rotate_left(16) ^ d.rotate_left(24), scramble: seeds }
    }

    /// Dimensions 0 and 1 of a sample, or 2 and 3 if `HIGH`.
    #[inline(always)]
    fn pair<const HIGH: bool>(&self, sample: u64) -> [u32; 2] {
        let index = owen_reversed((sample as u32).reverse_bits(), self.shuffle).reverse_bits();
        let [s0, s1, s2, s3] = self.scramble;
        let ([a, b], s, t) = if HIGH { (high_reversed(index), s2, s3) } else { (low_reversed(index), s0, s1) };
        [owen_reversed(a, s).reverse_bits(), owen_reversed(b, t).reverse_bits()]
    }
}

/// Names of the two sets that a group's words belong to, and whether they are dimensions 2 and 3 of them (the light's) or 0
/// and 1. Groups alternate between the two decisions of a vertex; sets of a direction are those of the next vertex's light.
#[inline(always)]
fn sets(group: u32) -> ([u32; 2], bool) {
    let (vertex, light) = (group / 2, group % 2);
    let set = SETS | (2 * (vertex + 1 - light));
    ([set, set + 1], light == 1)
}

/// Words of a group: a pair of dimensions of two sets. Blocks of 2³² samples are scrambled apart.
#[inline(always)]
pub(super) fn words(draw: &Draw, group: u32) -> [u32; 4] {
    let (sets, high) = sets(group);
    let [a, b] = sets.map(|set| Set::new(draw.seeds(draw.sample >> 32, set)));
    let ([x, y], [z, w]) = if high {
        (a.pair::<true>(draw.sample), b.pair::<true>(draw.sample))
    } else {
        (a.pair::<false>(draw.sample), b.pair::<false>(draw.sample))
    };
    [x, y, z, w]
}

/// [`words`] of a packet: `[word][lane]`.
#[inline(always)]
pub(super) fn words_lanes(lanes: &Lanes<'_>, group: u32) -> [[u32; LANES]; 4] {
    let mut blocks = [0; LANES];
    for lane in 0..LANES {
        blocks[lane] = lanes.samples[lane] >> 32;
    }
    let ([first, second], high) = sets(group);
    let (a, b) = (lanes.seeds(&blocks, first), lanes.seeds(&blocks, second));
    if high { pairs::<true>(&a, &b, lanes.samples) } else { pairs::<false>(&a, &b, lanes.samples) }
}

#[inline(always)]
fn pairs<const HIGH: bool>(a: &[[u32; LANES]; 4], b: &[[u32; LANES]; 4], samples: &[u64; LANES]) -> [[u32; LANES]; 4] {
    let mut out = [[0; LANES]; 4];
    for lane in 0..LANES {
        let [x, y] = Set::new(lane_of(a, lane)).pair::<HIGH>(samples[lane]);
        let [z, w] = Set::new(lane_of(b, lane)).pair::<HIGH>(samples[lane]);
        set(&mut out, lane, [x, y, z, w]);
    }
    out
}
