//! Independent uniform points.

use super::{Draw, Lanes, set};
use crate::math::LANES;
use crate::sampling::rng::philox4x32;

#[inline(always)]
pub(super) fn words(draw: &Draw, group: u32) -> [u32; 4] {
    philox4x32([draw.pixel, draw.sample as u32, (draw.sample >> 32) as u32, group], draw.key)
}

#[inline(always)]
pub(super) fn words_lanes(lanes: &Lanes<'_>, group: u32) -> [[u32; LANES]; 4] {
    let mut out = [[0; LANES]; 4];
    for lane in 0..LANES {
        set(&mut out, lane, words(&lanes.get(lane), group));
    }
    out
}
