//! Error against N and against time, as SVG and PNG; what all plots of a scene share.

use super::axis::{Axis, Frame, Scale};
use super::canvas::{Anchor, Canvas, GREY, INK, TEXT, clip, colour, fit, png, rasterise, svg, text_width};
use super::{Figure, Headline, cost, plain, probe};
use crate::record::{Dependence, Interval, Record, SceneResult, StrategyResult};
use crate::stats::number::{percent, significant};
use std::collections::BTreeMap;

/// Pixels of PNG per pixel of SVG.
pub(super) const PNG_SCALE: f32 = 2.0;

/// What every plot of a scene needs.
pub(super) struct Context<'a> {
    pub scene: &'a SceneResult,
    pub headline: Headline,
    /// Colour and marker of each strategy: by first appearance in the record, the same in every scene.
    styles: BTreeMap<&'a str, usize>,
    stem: &'a str,
}

/// All curves of a scene. Plots without any point are left out.
pub(super) fn figures(record: &Record, scene: &SceneResult, stem: &str) -> Vec<Figure> {
    let mut styles = BTreeMap::new();
    for strategy in record.scenes.iter().flat_map(|s| &s.strategies) {
        let next = styles.len();
        styles.entry(strategy.name.as_str()).or_insert(next);
    }
    let context = Context { scene, headline: Headline::of(record), styles, stem };
    let mut figures: Vec<Figure> =
        [error_by_spp(&context), error_by_seconds(&context), cost::figure(&context)].into_iter().flatten().collect();
    figures.extend(probe::figures(&context));
    figures
}

impl Context<'_> {
    /// Index of a strategy's colour and marker.
    pub(super) fn style(&self, name: &str) -> usize {
        self.styles.get(name).copied().unwrap_or(0)
    }

    /// A figure from its SVG.
    pub(super) fn figure(
        &self,
        suffix: &str,
        title: String,
        caption: String,
        alt: String,
        notes: Vec<String>,
        svg: String,
    ) -> Figure {
        let png = png(&rasterise(&svg, PNG_SCALE));
        Figure { stem: format!("{}-{suffix}", self.stem), title, caption, alt, notes, svg: Some(svg), png }
    }

    /// The confidence of intervals, "95 %".
    pub(super) fn confidence(&self) -> String {
        let points = self.scene.strategies.iter().flat_map(|s| &s.checkpoints);
        percent(points.flat_map(|c| c.metrics.first()).map(|m| m.mean.confidence).next().unwrap_or(0.95))
    }

    /// Label of an axis of N.
    pub(super) fn abscissa(&self) -> String {
        match self.scene.abscissa.as_str() {
            "spp" => "N (samples per pixel)".to_owned(),
            other => format!("N ({})", plain(other)),
        }
    }
}

/// One strategy's line.
struct Curve {
    name: String,
    style: usize,
    /// Abscissa and error, both positive and finite.
    points: Vec<(f64, Interval)>,
    /// Indices of points with a checkpoint missing before them: lines and bands stop there.
    gaps: Vec<usize>,
    /// Abscissa and predicted error.
    predicted: Vec<(f64, f64)>,
    /// Abscissae at which the corrected error is not positive.
    below: Vec<f64>,
}

impl Curve {
    /// The points in runs without gaps.
    fn runs(&self) -> Vec<&[(f64, Interval)]> {
        let ends = self.gaps.iter().copied().chain([self.points.len()]);
        let mut start = 0;
        ends.map(|end| &self.points[std::mem::replace(&mut start, end)..end]).collect()
    }
}

/// The lines of a scene over an abscissa that `x` takes from a checkpoint's N and seconds, and notes on what is missing.
fn curves(context: &Context, x: impl Fn(u64, &[f64]) -> f64) -> (Vec<Curve>, Vec<String>) {
    let mut notes = Vec::new();
    let curves = context.scene.strategies.iter().map(|s| curve(context, s, &x, &mut notes)).collect();
    (curves, notes)
}

