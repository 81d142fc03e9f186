//! Spectra as linear RGB, by the same sums as Mitsuba 3's rgb variants, so that scenes given as spectra agree with it.

use super::cie;
use crate::math::Rgb;
use glam::{DMat3, DVec3};

/// What a spectrum stands for: reflectances are seen under D65, emission is taken as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Unitless, in \[0, 1\].
    Reflectance,
    /// W m⁻² sr⁻¹ nm⁻¹, or W sr⁻¹ nm⁻¹.
    Emission,
}

/// A spectrum as a file gives it. Wavelengths in nm.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// The same value at every wavelength.
    Constant(f64),
    /// (wavelength, value), wavelengths rising; linear in between, zero outside.
    List(Vec<(f64, f64)>),
    /// Planck's law.
    Blackbody {
        /// K.
        temperature: f64,
        /// Zero outside this range, nm.
        range: [f64; 2],
    },
}

/// Samples of the sum over wavelengths; both ends count.
const STEPS: usize = 1000;
/// Makes a unit spectrum have luminance 1: the same sum over ȳ.
const PER_Y: f64 = 1.0 / 106.750_259_399_414_06;
/// Makes D65 have the luminance of a unit spectrum.
const PER_D65: f64 = 1.0 / 98.997_417_518_762_55;

impl Spectrum {
    /// Linear Rec. 709 RGB, not clamped: spectral colours have negative components.
    /// Mitsuba 3 sums the product with the CIE 1931 2° observer at 1000 wavelengths; a constant emission spectrum is
    /// the colour of illuminant E. (Its rgb variants have no black body: ours is summed like a list of values.)
    pub fn to_rgb(&self, role: Role) -> Rgb {
        if let (Spectrum::Constant(v), Role::Reflectance) = (self, role) {
            return DVec3::splat(*v).as_vec3();
        }
        if let Spectrum::Constant(v) = self {
            return (xyz_to_rgb(DVec3::ONE) * *v).as_vec3();
        }
        let mut sum = DVec3::ZERO;
        for i in 0..STEPS {
            let wavelength = cie::FIRST + i as f64 / (STEPS - 1) as f64 * (cie::LAST - cie::FIRST);
            let [x, y, z, d65] = observer(wavelength);
            let light = if role == Role::Reflectance { d65 * PER_D65 } else { 1.0 };
            sum += DVec3::new(x, y, z) * (self.at(wavelength) * light);
        }
        xyz_to_rgb(sum * ((cie::LAST - cie::FIRST) / STEPS as f64 * PER_Y)).as_vec3()
    }

    /// Value at a wavelength in nm.
    fn at(&self, wavelength: f64) -> f64 {
        match self {
            Spectrum::Constant(v) => *v,
            Spectrum::List(list) => interpolate(list, wavelength),
            Spectrum::Blackbody { temperature, range } => {
                if (range[0]..=range[1]).contains(&wavelength) {
                    planck(wavelength, *temperature)
                } else {
                    0.0
                }
            }
        }
    }
}

/// Linear interpolation in a rising list, zero outside it.
fn interpolate(list: &[(f64, f64)], x: f64) -> f64 {
    let i = list.partition_point(|p| p.0 <= x);
    match (i.checked_sub(1).map(|j| list[j]), list.get(i)) {
        (Some((x0, y0)), Some(&(x1, y1))) => y0 + (x - x0) / (x1 - x0) * (y1 - y0),
        (Some((x0, y0)), None) if x == x0 => y0,
        _ => 0.0,
    }
}

/// x̄, ȳ, z̄ and D65 at a wavelength inside the table.
fn observer(wavelength: f64) -> [f64; 4] {
    let t = (wavelength - cie::FIRST) / cie::STEP;
    let i = (t as usize).min(cie::TABLE.len() - 2);
    let w = t - i as f64;
    std::array::from_fn(|k| (1.0 - w) * cie::TABLE[i][k] + w * cie::TABLE[i + 1][k])
}

/// Spectral radiance of a black body, W m⁻² sr⁻¹ nm⁻¹. Constants: SI 2019 (exact).
fn planck(wavelength: f64, temperature: f64) -> f64 {
    let (c, h, k) = (2.997_924_58e8, 6.626_070_15e-34, 1.380_649e-23);
    let metres = wavelength * 1e-9;
    1e-9 * 2.0 * h * c * c / (metres.powi(5) * ((h * c / (metres * k * temperature)).exp() - 1.0))
}

/// CIE XYZ to linear Rec. 709, in the rounding that Mitsuba and pbrt use.
fn xyz_to_rgb(xyz: DVec3) -> DVec3 {
    DMat3::from_cols_array(&[
        3.240_479, -0.969_256, 0.055_648, -1.537_150, 1.875_991, -0.204_043, -0.498_535, 0.041_556, 1.057_311,
    ]) * xyz
}
