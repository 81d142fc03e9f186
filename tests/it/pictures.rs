//! Pictures of every format: values against hand-computed ones, and damaged files.

use crate::support;
use image::{DynamicImage, GrayAlphaImage, GrayImage, ImageFormat, Luma, Rgb32FImage, RgbImage, RgbaImage};
use rootn::Error;
use rootn::error::Place;
use rootn::math::Rgb;
use rootn::scene::format::picture::{Encoding, Picture, load, load_raw};
use std::io::Cursor;
use std::path::Path;
use std::time::{Duration, Instant};

/// 188/255 and 10/255 as linear values.
const BRIGHT: f32 = 0.502_886_5;
const DARK: f32 = 0.003_035_27;

fn encode(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    image.write_to(&mut Cursor::new(&mut bytes), format).unwrap();
    bytes
}

fn read(bytes: &[u8], name: &str, raw: bool) -> rootn::Result<Picture> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let place = Place::line("scene.xml", 7);
    if raw { load_raw(&path, &place) } else { load(&path, &place) }
}

#[track_caller]
fn near(found: Rgb, wanted: Rgb) {
    assert!((found - wanted).abs().max_element() <= 1e-6 * wanted.max_element(), "{found} {wanted}");
}

/// Red, green, blue and a mixture: two rows.
fn colours() -> RgbImage {
    RgbImage::from_raw(2, 2, vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 188, 10, 0]).unwrap()
}

#[test]
fn integers_are_srgb() {
    let opaque = DynamicImage::ImageRgb8(colours());
    let clear = DynamicImage::ImageRgba8(RgbaImage::from_fn(2, 2, |x, y| {
        let [r, g, b] = colours().get_pixel(x, y).0;
        image::Rgba([r, g, b, 0])
    }));
    for (image, format, name) in [
        (&opaque, ImageFormat::Png, "a"),
        (&clear, ImageFormat::Png, "a"),
        (&opaque, ImageFormat::Bmp, "a"),
        (&opaque, ImageFormat::Tga, "a.tga"),
        (&clear, ImageFormat::Tga, "a.TGA"),
    ] {
        let bytes = encode(image, format);
        let picture = read(&bytes, name, false).unwrap();
        assert_eq!((picture.width, picture.height, picture.grey), (2, 2, false));
        assert_eq!((picture.encoding, picture.alpha), (Encoding::Srgb, image.color().has_alpha()), "{format:?}");
        assert_eq!(picture.texels[..3], [Rgb::X, Rgb::Y, Rgb::Z], "{format:?}");
        near(picture.texels[3], Rgb::new(BRIGHT, DARK, 0.0));
        let raw = read(&bytes, name, true).unwrap();
        near(raw.texels[3], Rgb::new(188.0 / 255.0, 10.0 / 255.0, 0.0));
    }
}

#[test]
fn grey_and_sixteen_bits() {
    let grey = DynamicImage::ImageLuma8(GrayImage::from_pixel(3, 1, Luma([188])));
    let alpha = DynamicImage::ImageLumaA8(GrayAlphaImage::from_pixel(3, 1, image::LumaA([188, 9])));
    let deep = DynamicImage::ImageLuma16(image::ImageBuffer::from_pixel(3, 1, Luma([188 * 257])));
    for image in [grey, alpha, deep] {
        let picture = read(&encode(&image, ImageFormat::Png), "a.png", false).unwrap();
        assert_eq!((picture.width, picture.height, picture.grey), (3, 1, true));
        assert_eq!(picture.alpha, image.color().has_alpha());
        near(picture.texels[2], Rgb::splat(BRIGHT));
    }
    let jpeg = encode(&DynamicImage::ImageRgb8(RgbImage::from_pixel(8, 8, image::Rgb([188; 3]))), ImageFormat::Jpeg);
    let picture = read(&jpeg, "a.jpg", false).unwrap();
    assert_eq!((picture.width, picture.grey, picture.encoding), (8, false, Encoding::Srgb));
    assert!((picture.texels[9] - Rgb::splat(BRIGHT)).abs().max_element() < 0.01, "{}", picture.texels[9]);
}

#[test]
fn floats_are_linear() {
    let image = DynamicImage::ImageRgb32F(Rgb32FImage::from_fn(2, 1, |x, _| image::Rgb([0.5, 2.0, x as f32 * 64.0])));
    let picture = read(&encode(&image, ImageFormat::Hdr), "a.hdr", false).unwrap();
    assert_eq!((picture.encoding, picture.grey, picture.alpha), (Encoding::Linear, false, false));
    assert_eq!(picture.texels[0], Rgb::new(0.5, 2.0, 0.0));
    assert!((picture.texels[1] - Rgb::new(0.5, 2.0, 64.0)).abs().max_element() <= 0.5, "{}", picture.texels[1]);
    for (scale, order) in [("-2", f32::to_le_bytes as fn(f32) -> [u8; 4]), ("2.0", f32::to_be_bytes)] {
        let numbers = |n: std::ops::Range<u32>| n.flat_map(|v| order(v as f32)).collect::<Vec<u8>>();
        let colour = [format!("PF\n2 2\n{scale}\n").as_bytes(), &numbers(0..12)].concat();
        let picture = read(&colour, "a.pfm", false).unwrap();
        // The rows start at the bottom.
        let wanted = [[12.0, 14.0, 16.0], [18.0, 20.0, 22.0], [0.0, 2.0, 4.0], [6.0, 8.0, 10.0]].map(Rgb::from_array);
        assert_eq!(picture.texels, wanted);
        let grey = [format!("Pf 2 1 {scale}\n").as_bytes(), &numbers(3..5)].concat();
        let picture = read(&grey, "a.pfm", true).unwrap();
        assert_eq!((picture.grey, picture.texels), (true, vec![Rgb::splat(6.0), Rgb::splat(8.0)]));
    }
}