/// One strategy's line.
fn curve(
    context: &Context,
    strategy: &StrategyResult,
    x: impl Fn(u64, &[f64]) -> f64,
    notes: &mut Vec<String>,
) -> Curve {
    let (name, style) = (plain(&strategy.name), context.style(&strategy.name));
    let mut curve = Curve { name, style, points: vec![], gaps: vec![], predicted: vec![], below: vec![] };
    let (mut refused, mut below, mut untimed) = (Vec::new(), Vec::new(), Vec::new());
    let mut broken = false;
    for point in &strategy.checkpoints {
        let at = x(point.spp, &point.seconds);
        let error = context.headline.at(point).filter(|e| e.estimate > 0.0 && e.estimate.is_finite());
        if point.refused.is_none() && at > 0.0 && strategy.dependence == Dependence::Independent {
            let predicted = point.predicted.and_then(|p| context.headline.value(p));
            curve.predicted.extend(predicted.filter(|p| *p > 0.0 && p.is_finite()).map(|p| (at, p)));
        }
        match error {
            _ if point.refused.is_some() => refused.push(point.spp),
            _ if !(at > 0.0 && at.is_finite()) => untimed.push(point.spp),
            None => {
                curve.below.push(at);
                below.push(point.spp);
            }
            Some(error) => {
                if std::mem::take(&mut broken) {
                    curve.gaps.push(curve.points.len());
                }
                curve.points.push((at, error));
                continue;
            }
        }
        broken = true;
    }
    let mut note = |spp: &[u64], text: &str| {
        if !spp.is_empty() {
            notes.push(format!("{}: N = {}: {text}.", curve.name, list(spp)));
        }
    };
    note(&refused, "left out, the reference is too noisy to judge it");
    note(&untimed, "left out, no time was taken");
    note(
        &below,
        "no positive error, it is below the reference's own noise after its correction; a logarithmic axis has no place \
         for it (arrow at the lower edge)",
    );
    curve
}

/// "1, 2 and 4".
fn list(values: &[u64]) -> String {
    let mut texts: Vec<_> = values.iter().map(u64::to_string).collect();
    let last = texts.pop().unwrap_or_default();
    if texts.is_empty() { last } else { format!("{} and {last}", texts.join(", ")) }
}

/// Smallest and largest of positive numbers, `pad` beyond; `None` of none.
pub(super) fn log_range(values: impl Iterator<Item = f64>, pad: f64) -> Option<(f64, f64)> {
    let positive = values.filter(|v| *v > 0.0 && v.is_finite());
    let range = positive.fold(None, |r: Option<(f64, f64)>, v| Some(r.map_or((v, v), |(l, h)| (l.min(v), h.max(v)))));
    range.map(|(l, h)| (l / pad, h * pad))
}

/// The range of errors of some curves. Bands may widen it, but by no more than a factor of three.
fn error_range(curves: &[Curve], floor: Option<f64>) -> Option<(f64, f64)> {
    let points = curves.iter().flat_map(|c| &c.points);
    let band = |i: &Interval| [i.lower.map(|l| l.max(i.estimate / 3.0)), i.upper.map(|u| u.min(i.estimate * 3.0))];
    let bands = points.clone().flat_map(|p| band(&p.1)).flatten();
    let predicted = curves.iter().flat_map(|c| &c.predicted).map(|p| p.1);
    let (low, high) = log_range(points.map(|p| p.1.estimate).chain(bands).chain(predicted), 1.25)?;
    let floor = floor.filter(|f| *f > low / 10.0).unwrap_or(low);
    Some((low.min(floor / 1.25), high.max(floor * 1.25)))
}

/// Error against N.
fn error_by_spp(context: &Context) -> Option<Figure> {
    let (curves, mut notes) = curves(context, |spp, _| spp as f64);
    let headline = &context.headline;
    let variance = context.scene.reference.variance;
    let floor = headline.value(variance).filter(|f| headline.squared && *f > 0.0 && f.is_finite());
    let range = error_range(&curves, floor)?;
    let drawn = floor.filter(|f| *f > range.0);
    if let (Some(floor), None) = (floor, drawn) {
        let unit = &headline.unit;
        notes.push(format!("The reference floor, {} {unit}, lies far below this plot.", significant(floor, 2)));
    }
    let confidence = context.confidence();
    let mut caption = format!(
        "{} against the number of samples, both logarithmic. Marks: mean over replicates; band: {confidence} interval of \
         that mean.",
        headline.name
    );
    if curves.iter().any(|c| !c.predicted.is_empty()) {
        caption.push_str(
            " Dashed: what σ/√N predicts from the samples' own variance; where the marks leave it, samples depend on one \
             another, are biased or heavy-tailed.",
        );
    }
    if drawn.is_some() {
        caption.push_str(" Dotted: the reference's own error, already subtracted; errors near it are uncertain.");
    }
    caption.push_str(" Lower is better; a steeper line converges faster.");
    let scene = plain(&context.scene.name);
    let alt = format!("{} against N on {scene}: {}.", headline.name, describe(&curves, context));
    let plot = LinePlot {
        curves: &curves,
        headline,
        floor: drawn,
        range,
        x_scale: Scale::Octaves,
        x_label: &context.abscissa(),
        confidence: &confidence,
        alt: &alt,
    };
    let svg = plot.svg(&scene);
    Some(context.figure("error-spp", "Error against samples".into(), caption, alt, notes, svg))
}

