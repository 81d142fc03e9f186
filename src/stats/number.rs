//! Numbers as people read them: rounded to what their uncertainty supports.

use crate::record::Interval;

/// `x` with so many significant digits; powers of ten outside 10⁻⁴ … 10⁶.
pub(crate) fn significant(x: f64, digits: i32) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    // Rounding first: 9.96 with two digits is 10, not 10.0.
    let rounded: f64 = format!("{x:.*e}", (digits - 1).max(0) as usize).parse().unwrap_or(x);
    let exponent = exponent_of(rounded);
    if (-4..=6).contains(&exponent) {
        decimal(rounded, digits - 1 - exponent)
    } else {
        format!("{}×10{}", decimal(rounded / 10f64.powi(exponent), digits - 1), superscript(exponent))
    }
}

/// "12.3 [11.8, 12.9]": as many decimals as leave two significant digits of the interval's width, `suffix` behind the
/// estimate. Three significant digits and no brackets where there are no bounds.
pub(crate) fn format_interval(i: &Interval, suffix: &str) -> String {
    let (Some(lower), Some(upper)) = (i.lower, i.upper) else {
        return format!("{}{suffix}", significant(i.estimate, 3));
    };
    if ![i.estimate, lower, upper].iter().all(|v| v.is_finite()) {
        let [e, l, u] = [i.estimate, lower, upper].map(|v| significant(v, 3));
        return format!("{e}{suffix} [{l}, {u}]");
    }
    let ([e, l, u], power) = alike(i.estimate, lower, upper);
    format!("{e}{suffix} [{l}, {u}]{power}")
}

/// Bounds as text: as many decimals as leave two significant digits of their distance.
pub(crate) fn range(estimate: f64, lower: f64, upper: f64) -> [String; 2] {
    if ![estimate, lower, upper].iter().all(|v| v.is_finite()) {
        return [lower, upper].map(|v| significant(v, 3));
    }
    let ([_, lower, upper], power) = alike(estimate, lower, upper);
    [lower, upper].map(|bound| bound + &power)
}

/// Estimate and bounds rounded to what the bounds' distance supports, and the power of ten that they are to be multiplied by.
fn alike(estimate: f64, lower: f64, upper: f64) -> ([String; 3], String) {
    let (scale, power) = common_power(&[estimate, lower, upper]);
    let [e, l, u] = [estimate, lower, upper].map(|v| v / scale);
    let decimals = decimals(e, u - l);
    ([e, l, u].map(|v| decimal(v, decimals)), power)
}

/// "12.31 ± 0.55": the estimate and half the interval's width, rounded alike.
pub(crate) fn format_half_width(i: &Interval) -> String {
    let (Some(lower), Some(upper)) = (i.lower, i.upper) else {
        return significant(i.estimate, 3);
    };
    let half = (upper - lower) / 2.0;
    if !i.estimate.is_finite() || !half.is_finite() {
        return significant(i.estimate, 3);
    }
    let (scale, power) = common_power(&[i.estimate, half]);
    let decimals = decimals(i.estimate / scale, 2.0 * half / scale);
    let (e, h) = (decimal(i.estimate / scale, decimals), decimal(half / scale, decimals));
    if power.is_empty() { format!("{e} ± {h}") } else { format!("({e} ± {h}){power}") }
}

/// A share in percent, "1 %".
pub(crate) fn percent(x: f64) -> String {
    percent_to(x, 3)
}

/// A measured share in percent, to the two digits that matter.
pub(crate) fn about(x: f64) -> String {
    percent_to(x, 2)
}

fn percent_to(x: f64, digits: i32) -> String {
    let text = significant(100.0 * x, digits);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} %")
}

