//! Linear RGB, Rec. 709 primaries.

use glam::Vec3;

/// Linear RGB (Rec. 709 primaries): x = red, y = green, z = blue. Radiance in W m⁻² sr⁻¹ or unitless reflectance.
pub type Rgb = Vec3;

/// CIE Y of a linear Rec. 709 colour.
pub fn luminance(c: Rgb) -> f32 {
    c.dot(Vec3::new(0.212_639, 0.715_169, 0.072_192))
}