/// Error against time.
fn error_by_seconds(context: &Context) -> Option<Figure> {
    let mean = |_: u64, seconds: &[f64]| seconds.iter().sum::<f64>() / seconds.len() as f64;
    let (curves, notes) = curves(context, mean);
    let curves: Vec<_> = curves.into_iter().map(|c| Curve { predicted: vec![], ..c }).collect();
    let headline = &context.headline;
    let range = error_range(&curves, None)?;
    let (scene, confidence) = (plain(&context.scene.name), context.confidence());
    let caption = format!(
        "{} against seconds of sampling, set-up left out, both logarithmic; mean over replicates with its {confidence} \
         interval. Read across: at equal error, the line further left is cheaper.",
        headline.name
    );
    let alt = format!("{} against seconds on {scene}: {}.", headline.name, describe(&curves, context));
    let plot = LinePlot {
        curves: &curves,
        headline,
        floor: None,
        range,
        x_scale: Scale::Decades,
        x_label: "sampling time per replicate (s)",
        confidence: &confidence,
        alt: &alt,
    };
    let svg = plot.svg(&scene);
    Some(context.figure("error-seconds", "Error against time".into(), caption, alt, notes, svg))
}

/// "mis falls from 12 to 0.75 %, …".
fn describe(curves: &[Curve], context: &Context) -> String {
    let unit = &context.headline.unit;
    let one = |c: &Curve| {
        let (first, last) = (c.points.first()?, c.points.last()?);
        let [first, last] = [first, last].map(|p| significant(p.1.estimate, 2));
        Some(format!("{} goes from {first} to {last} {unit}", c.name))
    };
    curves.iter().filter_map(one).collect::<Vec<_>>().join(", ").trim_end().to_owned()
}

/// A log-log plot of errors.
struct LinePlot<'a> {
    curves: &'a [Curve],
    headline: &'a Headline,
    floor: Option<f64>,
    range: (f64, f64),
    x_scale: Scale,
    x_label: &'a str,
    /// Confidence of the bands, as text.
    confidence: &'a str,
    alt: &'a str,
}

