//! Drawing: a thin layer over plotters' SVG backend in fractions of a pixel, and pixels from SVG with built-in fonts.

use plotters::element::{DashedPathElement, PathElement, Polygon};
use plotters::prelude::{DrawingArea, IntoDrawingArea, IntoFont, RGBColor, SVGBackend, TextStyle, WHITE};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, ShapeStyle};
use resvg::{tiny_skia, usvg};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::sync::{Arc, OnceLock};

/// The backend has integer coordinates: one pixel is this many of its units.
const UNIT: f64 = 20.0;
/// Verdana is DejaVu Sans's near twin in width, for browsers without DejaVu.
const FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";
/// Size of ordinary text in pixels.
pub(super) const TEXT: f64 = 12.0;
/// Axes and text.
pub(super) const INK: RGBColor = RGBColor(34, 34, 34);
/// Secondary text and guides.
pub(super) const GREY: RGBColor = RGBColor(105, 105, 105);

/// Colours that stay apart for colour-blind readers (Okabe and Ito 2008, without yellow, which is faint on white).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Number of marker shapes.
const SHAPES: usize = 7;

/// The colour of the i-th strategy.
pub(super) fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// A drawing in progress. Coordinates are pixels from the top left.
pub(super) struct Canvas<'a>(Area<'a>);

/// Where text stands relative to its point.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Left,
    Right,
    Centre,
}

/// An SVG picture of so many pixels with a title, a text for readers who cannot see it, and what `draw` puts into it.
pub(super) fn svg((width, height): (f64, f64), title: &str, alt: &str, draw: impl FnOnce(&Canvas)) -> String {
    let mut text = String::new();
    let (units_x, units_y) = ((width * UNIT) as u32, (height * UNIT) as u32);
    {
        let area = SVGBackend::with_string(&mut text, (units_x, units_y)).into_drawing_area();
        // Drawing into a string cannot fail, here and below.
        let _ = area.fill(&WHITE);
        draw(&Canvas(area));
    }
    let body = text.split_once('>').map_or("", |p| p.1);
    let escape = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let (title, alt) = (escape(title), escape(alt));
    let mut out = String::new();
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {units_x} {units_y}\">\n<title>{title}</title>\n<desc>{alt}</desc>{body}"
    );
    out
}

fn units((x, y): (f64, f64)) -> (i32, i32) {
    // Saturating casts: points far outside the picture stay outside.
    ((x * UNIT).round() as i32, (y * UNIT).round() as i32)
}

impl Canvas<'_> {
    /// A line through points.
    pub(super) fn line(&self, points: &[(f64, f64)], colour: RGBColor, width: f64) {
        let style = ShapeStyle { color: colour.to_rgba(), filled: false, stroke_width: (width * UNIT) as u32 };
        let _ = self.0.draw(&PathElement::new(points.iter().copied().map(units).collect::<Vec<_>>(), style));
    }

    /// A line of dashes of `on` pixels with gaps of `off`.
    pub(super) fn dashes(&self, points: &[(f64, f64)], colour: RGBColor, width: f64, (on, off): (f64, f64)) {
        let style = ShapeStyle { color: colour.to_rgba(), filled: false, stroke_width: (width * UNIT) as u32 };
        let points: Vec<_> = points.iter().copied().map(units).collect();
        let (on, off) = ((on * UNIT) as u32, (off * UNIT) as u32);
        let _ = self.0.draw(&DashedPathElement::new(points, on, off, style));
    }

    /// A filled area.
    pub(super) fn fill(&self, points: &[(f64, f64)], colour: RGBColor, opacity: f64) {
        let _ = self.0.draw(&Polygon::new(points.iter().copied().map(units).collect::<Vec<_>>(), colour.mix(opacity)));
    }

    /// Horizontal text, vertically centred on `at`.
    pub(super) fn text(&self, text: &str, at: (f64, f64), anchor: Anchor, size: f64, colour: RGBColor) {
        self.write(text, at, anchor, size, colour, FontTransform::None);
    }

    /// Text that runs upwards, centred on `at`.
    pub(super) fn upward_text(&self, text: &str, at: (f64, f64), size: f64, colour: RGBColor) {
        self.write(text, at, Anchor::Centre, size, colour, FontTransform::Rotate270);
    }

    fn write(&self, text: &str, at: (f64, f64), anchor: Anchor, size: f64, colour: RGBColor, turn: FontTransform) {
        if text.is_empty() {
            return;
        }
        let horizontal = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Right => HPos::Right,
            Anchor::Centre => HPos::Center,
        };
        // The backend divides sizes by 1.24.
        let font = (FAMILY, size * UNIT * 1.24).into_font().transform(turn);
        let style = TextStyle::from(font).color(&colour).pos(Pos::new(horizontal, VPos::Center));
        let _ = self.0.draw_text(text, &style, units(at));
    }

    /// The i-th strategy's marker: seven shapes, filled for the first seven strategies, hollow for the next seven.
    pub(super) fn marker(&self, index: usize, at: (f64, f64)) {
        self.shape(index, at, (index / SHAPES) % 2 == 1);
    }

    /// The i-th strategy's shape, filled or hollow.
    pub(super) fn shape(&self, index: usize, (x, y): (f64, f64), hollow: bool) {
        let inside = if hollow { WHITE } else { colour(index) };
        let polygon = |n: usize, radius: f64, turn: f64| -> Vec<(f64, f64)> {
            let angle = |i: usize| TAU * (i as f64 / n as f64 + turn);
            (0..n).map(|i| (x + radius * angle(i).sin(), y - radius * angle(i).cos())).collect()
        };
        let points = match index % SHAPES {
            0 => polygon(24, 4.1, 0.0),
            1 => polygon(4, 5.2, 0.125),
            2 => polygon(3, 5.8, 0.0),
            3 => polygon(4, 5.4, 0.0),
            4 => polygon(3, 5.8, 0.5),
            5 => polygon(6, 4.8, 0.0),
            _ => {
                let (arm, half) = (5.4, 1.9);
                let corner = [(half, -arm), (half, -half), (arm, -half)];
                (0..4)
                    .flat_map(|q| {
                        corner.map(|(dx, dy)| match q {
                            0 => (x + dx, y + dy),
                            1 => (x - dy, y + dx),
                            2 => (x - dx, y - dy),
                            _ => (x + dy, y - dx),
                        })
                    })
                    .collect()
            }
        };
        self.fill(&points, inside, 1.0);
        let closed: Vec<_> = points.iter().chain(&points[..2]).copied().collect();
        self.line(&closed, colour(index), 1.4);
    }
}

