//! Drawing: a thin layer over plotters' SVG backend in fractions of a pixel, axes with logarithmic ticks, and pixels from
//! SVG with built-in fonts.

use super::number::superscript;
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
const GRID: RGBColor = RGBColor(214, 214, 214);
const MINOR_GRID: RGBColor = RGBColor(240, 240, 240);

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

/// How an axis maps values.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Scale {
    /// Logarithmic with ticks at powers of two.
    Octaves,
    /// Logarithmic with ticks at powers of ten and, on short axes, their multiples.
    Decades,
    /// Linear.
    Linear,
}

/// An axis: values `from..to` lie between the pixels `start` and `end`.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    pub scale: Scale,
    pub from: f64,
    pub to: f64,
    pub start: f64,
    pub end: f64,
}

/// A tick: its value and, for major ones, its label.
pub(super) struct Tick {
    pub value: f64,
    pub label: Option<String>,
}

impl Axis {
    /// Where a value lies; outside the axis its end.
    pub(super) fn at(&self, value: f64) -> f64 {
        let (low, high) = (self.start.min(self.end), self.start.max(self.end));
        self.beyond(value).clamp(low, high)
    }

    /// Where a value lies, even outside the axis. Values that a logarithm does not have lie far before its start.
    pub(super) fn beyond(&self, value: f64) -> f64 {
        let t = if self.scale == Scale::Linear {
            (value - self.from) / (self.to - self.from)
        } else if value > 0.0 {
            (value / self.from).ln() / (self.to / self.from).ln()
        } else {
            -1e3
        };
        self.start + t.clamp(-1e3, 1e3) * (self.end - self.start)
    }

    /// Ticks with as many labels as stand apart, beside one another on a horizontal axis, else above one another.
    pub(super) fn ticks(&self, horizontal: bool) -> Vec<Tick> {
        let most = ((self.end - self.start).abs() / if horizontal { 46.0 } else { 24.0 }).max(1.0);
        let ticks = match self.scale {
            Scale::Octaves => self.octaves(most),
            Scale::Decades => self.decades(most),
            Scale::Linear => self.steps(most),
        };
        // A tick at the very end may miss it by rounding.
        let slack = 1e-6 * (self.end - self.start).abs();
        let (low, high) = (self.start.min(self.end) - slack, self.start.max(self.end) + slack);
        let inside = |t: &Tick| (low..=high).contains(&self.beyond(t.value));
        let mut ticks: Vec<Tick> = ticks.into_iter().filter(inside).collect();
        let mut taken: Option<(f64, f64)> = None;
        for tick in &mut ticks {
            let Some(label) = &tick.label else { continue };
            let extent = if horizontal { text_width(label, TEXT - 1.0) + 8.0 } else { 16.0 };
            let at = self.at(tick.value);
            if taken.is_some_and(|(last, other)| (at - last).abs() < (extent + other) / 2.0) {
                tick.label = None;
            } else {
                taken = Some((at, extent));
            }
        }
        ticks
    }

    fn octaves(&self, most: f64) -> Vec<Tick> {
        let (low, high) = (self.from.log2().floor() as i32, self.to.log2().ceil() as i32);
        let step = (f64::from(high - low) / most).ceil().max(1.0) as i32;
        let label =
            |e: i32| if (0..=16).contains(&e) { (1u64 << e).to_string() } else { format!("2{}", superscript(e)) };
        let tick = |e: i32| Tick { value: 2f64.powi(e), label: (e.rem_euclid(step) == 0).then(|| label(e)) };
        (low..=high).map(tick).collect()
    }

    fn decades(&self, most: f64) -> Vec<Tick> {
        let (low, high) = (self.from.log10().floor() as i32, self.to.log10().ceil() as i32);
        let span = (self.to / self.from).log10();
        if span < 0.9 {
            // Half as many as fit: on a logarithm equal steps crowd towards the end.
            return self.steps(most / 2.0);
        }
        let step = (span / most).ceil().max(1.0) as i32;
        // Short axes need labels between the powers of ten.
        let labelled: &[i32] = if span < 3.2 && most >= 3.0 * span { &[1, 2, 5] } else { &[1] };
        let mut ticks = Vec::new();
        for e in low..=high {
            for m in 1..=9 {
                let major = labelled.contains(&m) && (m > 1 || e.rem_euclid(step) == 0);
                let value = f64::from(m) * 10f64.powi(e);
                ticks.push(Tick { value, label: major.then(|| power_label(m, e)) });
            }
        }
        ticks
    }

