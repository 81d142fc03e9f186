//! Sine, cosine and arc tangent made of additions, multiplications and divisions only, so that every CPU and the Vulkan twin
//! give the same bits. Polynomials: minimax in relative error, fitted for this project (Lawson's algorithm).

use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// (sin, cos) of `2π·t` for |t| ≤ 1/8. Relative error of the sine and absolute error of the cosine below 2⁻²³.
#[inline(always)]
pub fn sin_cos_eighth(t: f32) -> (f32, f32) {
    let z = t * t;
    let s = t * (TAU + z * (-41.341_66 + z * (81.592_354 + z * -75.393_56)));
    let c = 1.0 + z * (-19.739_209 + z * (64.939_31 + z * (-85.442_3 + z * 59.202_797)));
    (s, c)
}

/// (sin, cos) of `2π·t` for 0 ≤ t ≤ 1. The reduction to an eighth of a turn is exact.
#[inline(always)]
pub fn sin_cos_turns(t: f32) -> (f32, f32) {
    let quarter = (4.0 * t + 0.5) as i32;
    let (s, c) = sin_cos_eighth(t - 0.25 * quarter as f32);
    let (a, b) = if quarter & 1 == 0 { (s, c) } else { (c, s) };
    (if quarter & 2 == 0 { a } else { -a }, if (quarter + 1) & 2 == 0 { b } else { -b })
}

/// Arc tangent for |x| ≤ 1, radians; relative error below 2⁻²².
#[inline(always)]
fn atan_unit(x: f32) -> f32 {
    let z = x * x;
    let high = 0.106_409_34 + z * (-0.075_042_94 + z * (0.042_691_51 + z * (-0.016_068_623 + z * 0.002_849_888_2)));
    x + x * (z * (-0.333_330_73 + z * (0.199_926_19 + z * (-0.142_036_44 + z * high))))
}

/// The angle of the vector (x, y) in \[−π, π\]; relative error below 2⁻²¹ near 0. Both zero gives NaN: no direction, no angle.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay > ax;
    let a = atan_unit(if steep { ax / ay } else { ay / ax });
    let a = if steep { FRAC_PI_2 - a } else { a };
    let a = if x < 0.0 { PI - a } else { a };
    a.copysign(y)
}
