//! Values of attributes: numbers, vectors, colours, transforms.

use super::super::shorten;
use super::super::spectrum::Spectrum;
use crate::math::srgb_to_linear;
use glam::{DAffine3, DMat3, DVec3};

/// A property's value.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Float(f64),
    Integer(i64),
    Boolean(bool),
    String(String),
    /// `<point>` or `<vector>`.
    Vector(DVec3),
    Rgb(DVec3),
    Spectrum(Spectrum),
    Transform(DAffine3),
}

impl Value {
    /// The XML element that makes such a value.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Float(_) => "float",
            Self::Integer(_) => "integer",
            Self::Boolean(_) => "boolean",
            Self::String(_) => "string",
            Self::Vector(_) => "point or vector",
            Self::Rgb(_) => "rgb",
            Self::Spectrum(_) => "spectrum",
            Self::Transform(_) => "transform",
        }
    }
}

/// A result whose message still lacks its place.
pub(super) type Parsed<T> = std::result::Result<T, String>;

/// Numbers separated by blanks or commas.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_ascii_whitespace()).filter(|w| !w.is_empty())
}

/// A finite number.
pub(super) fn float(text: &str) -> Parsed<f64> {
    let trimmed = text.trim();
    match trimmed.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        Ok(_) => Err(format!("`{}` is not a finite number", shorten(trimmed))),
        Err(_) => Err(format!("`{}` is not a number", shorten(trimmed))),
    }
}

pub(super) fn integer(text: &str) -> Parsed<i64> {
    text.trim().parse().map_err(|_| format!("`{}` is not an integer", shorten(text)))
}

pub(super) fn boolean(text: &str) -> Parsed<bool> {
    match text.trim().to_ascii_lowercase().as_str() {
        "true" => Ok(true),
        "false" => Ok(false),
        _ => Err(format!("`{}` is not a boolean; allowed: true, false", shorten(text))),
    }
}

/// All numbers of a list.
pub(super) fn floats(text: &str) -> Parsed<Vec<f64>> {
    words(text).map(float).collect()
}

/// Exactly three numbers.
pub(super) fn triple(text: &str) -> Parsed<DVec3> {
    match floats(text)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        ref list => Err(format!("{} numbers in `{}`; three are wanted", list.len(), shorten(text))),
    }
}

/// One or three numbers, or `#rrggbb` as in Mitsuba 0.x.
pub(super) fn rgb(text: &str) -> Parsed<DVec3> {
    if let Some(hex) = text.trim().strip_prefix('#') {
        let code = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6 && !hex.starts_with('+'));
        let code = code.ok_or_else(|| format!("`{}` is not a colour like #ff8000", shorten(text)))?;
        return Ok(DVec3::new((code >> 16) as f64, (code >> 8 & 255) as f64, (code & 255) as f64) / 255.0);
    }
    match floats(text)?[..] {
        [v] => Ok(DVec3::splat(v)),
        [r, g, b] => Ok(DVec3::new(r, g, b)),
        ref list => Err(format!("{} numbers in `{}`; a colour has one or three", list.len(), shorten(text))),
    }
}

/// Mitsuba 0.x's `<srgb>`: the same in the sRGB encoding.
pub(super) fn srgb(text: &str) -> Parsed<DVec3> {
    Ok(rgb(text)?.to_array().map(srgb_to_linear).into())
}

/// Three bare numbers, Mitsuba 0.x's spectra in RGB.
pub(super) fn bare_rgb(text: &str) -> Option<DVec3> {
    let numbers = if text.contains(':') { None } else { floats(text).ok() };
    numbers.and_then(|n| <[f64; 3]>::try_from(n).ok()).map(DVec3::from)
}

/// One value, or pairs `wavelength:value`.
pub(super) fn spectrum(text: &str) -> Parsed<Spectrum> {
    if !text.contains(':') {
        return match floats(text)?[..] {
            [v] => Ok(Spectrum::Constant(v)),
            _ => Err(format!("`{}` is neither one value nor pairs wavelength:value", shorten(text))),
        };
    }
    let mut list = Vec::new();
    for pair in words(text) {
        let (wavelength, value) =
            pair.split_once(':').ok_or_else(|| format!("`{}` is not a pair wavelength:value", shorten(pair)))?;
        list.push((float(wavelength)?, float(value)?));
    }
    rising(list)
}

