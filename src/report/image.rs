//! Pictures of fields: maps of the sample variance in false colour and tone-mapped means, all panels of a scene on a
//! common scale, pixels shown as they are (enlarged by whole factors, or averaged down by whole factors).

use super::axis::{Axis, Frame, Scale};
use super::canvas::{Anchor, Canvas, GREY, INK, Pixels, TEXT, fit, png, rasterise, svg};
use super::{Figure, plain};
use crate::error::Result;
use crate::record::image::{Layers, read_exr};
use crate::record::{Dependence, SceneResult, StrategyResult};
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use std::path::Path;

/// Pixels of PNG per pixel of layout.
const SCALE: usize = 2;
/// Size that panels come near to, in pixels of PNG.
const PANEL: (usize, usize) = (440, 560);
/// Width of the whole figure, in pixels of layout.
const WIDTH: f64 = 960.0;
const GAP: f64 = 14.0;
const HEAD: f64 = 24.0;
/// Colour of values that are not numbers.
const NOT_A_NUMBER: [u8; 3] = [255, 0, 255];

/// A named picture of one field.
struct Panel {
    name: String,
    image: Image,
    /// Pixels of the field per pixel of `image`, along each axis.
    step: usize,
}

/// A field of 1 or 3 channels, interleaved.
struct Image {
    width: usize,
    height: usize,
    channels: usize,
    values: Vec<f32>,
}

/// Maps and pictures of a scene; none where strategies have no images.
pub(super) fn figures(scene: &SceneResult, folder: &Path, stem: &str) -> Result<Vec<Figure>> {
    let read = |name: &Option<String>| name.as_ref().map(|n| read_exr(&folder.join(n))).transpose();
    let (mut variances, mut shares, mut pictures) = (Vec::new(), Vec::new(), Vec::new());
    if let Some(layers) = read(&scene.reference.image)? {
        pictures.extend(panel("reference", &layers, ""));
    }
    for strategy in &scene.strategies {
        if let Some(layers) = read(&strategy.image)? {
            variances.extend(panel(&plain(&strategy.name), &layers, VARIANCE.layer));
            shares.extend(panel(&plain(&strategy.name), &layers, LARGEST_SHARE.layer));
            pictures.extend(panel(&plain(&strategy.name), &layers, ""));
        }
    }
    let mut figures = Vec::new();
    figures.extend(maps(&VARIANCE, &variances, scene, stem));
    figures.extend(maps(&LARGEST_SHARE, &shares, scene, stem));
    // The reference alone says nothing about strategies.
    if pictures.len() > usize::from(scene.reference.image.is_some()) {
        figures.extend(tone_mapped(&pictures, scene, stem));
    }
    Ok(figures)
}

/// A layer of an image, brought to the size of a panel.
fn panel(name: &str, layers: &Layers, layer: &str) -> Option<Panel> {
    let (channels, values) = layers.layer(layer)?;
    let (width, height) = (layers.width, layers.height);
    let step = width.div_ceil(PANEL.0 * 3 / 2).max(height.div_ceil(PANEL.1 * 3 / 2)).max(1);
    let image = Image { width, height, channels, values };
    Some(Panel { name: name.to_owned(), image: if step > 1 { image.shrunk(step) } else { image }, step })
}

impl Image {
    /// Averages over squares of `step` pixels; an incomplete edge averages what it has.
    fn shrunk(&self, step: usize) -> Self {
        let (width, height) = (self.width.div_ceil(step), self.height.div_ceil(step));
        let mut values = Vec::with_capacity(width * height * self.channels);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let rows = y * step..((y + 1) * step).min(self.height);
            let columns = x * step..((x + 1) * step).min(self.width);
            let count = (rows.len() * columns.len()) as f64;
            for c in 0..self.channels {
                let at = |i: usize, j: usize| f64::from(self.values[(i * self.width + j) * self.channels + c]);
                let sum: f64 = rows.clone().map(|i| columns.clone().map(|j| at(i, j)).sum::<f64>()).sum();
                values.push((sum / count) as f32);
            }
        }
        Self { width, height, channels: self.channels, values }
    }

    /// Per pixel the mean over channels.
    fn grey(&self) -> impl Iterator<Item = f64> {
        let n = self.channels as f64;
        self.values.chunks_exact(self.channels).map(move |p| p.iter().map(|&v| f64::from(v)).sum::<f64>() / n)
    }
}

