//! Axes with linear and logarithmic ticks, and the frames that they span.

use super::canvas::{Anchor, Canvas, INK, TEXT, text_width};
use crate::stats::number::superscript;
use plotters::prelude::RGBColor;

const GRID: RGBColor = RGBColor(214, 214, 214);
const MINOR_GRID: RGBColor = RGBColor(240, 240, 240);

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
