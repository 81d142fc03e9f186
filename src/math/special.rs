//! Exponential, logarithm and error functions made of additions, multiplications, divisions and roots only, so that every CPU
//! and the Vulkan twin give the same bits. Polynomials: minimax, fitted for this project (Lawson's algorithm).

use std::f32::consts::{LN_2, LOG2_E};

/// 1/√π.
pub const FRAC_1_SQRT_PI: f32 = 0.564_189_6;

/// exp(−x) for x ≥ 0, relative error below 2⁻²²; 0 from exp(−87) on, for ∞ and NaN.
#[inline(always)]
pub fn exp_neg(x: f32) -> f32 {
    if !(x < 87.0) {
        return 0.0;
    }
    let k = (x * LOG2_E + 0.5) as i32;
    let n = k as f32;
    // ln 2 in two parts, of which the first times k is exact.
    let r = (x - n * 0.693_359_4) + n * 2.121_944_4e-4;
    let high = 0.041_668_225 + r * (-0.008_374_822 + r * 0.001_383_683_8);
    let e = 1.0 + r * (-1.0 + r * (0.499_999_9 + r * (-0.166_664_2 + r * high)));
    e * f32::from_bits(((127 - k) as u32) << 23)
}

/// The natural logarithm of a normal x > 0; absolute error below 2⁻²³ near 1, relative error below 2⁻²² elsewhere.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    // The mantissa in [√½, √2).
    let bits = x.to_bits().wrapping_sub(0x3F35_04F3);
    let exponent = (bits as i32) >> 23;
    let m = f32::from_bits((bits & 0x007F_FFFF) + 0x3F35_04F3);
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let q = 1.0 + z * (0.333_334_1 + z * (0.199_873_72 + z * 0.149_634_66));
    exponent as f32 * LN_2 + 2.0 * s * q
}

/// exp(x²) erfc(x) for x ≥ 0, so good that erfc errs by at most 2⁻²¹.
#[inline(always)]
pub fn erfcx(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.39 * x);
    let high = 0.649_558_3 + t * (-0.635_398_9 + t * (0.886_663_56 + t * -0.227_536_92));
    t * (0.235_325_14 + t * (0.091_388_85 + t * high))
}

/// The error function, absolute error below 2⁻²¹.
#[inline(always)]
pub fn erf(x: f32) -> f32 {
    let a = x.abs();
    (1.0 - erfcx(a) * exp_neg(a * a)).copysign(x)
}

/// The inverse of [`erf`] for |x| < 1, relative error below 2⁻²¹ where |x| is not near 1. Variable of the polynomials: Giles,
/// "Approximating the erfinv function", GPU Computing Gems 2, 2010.
#[inline(always)]
pub fn erf_inv(x: f32) -> f32 {
    let w = -ln((1.0 - x) * (1.0 + x));
    let central = w < 5.0;
    let v = if central { w - 2.5 } else { w.sqrt() - 3.0 };
    let c: [f32; 9] = if central { CENTRE } else { TAIL };
    let high = c[5] + v * (c[6] + v * (c[7] + v * c[8]));
    x * (c[0] + v * (c[1] + v * (c[2] + v * (c[3] + v * (c[4] + v * high)))))
}

const CENTRE: [f32; 9] = [
    1.501_409_4,
    0.246_640_73,
    -0.004_177_707_7,
    -0.001_253_707_5,
    2.186_022e-4,
    -4.396_785_2e-6,
    -3.528_862_9e-6,
    3.437_274e-7,
    2.853_505_6e-8,
];
const TAIL: [f32; 9] = [
    2.832_977,
    1.001_674_3,
    0.009_434_04,
    -0.007_628_063,
    0.005_771_808,
    -0.003_649_808_5,
    0.001_278_984_1,
    7.594_396e-5,
    -1.503_516_9e-4,
];

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::function::erf as exact;

    #[test]
    fn functions_are_as_good_as_they_say() {
        for i in 0..200_000u32 {
            let x = f64::from(i) * 4e-4;
            let (f, x) = (x as f32, f64::from(x as f32));
            assert!((f64::from(exp_neg(f)) / (-x).exp() - 1.0).abs() < 2f64.powi(-22), "exp {x}");
            assert!((f64::from(erf(f)) - exact::erf(x)).abs() < 2f64.powi(-21), "erf {x}");
            assert!((f64::from(erfcx(f)) * (-x * x).exp() - exact::erfc(x)).abs() < 2f64.powi(-21), "erfc {x}");
            let p = f32::from_bits(0x2000_0000 + i * 5000);
            let l = f64::from(p).ln();
            assert!((f64::from(ln(p)) - l).abs() < 2f64.powi(-22) * l.abs().max(0.5), "ln {p}");
            let y = (i as f32 / 100_000.0 - 1.0).clamp(-0.999_999_9, 0.999_999_9);
            assert!((exact::erf(f64::from(erf_inv(y))) - f64::from(y)).abs() < 2f64.powi(-22), "erf_inv {y}");
        }
        assert_eq!([exp_neg(0.0), exp_neg(87.0), exp_neg(f32::INFINITY), exp_neg(f32::NAN)], [1.0, 0.0, 0.0, 0.0]);
        assert_eq!([erf(f32::INFINITY), erf(-100.0), erf_inv(0.0), ln(1.0)], [1.0, -1.0, 0.0, 0.0]);
    }
}
