//! How the samples of one value are spread over the unit cube: one file per sequence.

mod independent;
mod latin_hypercube;
mod permutation;
mod sobol;
mod stratified;

pub use permutation::permute;
pub use sobol::sobol;

use self::latin_hypercube::LatinHypercube;
use self::stratified::Stratified;
use super::rng::{Key, philox4x32};
use crate::math::LANES;
use crate::math::lanes::lane_of;

/// A sequence: how sample points of one value relate to one another.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Sequence {
    /// Independent uniform points.
    #[default]
    Independent,
    /// Jittered: words 0, 1 of a group fall into their own cell of a rectangular grid, words 2 and 3 into their own interval.
    Stratified,
    /// Every word falls into its own interval, each dimension permuted on its own.
    LatinHypercube,
    /// Owen-scrambled Sobol points, padded in groups of four dimensions (Burley 2020).
    Sobol,
}

/// The identity of one sample: pure input of every random number it uses.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// Seed, role, strategy and replicate.
    pub key: Key,
    /// Index of the value or pixel.
    pub pixel: u32,
    /// Index of the sample.
    pub sample: u64,
    /// Number of samples of this value in the whole run: what stratified and Latin hypercube points divide by.
    pub length: u64,
    /// The sequence.
    pub sequence: Sequence,
}

impl Draw {
    /// The four words of a group ([`super::dimension::group`], < 2³¹): each uniform on its own, together as the sequence says.
    #[inline(always)]
    pub fn words(&self, group: u32) -> [u32; 4] {
        match self.sequence {
            Sequence::Independent => independent::words(self, group),
            Sequence::Stratified => Stratified::words(self, group),
            Sequence::LatinHypercube => LatinHypercube::words(self, group),
            Sequence::Sobol => sobol::words(self, group),
        }
    }

    /// [`Self::words`] of other samples, whatever `self.pixel` and `self.sample` are: `[word][lane]`.
    #[inline(always)]
    pub fn words_lanes(&self, pixels: &[u32; LANES], samples: &[u64; LANES], group: u32) -> [[u32; LANES]; 4] {
        let lanes = Lanes { draw: self, pixels, samples };
        match self.sequence {
            Sequence::Independent => independent::words_lanes(&lanes, group),
            Sequence::Stratified => Stratified::words_lanes(&lanes, group),
            Sequence::LatinHypercube => LatinHypercube::words_lanes(&lanes, group),
            Sequence::Sobol => sobol::words_lanes(&lanes, group),
        }
    }

    /// Four words that all samples of a block share: seeds of permutations and scrambles. The top bit of the last counter word
    /// keeps them apart from the words of independent samples.
    #[inline(always)]
    fn seeds(&self, block: u64, group: u32) -> [u32; 4] {
        philox4x32([self.pixel, block as u32, (block >> 32) as u32, group | 1 << 31], self.key)
    }

    /// (block, index within it, samples per block). A block is the whole run; runs that 32 bits cannot number, and samples
    /// beyond the announced length, get further blocks with strata of their own.
    #[inline(always)]
    fn strata(&self) -> (u64, u32, u32) {
        let length = if self.length > u64::from(u32::MAX) { 1 << 31 } else { self.length.max(1) };
        let (block, index) =
            if self.sample < length { (0, self.sample) } else { (self.sample / length, self.sample % length) };
        (block, index as u32, length as u32)
    }
}

/// The identities of a packet of samples: a draw but for pixel and sample.
#[derive(Clone, Copy)]
struct Lanes<'a> {
    draw: &'a Draw,
    pixels: &'a [u32; LANES],
    samples: &'a [u64; LANES],
}

