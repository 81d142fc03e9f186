//! Latin hypercube sampling: every word falls into its own interval, each dimension permuted on its own.
//!
//! Source: McKay, Beckman, Conover, "A comparison of three methods for selecting values of input variables", 1979.

use super::{Draw, independent, jittered, permute};

#[inline(always)]
pub(super) fn words(draw: &Draw, group: u32) -> [u32; 4] {
    let (block, index, length) = draw.strata();
    let seeds = draw.seeds(block, group);
    let jitter = independent::words(draw, group);
    [0, 1, 2, 3].map(|i| jittered(permute(index, length, seeds[i]), length, jitter[i]))
}