    fn steps(&self, most: f64) -> Vec<Tick> {
        let raw = (self.to - self.from) / most;
        let power = 10f64.powf(raw.log10().floor());
        let step = power * [1.0, 2.0, 5.0].into_iter().find(|m| m * power >= raw).unwrap_or(10.0);
        let decimals = (-(step.log10() + 1e-9).floor()).clamp(0.0, 12.0) as usize;
        let (low, high) = ((self.from / step).ceil() as i64, (self.to / step).floor() as i64);
        let tick = |i: i64| {
            let value = i as f64 * step;
            let plain = format!("{value:.decimals$}");
            let label = if value != 0.0 && !(1e-4..1e6).contains(&step) { format!("{value:.1e}") } else { plain };
            Tick { value, label: Some(label) }
        };
        (low..=high.min(low.saturating_add(100))).map(tick).collect()
    }
}

/// m·10ᵉ as a tick label.
fn power_label(m: i32, e: i32) -> String {
    match (e, m) {
        (0..=4, _) => format!("{m}{}", "0".repeat(e as usize)),
        (-4..=-1, _) => format!("0.{}{m}", "0".repeat((-e - 1) as usize)),
        (_, 1) => format!("10{}", superscript(e)),
        _ => format!("{m}·10{}", superscript(e)),
    }
}

/// A plot area: a frame with grid, ticks and axis labels.
pub(super) struct Frame {
    pub x: Axis,
    pub y: Axis,
}

impl Frame {
    /// Draws grid, frame, tick labels and the two axis labels.
    pub(super) fn draw(&self, canvas: &Canvas, x_label: &str, y_label: &str) {
        let (x_ticks, y_ticks) = (self.x.ticks(true), self.y.ticks(false));
        self.grid(canvas, &x_ticks, &y_ticks);
        self.label_x(canvas, &x_ticks, x_label);
        self.label_y(canvas, &y_ticks);
        let centre = (self.y.start + self.y.end) / 2.0;
        canvas.upward_text(y_label, (self.x.start - 52.0, centre), TEXT, INK);
    }

    /// The same without a vertical axis, for rows that have names.
    pub(super) fn draw_rows(&self, canvas: &Canvas, x_label: &str) {
        let ticks = self.x.ticks(true);
        self.grid(canvas, &ticks, &[]);
        self.label_x(canvas, &ticks, x_label);
    }

    /// A scale without grid, for colour bars.
    pub(super) fn draw_scale(&self, canvas: &Canvas, label: &str) {
        self.grid(canvas, &[], &[]);
        self.label_x(canvas, &self.x.ticks(true), label);
    }

    /// A panel among others: numbers only where it stands at the left or lower edge.
    pub(super) fn draw_panel(&self, canvas: &Canvas, leftmost: bool, lowest: bool) {
        let (x_ticks, y_ticks) = (self.x.ticks(true), self.y.ticks(false));
        self.grid(canvas, &x_ticks, &y_ticks);
        if lowest {
            self.label_x(canvas, &x_ticks, "");
        }
        if leftmost {
            self.label_y(canvas, &y_ticks);
        }
    }

    fn grid(&self, canvas: &Canvas, x_ticks: &[Tick], y_ticks: &[Tick]) {
        let (left, right, bottom, top) = (self.x.start, self.x.end, self.y.start, self.y.end);
        for labelled in [false, true] {
            let colour = if labelled { GRID } else { MINOR_GRID };
            for at in x_ticks.iter().filter(|t| t.label.is_some() == labelled).map(|t| self.x.at(t.value)) {
                canvas.line(&[(at, bottom), (at, top)], colour, 0.7);
            }
            for at in y_ticks.iter().filter(|t| t.label.is_some() == labelled).map(|t| self.y.at(t.value)) {
                canvas.line(&[(left, at), (right, at)], colour, 0.7);
            }
        }
        canvas.line(
            &[(left, top), (left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)],
            INK,
            0.9,
        );
    }

    fn label_x(&self, canvas: &Canvas, ticks: &[Tick], label: &str) {
        let bottom = self.y.start;
        for (at, text) in ticks.iter().filter_map(|t| Some((self.x.at(t.value), t.label.as_ref()?))) {
            canvas.line(&[(at, bottom), (at, bottom + 4.0)], INK, 0.9);
            canvas.text(text, (at, bottom + 14.0), Anchor::Centre, TEXT - 1.0, INK);
        }
        canvas.text(label, ((self.x.start + self.x.end) / 2.0, bottom + 36.0), Anchor::Centre, TEXT, INK);
    }

    fn label_y(&self, canvas: &Canvas, ticks: &[Tick]) {
        let left = self.x.start;
        for (at, text) in ticks.iter().filter_map(|t| Some((self.y.at(t.value), t.label.as_ref()?))) {
            canvas.line(&[(left - 4.0, at), (left, at)], INK, 0.9);
            canvas.text(text, (left - 8.0, at), Anchor::Right, TEXT - 1.0, INK);
        }
    }
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
