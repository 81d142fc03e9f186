//! How the samples of one value are spread over the unit cube: one file per sequence.

mod independent;
mod latin_hypercube;
mod permutation;
mod sobol;
mod stratified;

pub use permutation::permute;
pub use sobol::sobol;

use super::rng::{Key, philox4x32};
use crate::math::LANES;

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
            Sequence::Stratified => stratified::words(self, group),
            Sequence::LatinHypercube => latin_hypercube::words(self, group),
            Sequence::Sobol => sobol::words(self, group),
        }
    }

    /// [`Self::words`] of eight samples of the same pixel, whatever `self.sample` is: `[word][lane]`.
    #[inline(always)]
    pub fn words_lanes(&self, samples: &[u64; LANES], group: u32) -> [[u32; LANES]; 4] {
        // One loop for each sequence, so that each can become vector code.
        match self.sequence {
            Sequence::Independent => self.each_lane(samples, |draw| independent::words(draw, group)),
            Sequence::Stratified => self.each_lane(samples, |draw| stratified::words(draw, group)),
            Sequence::LatinHypercube => self.each_lane(samples, |draw| latin_hypercube::words(draw, group)),
            // Blocks of 2³² samples are scrambled apart; a packet hardly ever straddles two.
            Sequence::Sobol if samples.iter().all(|s| s >> 32 == samples[0] >> 32) => {
                sobol::words_lanes(self, samples, group)
            }
            Sequence::Sobol => self.each_lane(samples, |draw| sobol::words(draw, group)),
        }
    }

    #[inline(always)]
    fn each_lane(&self, samples: &[u64; LANES], words: impl Fn(&Self) -> [u32; 4]) -> [[u32; LANES]; 4] {
        let mut out = [[0; LANES]; 4];
        for lane in 0..LANES {
            let [a, b, c, d] = words(&Self { sample: samples[lane], ..*self });
            (out[0][lane], out[1][lane], out[2][lane], out[3][lane]) = (a, b, c, d);
        }
        out
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

/// The word at `jitter`·2⁻³² of the way through stratum `stratum` of `strata` equal ones; never outside of it.
#[inline(always)]
fn jittered(stratum: u32, strata: u32, jitter: u32) -> u32 {
    span(stratum, stratum + 1, strata, jitter)
}

/// The word at `jitter`·2⁻³² of the way from `from/of` to `to/of`; never outside.
#[inline(always)]
fn span(from: u32, to: u32, of: u32, jitter: u32) -> u32 {
    let start = u64::from(from) << 32;
    let position = start + u64::from(to - from) * u64::from(jitter);
    let of = u64::from(of);
    let word = quotient(position, of);
    // Rounding down must not cross the lower edge.
    (word + u64::from(word * of < start)) as u32
}

/// a/b rounded down, quick for powers of two.
#[inline(always)]
fn quotient(a: u64, b: u64) -> u64 {
    if b.is_power_of_two() { a >> b.trailing_zeros() } else { a / b }
}
