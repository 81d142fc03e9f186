//! Jittered sampling: words 0, 1 of a group fall into their own cell of a grid, words 2 and 3 into their own interval.
//!
//! The N cells stand in rows: √N rows for squares, 2^⌊k/2⌋ for 2^k, ⌊√N⌋ else. Row r holds the cells ⌈rN/R⌉ ≤ c < ⌈(r+1)N/R⌉
//! and spans the same part of the unit interval, so that every cell has area 1/N for every N, primes included.

use super::{Draw, independent, jittered, permute, quotient, span};

/// Rows of the grid of `length` cells.
#[inline(always)]
fn rows(length: u32) -> u32 {
    if length.is_power_of_two() { 1 << (length.trailing_zeros() / 2) } else { f64::from(length).sqrt() as u32 }
}

/// A word in the column and one in the row of a cell.
#[inline(always)]
fn cell(cell: u32, length: u32, jitter: [u32; 2]) -> [u32; 2] {
    let rows = rows(length);
    let (n, r) = (u64::from(length), u64::from(rows));
    let row = quotient(u64::from(cell) * r, n);
    let start = quotient(row * n + r - 1, r) as u32;
    let end = quotient((row + 1) * n + r - 1, r) as u32;
    [jittered(cell - start, end - start, jitter[0]), span(start, end, length, jitter[1])]
}

#[inline(always)]
pub(super) fn words(draw: &Draw, group: u32) -> [u32; 4] {
    let (block, index, length) = draw.strata();
    let seeds = draw.seeds(block, group);
    let j = independent::words(draw, group);
    let [x, y] = cell(permute(index, length, seeds[0]), length, [j[0], j[1]]);
    let z = jittered(permute(index, length, seeds[1]), length, j[2]);
    let w = jittered(permute(index, length, seeds[2]), length, j[3]);
    [x, y, z, w]
}