/// Panels in rows, as a layout and as pixels.
struct Sheet<'a> {
    panels: &'a [Panel],
    columns: usize,
    /// Pixels of PNG per pixel of field.
    factor: usize,
    /// Size of a cell of the layout.
    cell: (f64, f64),
    /// Height below the panels.
    foot: f64,
}

impl<'a> Sheet<'a> {
    fn new(panels: &'a [Panel], foot: f64) -> Self {
        let width = panels.iter().map(|p| p.image.width).max().unwrap_or(1).max(1);
        let height = panels.iter().map(|p| p.image.height).max().unwrap_or(1).max(1);
        let factor = (PANEL.0 / width).min(PANEL.1 / height).max(1);
        let size = |n: usize| (n * factor).div_ceil(SCALE) as f64;
        let cell = (size(width).max(90.0) + GAP, size(height) + HEAD + GAP);
        let columns = (((WIDTH - GAP) / cell.0) as usize).clamp(1, panels.len().max(1));
        Self { panels, columns, factor, cell, foot }
    }

    fn size(&self) -> (f64, f64) {
        let rows = self.panels.len().div_ceil(self.columns);
        ((GAP + self.columns as f64 * self.cell.0).max(400.0), GAP / 2.0 + rows as f64 * self.cell.1 + self.foot)
    }

    /// Top left corner of the i-th picture, in whole pixels of layout.
    fn origin(&self, i: usize) -> (f64, f64) {
        let (column, row) = (i % self.columns, i / self.columns);
        (GAP + column as f64 * self.cell.0, GAP / 2.0 + HEAD + row as f64 * self.cell.1)
    }

    /// Draws names, frames and foot as vectors, then puts the pixels in, exactly.
    fn render(
        &self,
        title: &str,
        foot: impl FnOnce(&Canvas, f64),
        pixel: impl Fn(&Panel, usize) -> [u8; 3],
    ) -> Vec<u8> {
        let size = self.size();
        let drawing = svg(size, title, "", |canvas| {
            for (i, panel) in self.panels.iter().enumerate() {
                let (x, y) = self.origin(i);
                let name = fit(&panel.name, self.cell.0 - GAP, TEXT);
                canvas.text(&name, (x, y - 11.0), Anchor::Left, TEXT, INK);
                let (w, h) = (panel.image.width * self.factor, panel.image.height * self.factor);
                let (w, h) = (w as f64 / SCALE as f64, h as f64 / SCALE as f64);
                let (l, t, r, b) = (x - 0.5, y - 0.5, x + w + 0.5, y + h + 0.5);
                canvas.line(&[(l, t), (r, t), (r, b), (l, b), (l, t), (r, t)], GREY, 1.0);
            }
            foot(canvas, size.1 - self.foot);
        });
        let mut sheet = rasterise(&drawing, SCALE as f32);
        for (i, panel) in self.panels.iter().enumerate() {
            let (x, y) = self.origin(i);
            self.paste(&mut sheet, panel, (x as usize * SCALE, y as usize * SCALE), &pixel);
        }
        png(&sheet)
    }

    /// Nearest-neighbour enlargement by a whole factor.
    fn paste(
        &self,
        sheet: &mut Pixels,
        panel: &Panel,
        (x, y): (usize, usize),
        pixel: impl Fn(&Panel, usize) -> [u8; 3],
    ) {
        let Image { width, height, .. } = panel.image;
        let colours: Vec<_> = (0..width * height).map(|i| pixel(panel, i)).collect();
        for (row, column) in (0..height * self.factor).flat_map(|r| (0..width * self.factor).map(move |c| (r, c))) {
            let at = 3 * ((y + row) * sheet.width + x + column);
            let colour = colours[row / self.factor * width + column / self.factor];
            if let Some(target) = sheet.rgb.get_mut(at..at + 3) {
                target.copy_from_slice(&colour);
            }
        }
    }