impl Lanes<'_> {
    /// [`Draw::strata`], for lengths that are powers of two.
    #[inline(always)]
    fn strata(&self) -> Option<([u64; LANES], [u32; LANES], u32)> {
        let length = self.draw.length.max(1);
        if !length.is_power_of_two() || length > u64::from(u32::MAX) {
            return None;
        }
        let (mut block, mut index) = ([0; LANES], [0; LANES]);
        for lane in 0..LANES {
            block[lane] = self.samples[lane] >> length.trailing_zeros();
            index[lane] = (self.samples[lane] & (length - 1)) as u32;
        }
        Some((block, index, length as u32))
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Draw {
        Draw { pixel: self.pixels[lane], sample: self.samples[lane], ..*self.draw }
    }

    /// [`Draw::seeds`].
    #[inline(always)]
    fn seeds(&self, blocks: &[u64; LANES], group: u32) -> [[u32; LANES]; 4] {
        let mut out = [[0; LANES]; 4];
        let (mut pixels, mut other) = (0, 0);
        for lane in 0..LANES {
            pixels |= self.pixels[lane] ^ self.pixels[0];
            other |= blocks[lane] ^ blocks[0];
        }
        if pixels == 0 && other == 0 {
            let seeds = self.get(0).seeds(blocks[0], group);
            for word in 0..4 {
                out[word] = [seeds[word]; LANES];
            }
        } else {
            for lane in 0..LANES {
                set(&mut out, lane, self.get(lane).seeds(blocks[lane], group));
            }
        }
        out
    }
}

/// Replaces the words of a lane.
#[inline(always)]
fn set(words: &mut [[u32; LANES]; 4], lane: usize, [a, b, c, d]: [u32; 4]) {
    (words[0][lane], words[1][lane], words[2][lane], words[3][lane]) = (a, b, c, d);
}

/// A sequence that gives every sample strata of its own. (A trait, not a closure: calls of a closure stay out of line, compiled
/// without the caller's instructions.)
trait Strata {
    /// The words of sample `index` of `length`, from seeds that all of them share and its own independent words. `POWER` says
    /// that `length` is a power of two.
    fn place<const POWER: bool>(index: u32, length: u32, seeds: [u32; 4], jitter: [u32; 4]) -> [u32; 4];

    #[inline(always)]
    fn words(draw: &Draw, group: u32) -> [u32; 4] {
        let (block, index, length) = draw.strata();
        let (seeds, jitter) = (draw.seeds(block, group), independent::words(draw, group));
        if length.is_power_of_two() {
            Self::place::<true>(index, length, seeds, jitter)
        } else {
            Self::place::<false>(index, length, seeds, jitter)
        }
    }

    #[inline(always)]
    fn words_lanes(lanes: &Lanes<'_>, group: u32) -> [[u32; LANES]; 4] {
        let Some((block, index, length)) = lanes.strata() else {
            let mut out = [[0; LANES]; 4];
            for lane in 0..LANES {
                set(&mut out, lane, Self::words(&lanes.get(lane), group));
            }
            return out;
        };
        let (seeds, mut out) = (lanes.seeds(&block, group), independent::words_lanes(lanes, group));
        for lane in 0..LANES {
            let words = Self::place::<true>(index[lane], length, lane_of(&seeds, lane), lane_of(&out, lane));
            set(&mut out, lane, words);
        }
        out
    }
}

/// The word at `jitter`·2⁻³² of the way through stratum `stratum` of `strata` equal ones; never outside of it. `POWER` says
/// that there are a power of two of them: quick, and without branches.
#[inline(always)]
fn jittered<const POWER: bool>(stratum: u32, strata: u32, jitter: u32) -> u32 {
    span::<POWER>(stratum, stratum + 1, strata, jitter)
}

/// The word at `jitter`·2⁻³² of the way from `from/of` to `to/of`; never outside.
#[inline(always)]
fn span<const POWER: bool>(from: u32, to: u32, of: u32, jitter: u32) -> u32 {
    let start = u64::from(from) << 32;
    let position = start + u64::from(to - from) * u64::from(jitter);
    if POWER {
        return (position >> of.trailing_zeros()) as u32;
    }
    let word = position / u64::from(of);
    // Rounding down must not cross the lower edge.
    (word + u64::from(word * u64::from(of) < start)) as u32
}
