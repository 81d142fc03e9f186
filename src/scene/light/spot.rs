//! Spot lights: a point light whose intensity falls off linearly with the angle from its axis (Mitsuba 3, `spot`).

use crate::math::Vec3;
use crate::math::trig::atan2;
use std::f64::consts::TAU;

/// What a spot light lets through, by direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Unit vector along which it shines.
    pub axis: Vec3,
    /// Angle from the axis beyond which it is dark, radians, in (0, π].
    pub cutoff: f32,
    /// Angle up to which it shines in full, radians, in \[0, `cutoff`\].
    pub width: f32,
}

impl Beam {
    /// Share of the intensity that goes into the unit direction `w`, away from the light.
    #[inline(never)]
    pub fn falloff(&self, w: Vec3) -> f32 {
        let angle = atan2(self.axis.cross(w).length(), self.axis.dot(w));
        if angle <= self.width {
            1.0
        } else if angle < self.cutoff {
            (self.cutoff - angle) / (self.cutoff - self.width)
        } else {
            0.0
        }
    }

    /// The integral of the falloff over all directions, sr: 2π(1 − (sin c − sin b)/(c − b)) for cutoff c and width b.
    pub fn solid_angle(&self) -> f64 {
        let (c, b) = (f64::from(self.cutoff), f64::from(self.width));
        // The limit of the quotient is the cosine.
        let slope = if c > b { (c.sin() - b.sin()) / (c - b) } else { c.cos() };
        TAU * (1.0 - slope)
    }
}