    /// How panels relate to pixels, in words.
    fn sampling(&self) -> String {
        match self.panels.iter().map(|p| p.step).max() {
            None | Some(1) => format!("One pixel of the image is {0} × {0} pixels here.", self.factor),
            Some(step) => format!("Averaged over {step} × {step} pixels to fit."),
        }
    }
}

/// A layer that is shown as maps on a common logarithmic scale.
struct Mapped {
    layer: &'static str,
    suffix: &'static str,
    heading: &'static str,
    title: &'static str,
    unit: &'static str,
    caption: &'static str,
    /// Whether it speaks of single samples, so that it does not show what their arrangement gains.
    of_samples: bool,
}

const VARIANCE: Mapped = Mapped {
    layer: "sample_variance",
    suffix: "variance",
    heading: "Maps of the sample variance",
    title: "Sample variance",
    unit: "sample variance (radiance²)",
    caption: "Variance of one sample, mean over channels, on one logarithmic scale for all strategies. Where a map is darker, \
              that strategy's samples agree better.",
    of_samples: true,
};

const LARGEST_SHARE: Mapped = Mapped {
    layer: "largest_share",
    suffix: "health",
    heading: "Where few samples make the variance",
    title: "Share of the largest sample",
    unit: "share of the largest sample in a pixel's variance",
    caption: "Share of a pixel's largest sample, of all replicates, in its sum of squared deviations, mean over channels. \
              Where a map is bright, rare large samples make the variance, and larger ones may still come: what is said of \
              such pixels rests on few samples.",
    of_samples: false,
};

