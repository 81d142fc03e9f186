//! Pictures for textures and environment maps: PNG, JPEG, TGA, BMP, Radiance HDR, OpenEXR, PFM.

use super::{openexr, read, shorten};
use crate::error::{Error, Place, Result};
use crate::math::{Rgb, srgb_to_linear};
use exr::meta::attribute::Chromaticities;
use exr::prelude::FlatSamples;
use glam::{DMat3, DVec3};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::panic::catch_unwind;
use std::path::Path;

/// Largest width and height in pixels.
pub const LARGEST_SIDE: u32 = 16384;

/// Largest number of pixels.
const MOST_PIXELS: u64 = 1 << 27;

/// Bounds what decoders allocate, in bytes: pixels of four floats.
const MOST_BYTES: u64 = 16 * MOST_PIXELS;

/// Largest ratio of decoded bytes to file size that is believed: DEFLATE reaches 1032.
const MAX_COMPRESSION: u64 = 4096;

const FORMATS: &str = "PNG, JPEG, TGA, BMP, Radiance HDR, OpenEXR, PFM";

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// How the file encodes its values.
    pub encoding: Encoding,
    /// One channel in the file: all texels are grey.
    pub grey: bool,
    /// The file has an alpha channel, which is left out.
    pub alpha: bool,
    /// `width * height` colours, row by row from the top left. Values of float formats may be negative, infinite or NaN.
    pub texels: Vec<Rgb>,
}

/// How a file encodes its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Integers in the sRGB encoding (IEC 61966-2-1).
    Srgb,
    /// Linear floats.
    Linear,
}

/// Reads a picture as linear RGB (Rec. 709 primaries); `place` refers to it. As in Mitsuba, integers are taken as sRGB
/// whatever the file says, and alpha is left out without weighting.
///
/// # Errors
/// [`Error::Input`] with file, what was found and what is allowed; [`Error::Io`] where the file cannot be read.
pub fn load(path: &Path, place: &Place) -> Result<Picture> {
    load_as(path, place, false)
}

/// [`load`], but integers are only scaled to 0 … 1: for data that are no colours, such as normal maps (Mitsuba's `raw`).
///
/// # Errors
/// As [`load`].
pub fn load_raw(path: &Path, place: &Place) -> Result<Picture> {
    load_as(path, place, true)
}

fn load_as(path: &Path, place: &Place, raw: bool) -> Result<Picture> {
    let bytes = read(path)?;
    let tga = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga"));
    // Decoders of damaged data are other people's code.
    let decoded = catch_unwind(|| decode(&bytes, tga, raw)).unwrap_or_else(|_| Err("damaged picture".into()));
    decoded.map_err(|message| Error::input(Place::file(path), format!("{message} (wanted by {place})")))
}

type Decoded<T> = std::result::Result<T, String>;

/// By the first bytes; TGA has no mark of its own.
fn decode(bytes: &[u8], tga: bool, raw: bool) -> Decoded<Picture> {
    match bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => decode_exr(bytes),
        [b'P', b'F' | b'f', b'\n' | b'\r' | b' ' | b'\t', ..] => decode_pfm(bytes),
        [0x89, b'P', b'N', b'G', ..] => decode_other(bytes, ImageFormat::Png, raw),
        [0xff, 0xd8, 0xff, ..] => decode_other(bytes, ImageFormat::Jpeg, raw),
        [b'#', b'?', ..] => decode_other(bytes, ImageFormat::Hdr, raw),
        [b'B', b'M', ..] => decode_other(bytes, ImageFormat::Bmp, raw),
        _ if tga => decode_other(bytes, ImageFormat::Tga, raw),
        _ => Err(format!("not a picture of a known format; allowed: {FORMATS}")),
    }
}

/// Refuses sizes that are out of range or that the file is too short for.
fn check_size(width: u64, height: u64, bytes_per_pixel: u64, file_size: usize) -> Decoded<()> {
    let most = u64::from(LARGEST_SIDE);
    if !(1..=most).contains(&width) || !(1..=most).contains(&height) {
        return Err(format!("{width} × {height} pixels; allowed are 1 to {LARGEST_SIDE} each way"));
    }
    if width * height > MOST_PIXELS {
        return Err(format!("{width} × {height} pixels; allowed are {MOST_PIXELS}"));
    }
    if width * height * bytes_per_pixel > file_size as u64 * MAX_COMPRESSION {
        return Err(format!("declares {width} × {height} pixels in a file of {file_size} bytes"));
    }
    Ok(())
}

fn decode_other(bytes: &[u8], format: ImageFormat, raw: bool) -> Decoded<Picture> {
    let name = format!("{format:?}").to_uppercase();
    let damaged =
        |e: image::ImageError| format!("damaged {name} picture: {}", e.to_string().replace(char::is_control, " "));
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    check_size(width.into(), height.into(), decoder.color_type().bytes_per_pixel().into(), bytes.len())?;
    let image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    let color = image.color();
    let channels = usize::from(color.channel_count());
    let samples = image.as_bytes();
    let linear = |v: f64| if raw { v as f32 } else { srgb_to_linear(v) as f32 };
    let (encoding, texels) = match usize::from(color.bytes_per_pixel()) / channels {
        1 => {
            let table: Vec<f32> = (0..=255).map(|v| linear(f64::from(v) / 255.0)).collect();
            (Encoding::Srgb, texels(samples, channels, |v: &[u8; 1]| table[usize::from(v[0])]))
        }
        2 => {
            let table: Vec<f32> = (0..=65535).map(|v| linear(f64::from(v) / 65535.0)).collect();
            (Encoding::Srgb, texels(samples, channels, |&v| table[usize::from(u16::from_ne_bytes(v))]))
        }
        _ => (Encoding::Linear, texels(samples, channels, |&v| f32::from_ne_bytes(v))),
    };
    Ok(Picture { width, height, encoding, grey: channels < 3, alpha: color.has_alpha(), texels })
}

