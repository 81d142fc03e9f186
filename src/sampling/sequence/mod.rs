//! How the samples of one value are spread over the unit cube: one file per sequence.

use super::rng::Key;

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