/// The text of a `.spd` file: a wavelength and a value on each line, `#` starts a comment. Errors carry their line.
pub(super) fn spectrum_file(text: &str) -> std::result::Result<Spectrum, (u32, String)> {
    let mut list = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        match floats(line.split('#').next().unwrap_or_default()).map_err(|m| (number, m))?[..] {
            [] => {}
            [wavelength, value] => list.push((wavelength, value)),
            _ => return Err((number, "a line must hold a wavelength and a value".into())),
        }
    }
    rising(list).map_err(|m| (0, m))
}

fn rising(list: Vec<(f64, f64)>) -> Parsed<Spectrum> {
    if list.len() < 2 {
        return Err("a spectrum of pairs needs at least two of them".into());
    }
    if let Some(w) = list.windows(2).find(|w| w[0].0 >= w[1].0) {
        return Err(format!("wavelengths must rise; found {} after {}", w[1].0, w[0].0));
    }
    Ok(Spectrum::List(list))
}

/// A vector from `value` (one or three numbers) or `x`, `y`, `z`, each with a default.
pub(super) fn components(value: Option<&str>, xyz: [Option<&str>; 3], default: f64) -> Parsed<DVec3> {
    match value {
        Some(_) if xyz.iter().any(Option::is_some) => Err("found both `value` and `x`, `y`, `z`; give one".into()),
        Some(text) => match floats(text)?[..] {
            [v] => Ok(DVec3::splat(v)),
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            ref list => Err(format!("{} numbers in `{}`; one or three are wanted", list.len(), shorten(text))),
        },
        None => {
            let mut v = DVec3::splat(default);
            for (i, text) in xyz.iter().enumerate() {
                if let Some(text) = text {
                    v[i] = float(text)?;
                }
            }
            Ok(v)
        }
    }
}

pub(super) fn rotation(axis: DVec3, degrees: f64) -> Parsed<DAffine3> {
    let axis = axis.try_normalize().ok_or("the rotation axis has no length")?;
    Ok(DAffine3::from_axis_angle(axis, degrees.to_radians()))
}

/// 9 or 16 numbers, row by row.
pub(super) fn matrix(text: &str) -> Parsed<DAffine3> {
    let m = floats(text)?;
    let row = |i: usize, width: usize| DVec3::new(m[i * width], m[i * width + 1], m[i * width + 2]);
    match m.len() {
        9 => Ok(DAffine3::from_mat3(DMat3::from_cols(row(0, 3), row(1, 3), row(2, 3)).transpose())),
        16 if m[12..] == [0.0, 0.0, 0.0, 1.0] => {
            let linear = DMat3::from_cols(row(0, 4), row(1, 4), row(2, 4)).transpose();
            Ok(DAffine3::from_mat3_translation(linear, DVec3::new(m[3], m[7], m[11])))
        }
        16 => Err("the last row of a matrix must be 0 0 0 1".into()),
        n => Err(format!("a matrix of {n} numbers; 9 or 16 are wanted")),
    }
}

/// Mitsuba's camera frame: z towards the target, y up, x to the left. Without `up`, or where it is zero, any frame will do:
/// Mitsuba's own choice is taken (Duff et al., JCGT 6(1), 2017).
pub(super) fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Parsed<DAffine3> {
    let z = (target - origin).try_normalize().ok_or("lookat: origin and target coincide")?;
    let up = if up == DVec3::ZERO { tangents(z)[0] } else { up };
    let x = up.cross(z).try_normalize().ok_or("lookat: `up` is along the viewing direction")?;
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), origin))
}

/// The tangents of [`crate::math::Frame::new`], in f64.
pub(super) fn tangents(n: DVec3) -> [DVec3; 2] {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y)]
}
