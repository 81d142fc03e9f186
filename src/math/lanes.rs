//! Sixteen values side by side. Stages of the path tracer loop over lanes with the scalar formulas; the compiler turns such
//! a loop into vector instructions where the body allows, with the same bits.

use super::Vec3;

/// Values side by side.
pub const LANES: usize = 16;

/// One vector per lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Vec3Lanes {
    /// First components.
    pub x: [f32; LANES],
    /// Second components.
    pub y: [f32; LANES],
    /// Third components.
    pub z: [f32; LANES],
}

impl Vec3Lanes {
    /// Zero vectors.
    pub const ZERO: Self = Self { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };

    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        Self { x: [v.x; LANES], y: [v.y; LANES], z: [v.z; LANES] }
    }

    /// The vector of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Replaces the vector of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }
}

/// Bit i: `flags[i]` is not 0.
#[inline(always)]
pub fn bits(flags: &[u32; LANES]) -> u32 {
    (0..LANES).fold(0, |bits, lane| bits | u32::from(flags[lane] != 0) << lane)
}

/// Indices of the set bits, lowest first.
#[inline(always)]
pub fn set_bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            lane
        })
    })
}

/// The four words of a lane. (An array's `map` is not always inlined, least of all into code for other instructions.)
#[inline(always)]
pub fn lane_of(words: &[[u32; LANES]; 4], lane: usize) -> [u32; 4] {
    [words[0][lane], words[1][lane], words[2][lane], words[3][lane]]
}
