//! Latin hypercube sampling: every word falls into its own interval, each dimension permuted on its own.
//!
//! Source: McKay, Beckman, Conover, "A comparison of three methods for selecting values of input variables", 1979.

use super::permutation::permute_in;
use super::{Strata, jittered};

pub(super) struct LatinHypercube;

impl Strata for LatinHypercube {
    #[inline(always)]
    fn place<const POWER: bool>(index: u32, length: u32, seeds: [u32; 4], jitter: [u32; 4]) -> [u32; 4] {
        let mut words = [0; 4];
        for i in 0..4 {
            words[i] = jittered::<POWER>(permute_in::<POWER>(index, length, seeds[i]), length, jitter[i]);
        }
        words
    }
}