/// Pixels of `channels` samples of `N` bytes as colours; what follows three channels, or grey, is alpha.
fn texels<const N: usize>(samples: &[u8], channels: usize, value: impl Fn(&[u8; N]) -> f32) -> Vec<Rgb> {
    let color = |v: &[[u8; N]]| match v {
        [r, g, b, ..] => Rgb::new(value(r), value(g), value(b)),
        _ => Rgb::splat(value(&v[0])),
    };
    samples.as_chunks().0.chunks_exact(channels).map(color).collect()
}

/// The first part's R, G, B or Y. Colours of other primaries are converted, white points as they are (OpenEXR's own formula).
fn decode_exr(bytes: &[u8]) -> Decoded<Picture> {
    let image = openexr::decode(bytes)?;
    let part = image.layer_data.into_iter().next().ok_or("an image without parts")?;
    let (width, height) = (part.size.width() as u64, part.size.height() as u64);
    check_size(width, height, 4, bytes.len())?;
    let plane = |name: &str| -> Option<Vec<f32>> {
        let channel = part.channel_data.list.iter().find(|c| c.name.as_slice() == name.as_bytes())?;
        Some(match &channel.sample_data {
            FlatSamples::F16(v) => v.iter().map(|v| v.to_f32()).collect(),
            FlatSamples::F32(v) => v.clone(),
            FlatSamples::U32(v) => v.iter().map(|&v| v as f32).collect(),
        })
    };
    let (grey, texels) = match (plane("R"), plane("G"), plane("B"), plane("Y")) {
        (Some(r), Some(g), Some(b), _) => {
            let matrix = image.attributes.chromaticities.map_or(Ok(None), |c| to_rec709(&c))?;
            let convert = |c: Rgb| matrix.map_or(c, |m| (m * c.as_dvec3()).as_vec3());
            (false, (0..r.len()).map(|i| convert(Rgb::new(r[i], g[i], b[i]))).collect())
        }
        (None, None, None, Some(y)) => (true, y.into_iter().map(Rgb::splat).collect()),
        _ => {
            let names = part.channel_data.list.iter().map(|c| String::from_utf8_lossy(c.name.as_slice()).into_owned());
            let names = names.collect::<Vec<_>>().join(", ");
            return Err(format!("has the channels {}; wanted are R, G, B or Y", shorten(&names)));
        }
    };
    let alpha = plane("A").is_some();
    Ok(Picture { width: width as u32, height: height as u32, encoding: Encoding::Linear, grey, alpha, texels })
}

/// The matrix from RGB of the given primaries to Rec. 709; `None` where they are the same.
fn to_rec709(c: &Chromaticities) -> Decoded<Option<DMat3>> {
    let primaries = [c.red, c.green, c.blue, c.white].map(|p| [f64::from(p.x()), f64::from(p.y())]);
    const REC709: [[f64; 2]; 4] = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]];
    if primaries.iter().flatten().zip(REC709.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-4) {
        return Ok(None);
    }
    let matrix = to_xyz(REC709).inverse() * to_xyz(primaries);
    let sound = matrix.is_finite() && matrix.determinant() != 0.0;
    if sound { Ok(Some(matrix)) } else { Err(format!("impossible chromaticities {primaries:?}")) }
}

/// From linear RGB to CIE XYZ, for primaries and white given as x, y; Y of white is 1.
fn to_xyz(primaries: [[f64; 2]; 4]) -> DMat3 {
    let [r, g, b, white] = primaries.map(|[x, y]| DVec3::new(x, y, 1.0 - x - y));
    let columns = DMat3::from_cols(r, g, b);
    columns * DMat3::from_diagonal(columns.inverse() * (white / white.y))
}

/// Portable float map: `PF` (RGB) or `Pf` (grey), size, a scale whose sign is the byte order (negative: little endian),
/// and the rows from the bottom.
fn decode_pfm(bytes: &[u8]) -> Decoded<Picture> {
    let mut at = 0;
    let mut word = || {
        at += bytes[at..].iter().position(|b| !b.is_ascii_whitespace())?;
        let len = bytes[at..].iter().position(u8::is_ascii_whitespace)?;
        at += len;
        std::str::from_utf8(&bytes[at - len..at]).ok()
    };
    let header = [word(), word(), word(), word()];
    let size = [1, 2].map(|i| header[i].and_then(|w| w.parse::<u32>().ok()).unwrap_or(0));
    check_size(size[0].into(), size[1].into(), 4, bytes.len())?;
    let [width, height] = size.map(|v| v as usize);
    let scale = header[3].and_then(|w| w.parse::<f32>().ok()).filter(|v| v.is_finite());
    let scale = scale.ok_or("the PFM header has no proper scale")?;
    let channels = if header[0] == Some("PF") { 3 } else { 1 };
    // One blank ends the header.
    let data = &bytes[at + 1..];
    let wanted = 4 * channels * width * height;
    if data.len() < wanted {
        return Err(format!("the data ends too early: {} bytes of {wanted}", data.len()));
    }
    let value = |v: &[u8; 4]| if scale < 0.0 { f32::from_le_bytes(*v) } else { f32::from_be_bytes(*v) } * scale.abs();
    let rows = data[..wanted].chunks_exact(4 * channels * width).rev();
    let texels = rows.flat_map(|row| texels(row, channels, value)).collect();
    let [width, height] = size;
    Ok(Picture { width, height, encoding: Encoding::Linear, grey: channels == 1, alpha: false, texels })
}