/// A confidence, "99 %", "99.984 %": never rounded to certainty.
pub(crate) fn confidence(x: f64) -> String {
    let doubt = 100.0 * (1.0 - x);
    let text = decimal(100.0 * x, (1 - exponent_of(doubt)).clamp(1, 12));
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

/// ⌊log₁₀|x|⌋ of a finite number, 0 of zero.
fn exponent_of(x: f64) -> i32 {
    if x == 0.0 { 0 } else { format!("{x:e}").split_once('e').and_then(|p| p.1.parse().ok()).unwrap_or(0) }
}

/// The power of ten to take out of numbers that are too large or small to be written plainly, and its text.
fn common_power(values: &[f64]) -> (f64, String) {
    let exponent = exponent_of(values.iter().fold(0.0, |m: f64, v| m.max(v.abs())));
    if (-4..=6).contains(&exponent) {
        (1.0, String::new())
    } else {
        (10f64.powi(exponent), format!(" ×10{}", superscript(exponent)))
    }
}

/// Decimals that leave two significant digits of `width`, but at least one and at most six of `estimate` (a wide
/// interval must not round 40 to 0); three of it where `width` is 0.
fn decimals(estimate: f64, width: f64) -> i32 {
    // A width of 0.1 may come as 0.0999…9, which has another exponent.
    let width: f64 = format!("{width:.3e}").parse().unwrap_or(width);
    let digits = |n: i32| n - 1 - exponent_of(estimate);
    if width == 0.0 { digits(3) } else { (1 - exponent_of(width)).clamp(digits(1), digits(6)) }
}

/// Fixed point; negative `decimals` round to tens, hundreds …
fn decimal(x: f64, decimals: i32) -> String {
    let text = if decimals >= 0 {
        format!("{x:.*}", decimals as usize)
    } else {
        let unit = 10f64.powi(-decimals);
        format!("{:.0}", (x / unit).round() * unit)
    };
    // "-0.00" says nothing that "0.00" does not.
    if text.starts_with('-') && !text.contains(|c: char| ('1'..='9').contains(&c)) {
        text[1..].to_owned()
    } else {
        text
    }
}

/// An integer in superscript digits.
pub(crate) fn superscript(n: i32) -> String {
    let digit = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        _ => char::from_u32('⁰' as u32 + c as u32 - '0' as u32).unwrap_or(c),
    };
    n.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(estimate: f64, lower: f64, upper: f64) -> Interval {
        Interval { estimate, lower: Some(lower), upper: Some(upper), confidence: 0.95 }
    }

    #[test]
    fn significant_digits() {
        let cases = [
            (0.0, 3, "0"),
            (9.96, 2, "10"),
            (0.012345, 3, "0.0123"),
            (123456.0, 2, "120000"),
            (1.5e-7, 3, "1.50×10⁻⁷"),
            (-2.0e12, 2, "-2.0×10¹²"),
            (f64::NAN, 3, "NaN"),
        ];
        for (x, digits, expected) in cases {
            assert_eq!(significant(x, digits), expected);
        }
    }

    #[test]
    fn intervals_show_what_their_width_supports() {
        assert_eq!(format_interval(&interval(12.31234, 11.84, 12.93), "×"), "12.3× [11.8, 12.9]");
        assert_eq!(format_interval(&interval(-0.5012, -0.5103, -0.4921), ""), "-0.501 [-0.510, -0.492]");
        assert_eq!(format_interval(&interval(1234.0, 1000.0, 1500.0), ""), "1230 [1000, 1500]");
        assert_eq!(format_interval(&interval(1.234e-9, 1.2e-9, 1.3e-9), "*"), "1.23* [1.20, 1.30] ×10⁻⁹");
        assert_eq!(format_interval(&interval(2.0, 2.0, 2.0), ""), "2.00 [2.00, 2.00]");
        assert_eq!(format_interval(&interval(1.0, -0.001, f64::INFINITY), ""), "1.00 [-0.00100, inf]");
        let alone = Interval { estimate: 3.1459, lower: None, upper: None, confidence: 0.95 };
        assert_eq!(format_interval(&alone, "×"), "3.15×");
    }

    #[test]
    fn half_widths() {
        assert_eq!(format_half_width(&interval(1.234, 1.174, 1.294)), "1.23 ± 0.06");
        assert_eq!(format_half_width(&interval(1.234e-8, 1.174e-8, 1.294e-8)), "(1.23 ± 0.06) ×10⁻⁸");
        assert_eq!(percent(0.01), "1 %");
        assert_eq!(percent(0.0025), "0.25 %");
        assert_eq!(percent(1.0), "100 %");
        assert_eq!([0.95, 0.99, 0.999, 1.0 - 0.01 / 64.0].map(confidence), ["95 %", "99 %", "99.9 %", "99.984 %"]);
    }
}