/// Width of text in pixels, by classes of letters of DejaVu Sans.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let em = |c: char| match c {
        'i' | 'j' | 'l' | '\'' => 0.28,
        'f' | 't' | 'r' | 'I' | ' ' | '.' | ',' | ':' | ';' | '(' | ')' | '[' | ']' | '|' | '-' => 0.4,
        'm' | 'w' | 'M' | 'W' | '@' | '%' | '→' | '…' => 0.98,
        '⁰'..='⁹' | '¹' | '²' | '³' | '⁻' => 0.42,
        'A'..='Z' | '±' | '×' | '√' | '<' | '>' | '–' => 0.75,
        c if c.is_ascii() => 0.62,
        c if (c as u32) < 0x2e80 => 0.7,
        _ => 1.0,
    };
    text.chars().map(em).sum::<f64>() * size
}

/// Text cut with an ellipsis to fit a width in pixels.
pub(super) fn fit(text: &str, width: f64, size: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_owned();
    }
    let mut cut: String = text.to_owned();
    while !cut.is_empty() && text_width(&cut, size) + 0.98 * size > width {
        cut.pop();
    }
    format!("{}…", cut.trim_end())
}

/// The part of a polygon between two heights (Sutherland and Hodgman 1974).
pub(super) fn clip(points: &[(f64, f64)], top: f64, bottom: f64) -> Vec<(f64, f64)> {
    let cut = |points: &[(f64, f64)], edge: f64, inside: &dyn Fn(f64) -> bool| {
        let mut out = Vec::new();
        for (i, &(x, y)) in points.iter().enumerate() {
            let (px, py) = points[(i + points.len() - 1) % points.len()];
            if inside(y) != inside(py) {
                out.push((px + (x - px) * (edge - py) / (y - py), edge));
            }
            if inside(y) {
                out.push((x, y));
            }
        }
        out
    };
    let below_top = cut(points, top, &|y| y >= top);
    cut(&below_top, bottom, &|y| y <= bottom)
}

/// Pixels: width, height and RGB bytes, row by row.
pub(super) struct Pixels {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<u8>,
}

/// Renders an SVG of ours at so many pixels per pixel. Fonts are the built-in ones only, whatever the machine has.
pub(super) fn rasterise(svg: &str, scale: f32) -> Pixels {
    static FONTS: OnceLock<Arc<usvg::fontdb::Database>> = OnceLock::new();
    let fonts = FONTS.get_or_init(|| {
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(dejavu::sans::regular().to_vec());
        fonts.set_sans_serif_family("DejaVu Sans");
        fonts.set_serif_family("DejaVu Sans");
        Arc::new(fonts)
    });
    let options = usvg::Options { fontdb: fonts.clone(), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).expect("an SVG that we made");
    let (width, height) = ((tree.size().width() * scale).ceil() as u32, (tree.size().height() * scale).ceil() as u32);
    let mut pixmap = tiny_skia::Pixmap::new(width, height).expect("a figure of moderate size");
    pixmap.fill(tiny_skia::Color::WHITE);
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    let rgb = pixmap.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    Pixels { width: width as usize, height: height as usize, rgb }
}

/// A PNG file.
pub(super) fn png(pixels: &Pixels) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, pixels.width as u32, pixels.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().expect("written to memory");
    writer.write_image_data(&pixels.rgb).expect("as many bytes as the header says");
    writer.finish().expect("written to memory");
    bytes
}
