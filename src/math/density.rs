//! Probability densities that know their measure.

/// Density with respect to solid angle, sr⁻¹.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct SolidAngle(pub f32);

/// Density with respect to surface area, (scene unit)⁻².
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Area(pub f32);

/// Probability of one of finitely many outcomes.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Discrete(pub f32);

impl Area {
    /// The same points, as directions seen from a point at squared distance `distance2`, where `cos` > 0 is the cosine
    /// between the surface normal and the connecting line: p_ω = p_A·d²/cos.
    #[inline(always)]
    pub fn seen(self, distance2: f32, cos: f32) -> SolidAngle {
        SolidAngle(self.0 * distance2 / cos)
    }
}

impl std::ops::Mul<Discrete> for SolidAngle {
    type Output = Self;

    /// Density of a direction drawn by a technique that is itself chosen at random.
    #[inline(always)]
    fn mul(self, choice: Discrete) -> Self {
        Self(self.0 * choice.0)
    }
}
