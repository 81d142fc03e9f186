//! Independent uniform points.

use super::Draw;
use crate::sampling::rng::philox4x32;

#[inline(always)]
pub(super) fn words(draw: &Draw, group: u32) -> [u32; 4] {
    philox4x32([draw.pixel, draw.sample as u32, (draw.sample >> 32) as u32, group], draw.key)
}
