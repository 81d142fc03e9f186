//! Linear RGB, Rec. 709 primaries.

use glam::Vec3;

/// Linear RGB (Rec. 709 primaries): x = red, y = green, z = blue. Radiance in W m⁻² sr⁻¹ or unitless reflectance.
pub type Rgb = Vec3;

/// CIE Y of a linear Rec. 709 colour.
pub fn luminance(c: Rgb) -> f32 {
    c.dot(Vec3::new(0.212_639, 0.715_169, 0.072_192))
}

/// Decodes one sRGB channel, 0 to 1 (IEC 61966-2-1).
pub fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}