/// A layer on a common logarithmic scale.
fn maps(what: &Mapped, panels: &[Panel], scene: &SceneResult, stem: &str) -> Option<Figure> {
    let greys: Vec<Vec<f64>> = panels.iter().map(|p| p.image.grey().collect()).collect();
    let mut positive: Vec<f64> = greys.iter().flatten().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
    positive.sort_by(f64::total_cmp);
    let quantile = |q: f64| positive.get(((positive.len().max(1) - 1) as f64 * q) as usize).copied();
    let (mut from, mut to) = (quantile(0.01)?, quantile(0.999)?);
    if to < from * 2.0 {
        (from, to) = (from / 2.0, to * 2.0);
    }
    let sheet = Sheet::new(panels, 66.0);
    let title = format!("{} on {}", what.title, plain(&scene.name));
    let colour = |v: f64| {
        if v.is_nan() {
            NOT_A_NUMBER
        } else if v <= 0.0 {
            [0; 3]
        } else {
            viridis((v / from).ln() / (to / from).ln())
        }
    };
    let index = |panel: &Panel| panels.iter().position(|p| std::ptr::eq(p, panel)).unwrap_or(0);
    let bar = |canvas: &Canvas, top: f64| colour_bar(canvas, top + 4.0, (from, to), what.unit);
    let png = sheet.render(&title, bar, |panel, i| colour(greys[index(panel)][i]));
    let of_dependent = |s: &&StrategyResult| what.of_samples && s.dependence != Dependence::Independent;
    let dependent: Vec<String> = scene.strategies.iter().filter(of_dependent).map(|s| plain(&s.name)).collect();
    let not_theirs = match dependent.is_empty() {
        true => String::new(),
        false => format!(
            " What the even spread of the points of {} gains is not in it: that shows in the variance of means only.",
            dependent.join(", ")
        ),
    };
    let caption = format!(
        "{}{not_theirs} The ends of the bar are the 1 % and 99.9 % quantiles; beyond them the end colours go on. Black: no \
         variance at all; magenta: not a number. {}",
        what.caption,
        sheet.sampling()
    );
    let median = |values: &[f64]| {
        let mut values: Vec<f64> = values.to_vec();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let medians = panels
        .iter()
        .zip(&greys)
        .map(|(p, g)| format!("{} {}", p.name, crate::stats::number::significant(median(g), 2)));
    let alt = format!("{title}. Medians: {}.", medians.collect::<Vec<_>>().join(", "));
    let (stem, heading) = (format!("{stem}-{}", what.suffix), what.heading.to_owned());
    Some(Figure { stem, title: heading, caption, alt, notes: vec![], svg: None, png })
}

/// The colour of a position in 0..1; outside the end colours.
fn viridis(t: f64) -> [u8; 3] {
    let colour = ViridisRGB.get_color(t.clamp(0.0, 1.0));
    [colour.0, colour.1, colour.2]
}

/// A logarithmic colour bar with ticks.
fn colour_bar(canvas: &Canvas, top: f64, (from, to): (f64, f64), label: &str) {
    const LEFT: f64 = GAP;
    const LENGTH: f64 = 340.0;
    const STEPS: usize = 170;
    let (step, bottom) = (LENGTH / STEPS as f64, top + 12.0);
    for i in 0..STEPS {
        let [r, g, b] = viridis(i as f64 / (STEPS - 1) as f64);
        let (l, r_edge) = (LEFT + i as f64 * step, LEFT + (i + 1) as f64 * step);
        let colour = plotters::style::RGBColor(r, g, b);
        canvas.fill(&[(l, top), (r_edge, top), (r_edge, bottom), (l, bottom)], colour, 1.0);
    }
    let x = Axis { scale: Scale::Decades, from, to, start: LEFT, end: LEFT + LENGTH };
    let y = Axis { scale: Scale::Linear, from: 0.0, to: 1.0, start: bottom, end: top };
    Frame { x, y }.draw_scale(canvas, label);
}

/// The means as pictures: one exposure for all, sRGB.
fn tone_mapped(panels: &[Panel], scene: &SceneResult, stem: &str) -> Option<Figure> {
    let first = panels.first()?;
    let stops = stops(&first.image.values);
    let exposure = stops.exp2();
    let sheet = Sheet::new(panels, 8.0);
    let pixel = |panel: &Panel, i: usize| {
        let channels = panel.image.channels;
        let value = |c: usize| panel.image.values[i * channels + c.min(channels - 1)];
        let rgb = [value(0), value(1), value(2)];
        if rgb.iter().any(|v| v.is_nan()) { NOT_A_NUMBER } else { rgb.map(|v| srgb(v * exposure)) }
    };
    let title = format!("Final images on {}", plain(&scene.name));
    let png = sheet.render(&title, |_, _| {}, pixel);
    let exposed = if stops == 0.0 { "no exposure".to_owned() } else { format!("{stops:+} stops") };
    let caption = format!(
        "Means over all replicates beside the reference; sRGB, {exposed} for all, values above white cut for display only. \
         They should look alike: what differs beyond noise is bias. {}",
        sheet.sampling()
    );
    let names = panels.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
    let alt = format!("{title}: {names}.");
    Some(Figure {
        stem: format!("{stem}-images"),
        title: "Final images".into(),
        caption,
        alt,
        notes: vec![],
        svg: None,
        png,
    })
}

/// The means of an image as PNG: sRGB, exposed in whole stops so that nine tenths of the values come to lie below 0.8, values
/// above white cut. `rgb`: three values per pixel.
pub fn picture(width: usize, height: usize, rgb: &[f32]) -> Vec<u8> {
    let exposure = stops(rgb).exp2();
    let bytes = rgb.iter().map(|v| srgb(v * exposure)).collect();
    png(&Pixels { width, height, rgb: bytes })
}

/// See [`picture`].
fn stops(values: &[f32]) -> f32 {
    let mut bright: Vec<f32> = values.iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
    bright.sort_by(f32::total_cmp);
    let high = bright.get(bright.len() * 9 / 10).copied().unwrap_or(1.0);
    // Whole stops, so that the exposure is easily said.
    (0.8 / high).log2().round().clamp(-60.0, 60.0)
}

/// The sRGB transfer function (IEC 61966-2-1), to a byte.
fn srgb(linear: f32) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let encoded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_averages_whole_and_cut_squares() {
        let image = Image { width: 3, height: 2, channels: 1, values: vec![1.0, 2.0, 5.0, 3.0, 4.0, 7.0] };
        let small = image.shrunk(2);
        assert_eq!((small.width, small.height, small.values), (2, 1, vec![2.5, 6.0]));
    }

    /// IEC 61966-2-1: black, white, the linear part, and mid grey.
    #[test]
    fn transfer_function() {
        assert_eq!([0.0, 0.002, 0.214_041_14, 1.0, 7.0, -1.0].map(srgb), [0, 7, 128, 255, 255, 0]);
    }
}
