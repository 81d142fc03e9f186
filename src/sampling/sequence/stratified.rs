//! Jittered sampling: words 0, 1 of a group fall into their own cell of a grid, words 2 and 3 into their own interval.
//!
//! The N cells stand in rows: √N rows for squares, 2^⌊k/2⌋ for 2^k, ⌊√N⌋ else. Row r holds the cells ⌈rN/R⌉ ≤ c < ⌈(r+1)N/R⌉
//! and spans the same part of the unit interval, so that every cell has area 1/N for every N, primes included.

use super::permutation::permute_in;
use super::{Strata, jittered, span};

/// Rows of the grid of `length` cells.
#[inline(always)]
fn rows(length: u32) -> u32 {
    if length.is_power_of_two() { 1 << (length.trailing_zeros() / 2) } else { f64::from(length).sqrt() as u32 }
}

/// A word in the column and one in the row of a cell.
#[inline(always)]
fn cell<const POWER: bool>(cell: u32, length: u32, jitter: [u32; 2]) -> [u32; 2] {
    let rows = rows(length);
    let (start, end) = if POWER {
        let columns = length >> rows.trailing_zeros();
        let start = cell & !(columns - 1);
        (start, start + columns)
    } else {
        let (n, r) = (u64::from(length), u64::from(rows));
        let row = u64::from(cell) * r / n;
        ((row * n).div_ceil(r) as u32, ((row + 1) * n).div_ceil(r) as u32)
    };
    // As many columns in every row of a power of two.
    let columns = if POWER { length >> rows.trailing_zeros() } else { end - start };
    [jittered::<POWER>(cell - start, columns, jitter[0]), span::<POWER>(start, end, length, jitter[1])]
}

pub(super) struct Stratified;

impl Strata for Stratified {
    #[inline(always)]
    fn place<const POWER: bool>(index: u32, length: u32, seeds: [u32; 4], j: [u32; 4]) -> [u32; 4] {
        let [x, y] = cell::<POWER>(permute_in::<POWER>(index, length, seeds[0]), length, [j[0], j[1]]);
        let z = jittered::<POWER>(permute_in::<POWER>(index, length, seeds[1]), length, j[2]);
        let w = jittered::<POWER>(permute_in::<POWER>(index, length, seeds[2]), length, j[3]);
        [x, y, z, w]
    }
}
