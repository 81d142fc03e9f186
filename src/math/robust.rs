//! Floating-point helpers with stated error bounds (pbrt 4th ed. §6.8).

use glam::Vec3;

/// Unit roundoff of f32: one rounding errs by at most this, relatively.
pub const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// γ(n) = n·u/(1−n·u): bound on the relative error of n roundings in a row (Higham 2002, §3.1).
#[inline(always)]
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * UNIT_ROUNDOFF;
    nu / (1.0 - nu)
}

/// Moves `p` off the surface that it lies on, to the side that `direction` points to, by so much that every point within
/// `p_error` of `p` on the plane through it with normal `n` is left strictly behind (pbrt 4th ed. §6.8.6).
/// A zero `n` leaves `p` where it is (a point light, a camera).
#[inline(always)]
pub fn offset_origin(p: Vec3, p_error: Vec3, n: Vec3, direction: Vec3) -> Vec3 {
    // MIN_POSITIVE: a point on a plane through zero may have no error at all and must still leave the plane.
    let distance = n.abs().dot(p_error) + f32::MIN_POSITIVE;
    let side = if n.dot(direction) < 0.0 { -1.0 } else { 1.0 };
    let away = n * side;
    // Round away from the surface, never back onto it.
    let step = |p: f32, away: f32| outwards(p + away * distance, away);
    Vec3::new(step(p.x, away.x), step(p.y, away.y), step(p.z, away.z))
}

/// The float next to a finite `x` on the side of the sign of `away`; `x` itself where that is 0. Integer arithmetic without
/// branches, so that a loop over lanes becomes vector code.
#[inline(always)]
fn outwards(x: f32, away: f32) -> f32 {
    let step = i32::from(away > 0.0) - i32::from(away < 0.0);
    // Ordered as the floats are: −0 is −1 and 0 is 0, so a step across zero is one longer.
    let flip = |bits: i32| bits ^ (((bits >> 31) as u32 >> 1) as i32);
    let place = flip(x.to_bits() as i32);
    let crosses = i32::from((place == 0) & (step < 0)) - i32::from((place == -1) & (step > 0));
    f32::from_bits(flip(place + step - crosses) as u32)
}

#[cfg(test)]
mod tests {
    use super::outwards;

    #[test]
    fn outwards_is_next_up_and_next_down() {
        for x in [0.0, -0.0, 1.0, -1.0, f32::MIN_POSITIVE, -f32::MIN_POSITIVE, 1e-45, -1e-45, 3.5e37, -0.999_999_94] {
            assert_eq!(outwards(x, 0.3).to_bits(), x.next_up().to_bits(), "{x}");
            assert_eq!(outwards(x, -0.3).to_bits(), x.next_down().to_bits(), "{x}");
            assert_eq!(outwards(x, 0.0).to_bits(), x.to_bits(), "{x}");
        }
    }
}