impl LinePlot<'_> {
    const WIDTH: f64 = 740.0;
    const LEFT: f64 = 76.0;
    const TOP: f64 = 34.0;
    const BOTTOM: f64 = 52.0;
    const LABEL_STEP: f64 = 17.0;
    const LONGEST_LABEL: f64 = 210.0;

    fn svg(&self, scene: &str) -> String {
        let abscissae = self.curves.iter().flat_map(|c| c.points.iter().map(|p| p.0).chain(c.below.iter().copied()));
        let (from, to) = log_range(abscissae, 1.12).unwrap_or((0.5, 2.0));
        let labels = self.curves.iter().map(|c| text_width(&c.name, TEXT)).fold(0.0, f64::max).min(Self::LONGEST_LABEL);
        let right = Self::WIDTH - labels - 46.0;
        let height = (430.0f64).max(Self::TOP + Self::BOTTOM + (self.curves.len() + 1) as f64 * Self::LABEL_STEP);
        let frame = Frame {
            x: Axis { scale: self.x_scale, from, to, start: Self::LEFT, end: right },
            y: Axis {
                scale: Scale::Decades,
                from: self.range.0,
                to: self.range.1,
                start: height - Self::BOTTOM,
                end: Self::TOP,
            },
        };
        svg((Self::WIDTH, height), &format!("{} on {scene}", self.headline.name), self.alt, |canvas| {
            frame.draw(canvas, self.x_label, &self.headline.label());
            self.key(canvas);
            self.draw_floor(canvas, &frame);
            for curve in self.curves {
                self.draw_band(canvas, &frame, curve);
            }
            if self.headline.converges {
                self.triangle(canvas, &frame);
            }
            for curve in self.curves {
                draw_curve(canvas, &frame, curve);
            }
            self.labels(canvas, &frame);
        })
    }

    /// The line above the plot that says what marks mean.
    fn key(&self, canvas: &Canvas) {
        let y = 14.0;
        let mut x = Self::LEFT;
        let mut entry = |draw: &dyn Fn(f64), text: &str| {
            draw(x);
            canvas.text(text, (x + 32.0, y), Anchor::Left, TEXT - 1.0, GREY);
            x += 32.0 + text_width(text, TEXT - 1.0) + 22.0;
        };
        let band = self.curves.iter().flat_map(|c| &c.points).any(|p| p.1.lower.is_some());
        let mean = |x: f64| {
            if band {
                canvas.fill(&[(x, y - 6.0), (x + 26.0, y - 6.0), (x + 26.0, y + 6.0), (x, y + 6.0)], GREY, 0.2);
            }
            canvas.line(&[(x, y), (x + 26.0, y)], GREY, 1.6);
        };
        let interval = format!("mean and {} interval", self.confidence);
        entry(&mean, if band { &interval } else { "measured" });
        if self.curves.iter().any(|c| !c.predicted.is_empty()) {
            entry(&|x| canvas.dashes(&[(x, y), (x + 26.0, y)], INK, 0.9, (5.0, 4.0)), "predicted, σ/√N");
        }
        if self.floor.is_some() {
            entry(&|x| canvas.dashes(&[(x, y), (x + 26.0, y)], GREY, 1.4, (1.5, 2.5)), "reference's own error");
        }
    }

    fn draw_floor(&self, canvas: &Canvas, frame: &Frame) {
        let Some(floor) = self.floor else { return };
        let y = frame.y.at(floor);
        canvas.dashes(&[(frame.x.start, y), (frame.x.end, y)], GREY, 1.4, (1.5, 2.5));
        let label = format!("reference floor {} {}", significant(floor, 2), self.headline.unit);
        canvas.text(label.trim_end(), (frame.x.start + 8.0, y - 9.0), Anchor::Left, TEXT - 1.0, GREY);
    }

    fn draw_band(&self, canvas: &Canvas, frame: &Frame, curve: &Curve) {
        let edge = |x: f64, bound: f64| (frame.x.at(x), frame.y.beyond(bound));
        for run in curve.runs() {
            let lower = run.iter().filter_map(|p| Some(edge(p.0, p.1.lower?)));
            let upper = run.iter().rev().filter_map(|p| Some(edge(p.0, p.1.upper?)));
            let band: Vec<_> = lower.chain(upper).collect();
            canvas.fill(&clip(&band, frame.y.end, frame.y.start), colour(curve.style), 0.18);
        }
    }

    /// The triangle of slope −1/2, in the lower left corner or, where curves pass there, in the upper right one; none
    /// where both are taken.
    fn triangle(&self, canvas: &Canvas, frame: &Frame) {
        let Frame { x, y } = frame;
        let per_x = (x.end - x.start) / (x.to / x.from).ln();
        let per_y = (y.start - y.end) / (y.to / y.from).ln();
        // A factor of four in N, but not too small to be seen nor higher than a third of the plot.
        let width = (per_x * 4f64.ln()).clamp(50.0, 90.0).min((y.start - y.end) / 3.0 * 2.0 * per_x / per_y);
        let rise = width / per_x / 2.0 * per_y;
        let floor = self.floor.map_or(y.start, |f| y.at(f) - 18.0);
        let (low, high) = ((x.start + 18.0, floor - 26.0), (x.end - 18.0, y.end + 26.0));
        let (points, centre, label) = if self.is_free(frame, (low.0, low.1 - rise), (low.0 + width, low.1 + 18.0)) {
            ([(low.0, low.1 - rise), (low.0 + width, low.1), low], low.0 + width / 2.0, low.1 + 11.0)
        } else if self.is_free(frame, (high.0 - width, high.1 - 18.0), (high.0, high.1 + rise)) {
            ([(high.0 - width, high.1), (high.0, high.1 + rise), high], high.0 - width / 2.0, high.1 - 11.0)
        } else {
            return;
        };
        canvas.line(&[points[0], points[1], points[2], points[0], points[1]], GREY, 1.1);
        canvas.text("slope −1/2", (centre, label), Anchor::Centre, TEXT - 1.0, GREY);
    }

    /// Whether no curve comes near a rectangle of the plot.
    fn is_free(&self, frame: &Frame, (left, top): (f64, f64), (right, bottom): (f64, f64)) -> bool {
        const MARGIN: f64 = 12.0;
        let near = |x: f64, y: f64| x > left - MARGIN && x < right + MARGIN && y > top - MARGIN && y < bottom + MARGIN;
        !self.curves.iter().any(|curve| {
            let points: Vec<_> = curve.points.iter().map(|p| (frame.x.at(p.0), frame.y.at(p.1.estimate))).collect();
            let crosses = |a: (f64, f64), b: (f64, f64)| {
                (0..=8).map(|i| f64::from(i) / 8.0).any(|t| near(a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)))
            };
            points.windows(2).any(|w| crosses(w[0], w[1])) || points.first().is_some_and(|p| near(p.0, p.1))
        })
    }

    /// Names at the right, in the order of the last points, as near to them as their height allows.
    fn labels(&self, canvas: &Canvas, frame: &Frame) {
        let end = |c: &Curve| c.points.last().map_or(frame.y.start, |p| frame.y.at(p.1.estimate));
        let mut order: Vec<_> = self.curves.iter().map(|c| (end(c), c)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut ys: Vec<f64> = order.iter().map(|o| o.0).collect();
        spread(&mut ys, frame.y.end, frame.y.start, Self::LABEL_STEP);
        let x = frame.x.end + 22.0;
        let last = self.curves.iter().flat_map(|c| c.points.last()).map(|p| p.0).fold(0.0, f64::max);
        for ((from, curve), y) in order.into_iter().zip(ys) {
            if let Some(point) = curve.points.last().filter(|p| p.0 == last && self.x_scale == Scale::Octaves) {
                canvas.line(&[(frame.x.at(point.0) + 7.0, from), (x - 7.0, y)], colour(curve.style), 0.6);
            }
            canvas.marker(curve.style, (x, y));
            let name = fit(&curve.name, Self::LONGEST_LABEL, TEXT);
            canvas.text(&name, (x + 10.0, y), Anchor::Left, TEXT, INK);
        }
    }
}

