//! Curves as SVG and PNG: error against N and against time, what errors cost, running means of probe pixels.

use super::canvas::{
    Anchor, Axis, Canvas, Frame, GREY, INK, Scale, TEXT, colour, fit, png, rasterise, svg, text_width,
};
use super::number::{format_interval, percent, significant};
use super::{Figure, Headline, plain};
use crate::record::{Dependence, Interval, Record, SceneResult};
use std::collections::BTreeMap;

/// Pixels of PNG per pixel of SVG.
const PNG_SCALE: f32 = 2.0;

/// What every plot of a scene needs.
struct Context<'a> {
    scene: &'a SceneResult,
    headline: Headline,
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
        [error_by_spp(&context), error_by_seconds(&context), cost(&context)].into_iter().flatten().collect();
    figures.extend(probes(&context));
    figures
}

impl Context<'_> {
    fn style(&self, name: &str) -> usize {
        self.styles.get(name).copied().unwrap_or(0)
    }

    fn figure(
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

    /// The confidence of the bands, "95 %".
    fn confidence(&self) -> String {
        let points = self.scene.strategies.iter().flat_map(|s| &s.checkpoints);
        percent(points.flat_map(|c| c.metrics.first()).map(|m| m.mean.confidence).next().unwrap_or(0.95))
    }
}

/// One strategy's line.
struct Curve {
    name: String,
    style: usize,
    /// Abscissa and error, both positive and finite.
    points: Vec<(f64, Interval)>,
    /// Abscissa and predicted error.
    predicted: Vec<(f64, f64)>,
    /// Abscissae at which the corrected error is not positive.
    below: Vec<f64>,
}

/// The lines of a scene over an abscissa that `x` takes from a checkpoint's N and seconds, and notes on what is missing.
fn curves(context: &Context, x: impl Fn(u64, &[f64]) -> f64) -> (Vec<Curve>, Vec<String>) {
    let mut notes = Vec::new();
    let mut curves = Vec::new();
    for strategy in &context.scene.strategies {
        let name = plain(&strategy.name);
        let mut curve =
            Curve { style: context.style(&strategy.name), name, points: vec![], predicted: vec![], below: vec![] };
        let (mut refused, mut below) = (Vec::new(), Vec::new());
        for point in &strategy.checkpoints {
            let at = x(point.spp, &point.seconds);
            if point.refused.is_some() {
                refused.push(point.spp);
                continue;
            }
            if !(at > 0.0 && at.is_finite()) {
                notes.push(format!("{}: no time for N = {}.", curve.name, point.spp));
                continue;
            }
            match context.headline.at(point).filter(|e| e.estimate > 0.0 && e.estimate.is_finite()) {
                Some(error) => curve.points.push((at, error)),
                None => {
                    curve.below.push(at);
                    below.push(point.spp);
                }
            }
            let predicted = point.predicted.and_then(|p| context.headline.value(p));
            let shown = strategy.dependence == Dependence::Independent;
            curve.predicted.extend(predicted.filter(|p| shown && *p > 0.0 && p.is_finite()).map(|p| (at, p)));
        }
        if !refused.is_empty() {
            notes.push(format!(
                "{}: N = {} left out, the reference is too noisy to judge it.",
                curve.name,
                list(&refused)
            ));
        }
        if !below.is_empty() {
            notes.push(format!(
                "{}: no positive error at N = {}: below the reference's own noise after its correction, so that a \
                 logarithmic axis has no place for it (arrow at the lower edge).",
                curve.name,
                list(&below)
            ));
        }
        curves.push(curve);
    }
    (curves, notes)
}

/// "1, 2 and 4".
fn list(values: &[u64]) -> String {
    let mut texts: Vec<_> = values.iter().map(u64::to_string).collect();
    let last = texts.pop().unwrap_or_default();
    if texts.is_empty() { last } else { format!("{} and {last}", texts.join(", ")) }
}