#[test]
fn broken_pictures_are_refused() {
    let png = encode(&DynamicImage::ImageRgb8(colours()), ImageFormat::Png);
    let mut huge = png.clone();
    huge[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    let mut large = png.clone();
    large[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x20, 0]);
    for bytes in [&mut huge, &mut large] {
        let crc = crc32(&bytes[12..29]).to_be_bytes();
        bytes[29..33].copy_from_slice(&crc);
    }
    let cases: [(&[u8], &str, &str); 14] = [
        (b"", "a.png", "allowed: PNG, JPEG"),
        (b"GIF89a", "a.gif", "allowed: PNG, JPEG"),
        (&png[..30], "a.png", "damaged PNG"),
        (&huge, "a.png", "65536 × 65536 pixels; allowed are 1 to 16384"),
        (&large, "a.png", "declares 16384 × 8192 pixels in a file of"),
        (b"PF 16384 16384 -1\n", "a.pfm", "16384 × 16384 pixels; allowed are 134217728"),
        (b"\xff\xd8\xff", "a.jpg", "damaged JPEG"),
        (b"#?RADIANCE\n", "a.hdr", "damaged HDR"),
        (b"BM", "a.bmp", "damaged BMP"),
        (b"", "a.tga", "damaged TGA"),
        (b"\x76\x2f\x31\x01", "a.exr", "EXR"),
        (b"PF 2 2 -1\n1234", "a.pfm", "the data ends too early: 4 bytes of 48"),
        (b"PF 0 2 -1\n", "a.pfm", "0 × 2 pixels"),
        (b"PF 1 1 x\n", "a.pfm", "scale"),
    ];
    for (bytes, name, part) in cases {
        let error = read(bytes, name, false).unwrap_err();
        let Error::Input { place, .. } = &error else { panic!("{error}") };
        assert!(place.file.ends_with(name), "{error}");
        let text = error.to_string();
        assert!(text.contains(part) && text.contains("scene.xml:7") && !text.contains('\n'), "{text}");
    }
}

/// CRC-32 of ISO 3309, as PNG uses it.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
    !bytes.iter().fold(!0, |crc, &b| (0..8).fold(crc ^ u32::from(b), step))
}

#[test]
fn mutated_pictures_never_panic() {
    let image = DynamicImage::ImageRgb8(RgbImage::from_fn(17, 9, |x, y| image::Rgb([x as u8 * 9, y as u8 * 20, 77])));
    let float = DynamicImage::ImageRgb32F(image.to_rgb32f());
    let pfm = [b"PF\n3 2\n-1.0\n".as_slice(), &[7; 72]].concat();
    let originals = [
        (encode(&image, ImageFormat::Png), "a.png"),
        (encode(&image, ImageFormat::Jpeg), "a.jpg"),
        (encode(&image, ImageFormat::Tga), "a.tga"),
        (encode(&image, ImageFormat::Bmp), "a.bmp"),
        (encode(&float, ImageFormat::Hdr), "a.hdr"),
        (pfm, "a.pfm"),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (original, name) in originals {
        for bytes in support::mutations(&original, support::seed(name)).take(400) {
            let path = folder.path().join(name);
            std::fs::write(&path, &bytes).unwrap();
            bounded(&path);
        }
    }
}

/// Reads or refuses in order and in time; whether it was read.
fn bounded(path: &Path) -> bool {
    let start = Instant::now();
    let result = load(path, &Place::default());
    assert!(start.elapsed() < Duration::from_secs(2), "{:?} for {}", start.elapsed(), path.display());
    match result {
        Ok(picture) => {
            assert_eq!(picture.texels.len() as u64, u64::from(picture.width) * u64::from(picture.height));
            true
        }
        Err(error) => {
            assert!(matches!(error, Error::Input { .. }) && !error.to_string().contains("damaged picture"), "{error}");
            false
        }
    }
}

#[test]
fn foreign_exr_pictures_are_read_or_refused() {
    let (Some(damaged), Some(odd)) =
        (support::shared("scenes/openexr-damaged/Damaged"), support::shared("scenes/openexr-odd/TestImages"))
    else {
        return;
    };
    let files = [damaged, odd.clone()].into_iter().flat_map(|f| std::fs::read_dir(f).unwrap());
    let files: Vec<_> = files.map(|f| f.unwrap().path()).collect();
    let read = files.iter().filter(|f| bounded(f)).count();
    println!("{read} of {} read", files.len());
    assert!(files.len() > 60 && read > 5 && read < files.len());
    // A file that names its primaries: white stays white but for the white point, here the same.
    let wide = load(&odd.join("WideColorGamut.exr"), &Place::default()).unwrap();
    assert!(wide.texels.iter().any(|c| c.min_element() < -0.1), "no colour out of the gamut of Rec. 709");
}

#[test]
fn foreign_pictures_are_read() {
    let Some(folder) = support::shared("scenes/mitsuba-tests/common/textures") else { return };
    for (name, width, height, grey, alpha) in [
        ("carrot.png", 10, 9, false, true),
        ("gradient.jpg", 16, 16, false, false),
        ("flower.bmp", 100, 67, false, false),
        ("leaf_mask.png", 239, 241, true, true),
        ("noise_8x8.png", 8, 8, false, false),
        ("museum.exr", 512, 256, false, false),
    ] {
        let p = load(&folder.join(name), &Place::default()).unwrap();
        assert_eq!((p.width, p.height, p.grey, p.alpha), (width, height, grey, alpha), "{name}");
        assert_eq!(p.encoding == Encoding::Linear, name.ends_with("exr"));
    }
}