/// Moves ascending positions apart until neighbours are `step` from one another, between two ends.
fn spread(ys: &mut [f64], top: f64, bottom: f64, step: f64) {
    let mut least = top;
    for y in ys.iter_mut() {
        *y = y.max(least);
        least = *y + step;
    }
    let mut most = bottom;
    for y in ys.iter_mut().rev() {
        *y = y.min(most);
        most = *y - step;
    }
}

/// Line, markers and prediction of one strategy.
fn draw_curve(canvas: &Canvas, frame: &Frame, curve: &Curve) {
    let ink = colour(curve.style);
    for run in curve.runs() {
        let points: Vec<_> = run.iter().map(|p| (frame.x.at(p.0), frame.y.at(p.1.estimate))).collect();
        canvas.line(&points, ink, 1.6);
        for at in points {
            canvas.marker(curve.style, at);
        }
    }
    // On top: where prediction and measurement agree, a line below would not be seen.
    let predicted: Vec<_> = curve.predicted.iter().map(|p| (frame.x.at(p.0), frame.y.at(p.1))).collect();
    if predicted.len() > 1 {
        canvas.dashes(&predicted, INK, 0.9, (5.0, 4.0));
    }
    for x in &curve.below {
        let (x, y) = (frame.x.at(*x), frame.y.start);
        canvas.line(&[(x, y - 16.0), (x, y - 4.0)], ink, 1.6);
        canvas.fill(&[(x - 4.0, y - 7.0), (x + 4.0, y - 7.0), (x, y - 1.0)], ink, 1.0);
    }
}