/// Smallest and largest of positive numbers, `pad` beyond; `None` of none.
fn log_range(values: impl Iterator<Item = f64>, pad: f64) -> Option<(f64, f64)> {
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
    let x_label = match context.scene.abscissa.as_str() {
        "spp" => "N (samples per pixel)".to_owned(),
        other => format!("N ({other})"),
    };
    let range = error_range(&curves, floor)?;
    let drawn = floor.filter(|f| *f > range.0);
    if let (Some(floor), None) = (floor, drawn) {
        let unit = &headline.unit;
        notes.push(format!("The reference floor, {} {unit}, lies far below this plot.", significant(floor, 2)));
    }
    let plot = LinePlot { curves: &curves, headline, floor: drawn, range, x_scale: Scale::Octaves, x_label: &x_label };
    let scene = plain(&context.scene.name);
    let predicted = curves.iter().any(|c| !c.predicted.is_empty());
    let mut caption = format!(
        "{} against the number of samples, both logarithmic. Markers: mean over replicates; band: {} interval of that mean.",
        headline.name,
        context.confidence()
    );
    if predicted {
        caption.push_str(" Dashed: what σ/√N predicts from the samples' own variance; where the marks leave it, samples are not independent, biased or heavy-tailed.");
    }
    if drawn.is_some() {
        caption.push_str(" Dotted: the reference's own error, already subtracted; errors near it are uncertain.");
    }
    caption.push_str(" Read downwards: lower is better; a steeper line converges faster.");
    let alt = format!("{} against N on {scene}: {}.", headline.name, describe(&curves, context));
    Some(context.figure("error-spp", "Error against samples".into(), caption, alt, notes, plot.svg(&scene)))
}

/// Error against time.
fn error_by_seconds(context: &Context) -> Option<Figure> {
    let mean = |_: u64, seconds: &[f64]| seconds.iter().sum::<f64>() / seconds.len() as f64;
    let (curves, mut notes) = curves(context, mean);
    for curve in &curves {
        notes.retain(|n| !n.starts_with(&format!("{}: N = ", curve.name)));
    }
    let headline = &context.headline;
    let curves: Vec<_> = curves.into_iter().map(|c| Curve { predicted: vec![], ..c }).collect();
    let range = error_range(&curves, None)?;
    let x_label = "sampling time per replicate (s)";
    let plot = LinePlot { curves: &curves, headline, floor: None, range, x_scale: Scale::Decades, x_label };
    let scene = plain(&context.scene.name);
    let caption = format!(
        "{} against seconds of sampling, set-up left out, both logarithmic; mean over replicates with its {} interval. \
         Read across: at equal error, the line further left is cheaper.",
        headline.name,
        context.confidence()
    );
    let alt = format!("{} against seconds on {scene}: {}.", headline.name, describe(&curves, context));
    Some(context.figure("error-seconds", "Error against time".into(), caption, alt, notes, plot.svg(&scene)))
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
        svg(Self::WIDTH, height, &format!("{} on {scene}", self.headline.name), |canvas| {
            frame.draw(canvas, self.x_label, &self.headline.label());
            self.key(canvas);
            self.draw_floor(canvas, &frame);
            for curve in self.curves {
                self.draw_band(canvas, &frame, curve);
            }
            if self.headline.unit != "dB" {
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
        entry(&mean, if band { "mean and its interval" } else { "measured" });
        if self.curves.iter().any(|c| !c.predicted.is_empty()) {
            entry(&|x| canvas.dashes(&[(x, y), (x + 26.0, y)], GREY, 1.2, (5.0, 3.0)), "predicted, σ/√N");
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
        let bounds = |p: &&(f64, Interval)| p.1.lower.is_some() && p.1.upper.is_some();
        let points: Vec<_> = curve.points.iter().filter(bounds).collect();
        let edge = |p: &(f64, Interval), b: Option<f64>| (frame.x.at(p.0), frame.y.at(b.unwrap_or(p.1.estimate)));
        let lower = points.iter().map(|p| edge(p, p.1.lower));
        let upper = points.iter().rev().map(|p| edge(p, p.1.upper));
        if points.len() > 1 {
            canvas.fill(&lower.chain(upper).collect::<Vec<_>>(), colour(curve.style), 0.18);
        }
    }

    /// The triangle of slope −1/2, in the corner that holds fewer points.
    fn triangle(&self, canvas: &Canvas, frame: &Frame) {
        let Frame { x, y } = frame;
        let per_x = (x.end - x.start) / (x.to / x.from).ln();
        let per_y = (y.start - y.end) / (y.to / y.from).ln();
        // About a seventh of the width, but never higher than a third of the plot.
        let width = (per_x * 4f64.ln()).clamp(50.0, 90.0).min((y.start - y.end) / 3.0 * 2.0 * per_x / per_y);
        let rise = width / per_x / 2.0 * per_y;
        let floor = self.floor.map_or(y.start, |f| y.at(f) - 18.0);
        let low = (x.start + 18.0, floor.min(y.start) - 26.0);
        let high = (x.end - 18.0, y.end + 26.0);
        let crowd = |(left, top, right, bottom): (f64, f64, f64, f64)| {
            let inside =
                |px: f64, py: f64| px > left - 12.0 && px < right + 12.0 && py > top - 12.0 && py < bottom + 12.0;
            let along = |c: &Curve| {
                let points: Vec<_> = c.points.iter().map(|p| (x.at(p.0), y.at(p.1.estimate))).collect();
                let between = |w: &[(f64, f64)]| {
                    (0..=8)
                        .filter(|i| {
                            let t = f64::from(*i) / 8.0;
                            inside(w[0].0 + t * (w[1].0 - w[0].0), w[0].1 + t * (w[1].1 - w[0].1))
                        })
                        .count()
                };
                points.windows(2).map(between).sum::<usize>()
            };
            self.curves.iter().map(along).sum::<usize>()
        };
        let below = crowd((low.0, low.1 - rise, low.0 + width, low.1));
        let above = crowd((high.0 - width, high.1, high.0, high.1 + rise));
        let (corner, points) = if below <= above {
            (low, [(low.0, low.1 - rise), (low.0 + width, low.1), low])
        } else {
            (high, [(high.0 - width, high.1), (high.0, high.1 + rise), high])
        };
        if below.min(above) > 0 {
            return;
        }
        canvas.line(&[points[0], points[1], points[2], points[0], points[1]], GREY, 1.1);
        let centre = if below <= above { corner.0 + width / 2.0 } else { corner.0 - width / 2.0 };
        let label_y = if below <= above { corner.1 + 11.0 } else { corner.1 - 11.0 };
        canvas.text("slope −1/2", (centre, label_y), Anchor::Centre, TEXT - 1.0, GREY);
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
            canvas.marker(curve.style, (x, y), false);
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

/// Prediction, line and markers of one strategy.
fn draw_curve(canvas: &Canvas, frame: &Frame, curve: &Curve) {
    let ink = colour(curve.style);
    let predicted: Vec<_> = curve.predicted.iter().map(|p| (frame.x.at(p.0), frame.y.at(p.1))).collect();
    if predicted.len() > 1 {
        canvas.dashes(&predicted, ink, 1.2, (5.0, 3.0));
    }
    let points: Vec<_> = curve.points.iter().map(|p| (frame.x.at(p.0), frame.y.at(p.1.estimate))).collect();
    if points.len() > 1 {
        canvas.line(&points, ink, 1.6);
    }
    for at in points {
        canvas.marker(curve.style, at, false);
    }
    for x in &curve.below {
        let (x, y) = (frame.x.at(*x), frame.y.start);
        canvas.line(&[(x, y - 16.0), (x, y - 4.0)], ink, 1.6);
        canvas.fill(&[(x - 4.0, y - 7.0), (x + 4.0, y - 7.0), (x, y - 1.0)], ink, 1.0);
    }
}

/// Seconds that each wanted error costs: a point and an interval per strategy.
fn cost(context: &Context) -> Option<Figure> {
    const WIDTH: f64 = 740.0;
    const ROW: f64 = 20.0;
    const HEAD: f64 = 28.0;
    let scene = context.scene;
    let cost = |s: &crate::record::StrategyResult, t: f64| s.cost.iter().find(|c| c.target == t).copied();
    let seconds = scene.strategies.iter().flat_map(|s| &s.cost).filter_map(|c| c.seconds);
    let bounds = seconds.flat_map(|i| {
        [Some(i.estimate), i.lower.filter(|l| *l > i.estimate / 10.0), i.upper.filter(|u| *u < i.estimate * 10.0)]
    });
    let (from, to) = log_range(bounds.flatten(), 1.3)?;
    let targets: Vec<f64> =
        scene.targets.iter().copied().filter(|t| scene.strategies.iter().any(|s| cost(s, *t).is_some())).collect();
    let names = scene.strategies.iter().map(|s| text_width(&plain(&s.name), TEXT)).fold(0.0, f64::max).min(190.0);
    let left = names + 36.0;
    let height = targets.len() as f64 * (HEAD + scene.strategies.len() as f64 * ROW) + 70.0;
    let x = Axis { scale: Scale::Decades, from, to, start: left, end: WIDTH - 190.0 };
    let frame = Frame { x, y: Axis { scale: Scale::Linear, from: 0.0, to: 1.0, start: height - 52.0, end: 10.0 } };
    let title = format!("Cost of errors on {}", plain(&scene.name));
    let picture = svg(WIDTH, height, &title, |canvas| {
        frame.draw_rows(canvas, "seconds of sampling");
        let mut y = 10.0;
        for &target in &targets {
            y += HEAD - 8.0;
            let label = format!("{} = {}", context.headline.name, context.headline.target(target));
            canvas.text(&label, (12.0, y), Anchor::Left, TEXT, INK);
            y += 8.0;
            for strategy in &scene.strategies {
                y += ROW;
                let style = context.style(&strategy.name);
                canvas.text(
                    &fit(&plain(&strategy.name), 190.0, TEXT),
                    (left - 12.0, y),
                    Anchor::Right,
                    TEXT - 1.0,
                    INK,
                );
                let found = cost(strategy, target);
                let Some((cost, seconds)) = found.and_then(|c| Some((c, c.seconds?))) else {
                    canvas.text("no basis for an estimate", (x.end + 12.0, y), Anchor::Left, TEXT - 2.0, GREY);
                    continue;
                };
                if let (Some(lower), Some(upper)) = (seconds.lower, seconds.upper) {
                    let (l, u) = (x.at(lower), x.at(upper));
                    canvas.line(&[(l, y), (u, y)], colour(style), 1.6);
                    for end in [l, u] {
                        canvas.line(&[(end, y - 4.0), (end, y + 4.0)], colour(style), 1.6);
                    }
                }
                canvas.marker(style, (x.at(seconds.estimate), y), cost.extrapolated);
                let text = format_interval(&seconds, if cost.extrapolated { "*" } else { "" });
                canvas.text(&text, (x.end + 12.0, y), Anchor::Left, TEXT - 1.0, INK);
            }
        }
    });
    let extrapolated = scene.strategies.iter().flat_map(|s| &s.cost).any(|c| c.extrapolated && c.seconds.is_some());
    let mut caption = format!(
        "Seconds of sampling that reach each wanted {}, with {} interval; logarithmic axis. Further left is cheaper; \
         intervals that do not overlap are apart beyond doubt.",
        context.headline.name,
        context.confidence()
    );
    if extrapolated {
        caption.push_str(" Marks of the other filling, with a star: extrapolated beyond the largest N measured.");
    }
    let rows = scene.strategies.iter().flat_map(|s| s.cost.iter().filter_map(move |c| Some((s, c, c.seconds?))));
    let texts = rows.map(|(s, c, i)| {
        format!("{} reaches {} in {} s", plain(&s.name), context.headline.target(c.target), significant(i.estimate, 2))
    });
    let alt = format!("{title}: {}.", texts.collect::<Vec<_>>().join(", "));
    Some(context.figure("cost", "What an error costs".into(), caption, alt, vec![], picture))
}

/// Running means of probe pixels: one figure per pixel, one panel per strategy.
fn probes(context: &Context) -> Vec<Figure> {
    let mut pixels: Vec<[u32; 2]> = Vec::new();
    for probe in context.scene.strategies.iter().flat_map(|s| &s.probes) {
        if !pixels.contains(&probe.pixel) {
            pixels.push(probe.pixel);
        }
    }
    pixels.into_iter().filter_map(|pixel| probe_figure(context, pixel)).collect()
}

/// One probe pixel.
fn probe_figure(context: &Context, pixel: [u32; 2]) -> Option<Figure> {
    const PANEL: (f64, f64) = (176.0, 130.0);
    const GAP: (f64, f64) = (16.0, 34.0);
    const LEFT: f64 = 76.0;
    const TOP: f64 = 26.0;
    let found = context.scene.strategies.iter().filter_map(|s| Some((s, s.probes.iter().find(|p| p.pixel == pixel)?)));
    let panels: Vec<_> = found.filter(|(_, p)| !p.points.is_empty()).collect();
    let reference = panels.first()?.1.reference;
    let points = || panels.iter().flat_map(|(_, p)| &p.points);
    let (from, to) = log_range(points().map(|p| p.0 as f64), 1.2)?;
    // Means and the tighter half of the intervals decide the range; the widest intervals, at the smallest N, are cut.
    let mut reach: Vec<f64> =
        points().flat_map(|p| [p.2, p.3]).filter(|v| v.is_finite()).map(|v| (v - reference).abs()).collect();
    reach.sort_by(f64::total_cmp);
    let typical = reach.get(reach.len() * 3 / 4).copied().unwrap_or(0.0);
    let means = points().map(|p| (p.1 - reference).abs()).filter(|v| v.is_finite()).fold(typical, f64::max);
    let half = if means > 0.0 { means * 1.1 } else { reference.abs().max(1.0) * 0.1 };
    let columns = panels.len().min(3);
    let rows = panels.len().div_ceil(columns);
    let width = LEFT + columns as f64 * (PANEL.0 + GAP.0) + 8.0;
    let height = TOP + rows as f64 * (PANEL.1 + GAP.1) + 36.0;
    let title = format!("Running mean of pixel ({}, {}) on {}", pixel[0], pixel[1], plain(&context.scene.name));
    let picture = svg(width.max(420.0), height, &title, |canvas| {
        for (i, (strategy, probe)) in panels.iter().enumerate() {
            let left = LEFT + (i % columns) as f64 * (PANEL.0 + GAP.0);
            let top = TOP + (i / columns) as f64 * (PANEL.1 + GAP.1);
            let frame = Frame {
                x: Axis { scale: Scale::Octaves, from, to, start: left, end: left + PANEL.0 },
                y: Axis {
                    scale: Scale::Linear,
                    from: reference - half,
                    to: reference + half,
                    start: top + PANEL.1,
                    end: top,
                },
            };
            frame.draw_panel(canvas, i % columns == 0, i + columns >= panels.len());
            let style = context.style(&strategy.name);
            let at = |n: u64, v: f64| (frame.x.at(n as f64), frame.y.at(v));
            let bounded: Vec<_> = probe.points.iter().filter(|p| p.2.is_finite() && p.3.is_finite()).collect();
            let lower = bounded.iter().map(|p| at(p.0, p.2));
            let upper = bounded.iter().rev().map(|p| at(p.0, p.3));
            if bounded.len() > 1 {
                canvas.fill(&lower.chain(upper).collect::<Vec<_>>(), colour(style), 0.22);
            }
            canvas.dashes(
                &[(left, frame.y.at(reference)), (left + PANEL.0, frame.y.at(reference))],
                INK,
                1.1,
                (5.0, 3.0),
            );
            let means: Vec<_> = probe.points.iter().filter(|p| p.1.is_finite()).map(|p| at(p.0, p.1)).collect();
            if means.len() > 1 {
                canvas.line(&means, colour(style), 1.6);
            }
            for mean in means {
                canvas.marker(style, mean, false);
            }
            canvas.text(&fit(&plain(&strategy.name), PANEL.0, TEXT), (left, top - 10.0), Anchor::Left, TEXT, INK);
        }
        let bottom = TOP + rows as f64 * (PANEL.1 + GAP.1) - GAP.1;
        let centre = LEFT + (columns as f64 * (PANEL.0 + GAP.0) - GAP.0) / 2.0;
        canvas.text("N (samples per pixel)", (centre, bottom + 36.0), Anchor::Centre, TEXT, INK);
        canvas.upward_text("running mean (radiance)", (18.0, (TOP + bottom) / 2.0), TEXT, INK);
    });
    let caption = format!(
        "Running mean of pixel ({}, {}) over replicates (mean of channels) with its 95 % interval; dashed: the reference, {}. \
         An honest estimator closes in on the dashed line from both sides; an interval that leaves it for good shows bias. \
         Intervals beyond the plot are cut at its edge.",
        pixel[0],
        pixel[1],
        significant(reference, 4)
    );
    let last =
        panels.iter().filter_map(|(s, p)| Some(format!("{} {}", plain(&s.name), significant(p.points.last()?.1, 3))));
    let alt = format!(
        "{title}: reference {}; last means: {}.",
        significant(reference, 3),
        last.collect::<Vec<_>>().join(", ")
    );
    let suffix = format!("probe-{}-{}", pixel[0], pixel[1]);
    let heading = format!("Running mean of pixel ({}, {})", pixel[0], pixel[1]);
    Some(context.figure(&suffix, heading, caption, alt, vec![], picture))
}
