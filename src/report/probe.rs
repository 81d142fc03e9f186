//! Running means of probe pixels: one figure per pixel, one panel per strategy, all on the same axes.

use super::axis::{Axis, Frame, Scale};
use super::canvas::{Anchor, Canvas, INK, TEXT, clip, colour, fit, svg};
use super::plot::{Context, log_range};
use super::{Figure, plain};
use crate::record::{ProbeResult, StrategyResult};
use crate::stats::number::significant;

const PANEL: (f64, f64) = (178.0, 130.0);
const GAP: (f64, f64) = (16.0, 40.0);
const LEFT: f64 = 84.0;
const TOP: f64 = 28.0;
const COLUMNS: usize = 3;

/// The panels of one pixel.
type Panels<'a> = [(&'a StrategyResult, &'a ProbeResult)];

/// One figure per probe pixel.
pub(super) fn figures(context: &Context) -> Vec<Figure> {
    let mut pixels: Vec<[u32; 2]> = Vec::new();
    for probe in context.scene.strategies.iter().flat_map(|s| &s.probes) {
        if !pixels.contains(&probe.pixel) {
            pixels.push(probe.pixel);
        }
    }
    pixels.into_iter().filter_map(|pixel| figure(context, pixel)).collect()
}

fn figure(context: &Context, pixel: [u32; 2]) -> Option<Figure> {
    let probe = |s: &'_ StrategyResult| s.probes.iter().position(|p| p.pixel == pixel && !p.points.is_empty());
    let panels: Vec<_> = context.scene.strategies.iter().filter_map(|s| Some((s, &s.probes[probe(s)?]))).collect();
    let reference = panels.first()?.1.reference;
    let all = || panels.iter().flat_map(|(_, p)| &p.points);
    let abscissae = log_range(all().map(|p| p.0 as f64), 1.35)?;
    let half = reach(reference, &panels);
    let title = format!("Running mean of pixel ({}, {})", pixel[0], pixel[1]);
    let last = panels.iter().filter_map(|(s, p)| Some((plain(&s.name), p.points.last()?.1)));
    let last = last.map(|(name, mean)| format!("{name} {}", significant(mean, 3))).collect::<Vec<_>>().join(", ");
    let alt = format!("{title}: reference {}; last means: {last}.", significant(reference, 3));
    let rows = panels.len().div_ceil(COLUMNS);
    // A legend-less single panel would be narrower than its own axis label.
    let columns = panels.len().min(COLUMNS);
    let size = (LEFT + columns as f64 * (PANEL.0 + GAP.0) + 4.0, TOP + rows as f64 * (PANEL.1 + GAP.1) + 16.0);
    let picture = svg(size, &title, &alt, |canvas| {
        for (i, (strategy, probe)) in panels.iter().enumerate() {
            let left = LEFT + (i % COLUMNS) as f64 * (PANEL.0 + GAP.0);
            let top = TOP + (i / COLUMNS) as f64 * (PANEL.1 + GAP.1);
            let (low, high) = (reference - half, reference + half);
            let (from, to) = abscissae;
            let frame = Frame {
                x: Axis { scale: Scale::Octaves, from, to, start: left, end: left + PANEL.0 },
                y: Axis { scale: Scale::Linear, from: low, to: high, start: top + PANEL.1, end: top },
            };
            frame.draw_panel(canvas, i % COLUMNS == 0, i + COLUMNS >= panels.len());
            draw_mean(canvas, &frame, context.style(&strategy.name), probe, reference);
            canvas.text(&fit(&plain(&strategy.name), PANEL.0, TEXT), (left, top - 11.0), Anchor::Left, TEXT, INK);
        }
        let bottom = TOP + rows as f64 * (PANEL.1 + GAP.1) - GAP.1;
        let centre = LEFT + (columns as f64 * (PANEL.0 + GAP.0) - GAP.0) / 2.0;
        canvas.text(&context.abscissa(), (centre, bottom + 36.0), Anchor::Centre, TEXT, INK);
        canvas.upward_text("running mean", (18.0, (TOP + bottom) / 2.0), TEXT, INK);
    });
    let caption = format!(
        "Running mean of this pixel over replicates (mean of channels) with its 95 % interval; dashed: the reference, {}. \
         An unbiased estimator closes in on the dashed line; an interval that leaves it for good shows bias. Intervals are \
         cut at the frame.",
        significant(reference, 4)
    );
    let suffix = format!("probe-{}-{}", pixel[0], pixel[1]);
    Some(context.figure(&suffix, title, caption, alt, vec![], picture))
}

/// How far the vertical axis reaches from the reference: all means are inside, and three quarters of the bounds. The
/// widest intervals, those of the smallest N, would hide everything else.
fn reach(reference: f64, panels: &Panels) -> f64 {
    let points = || panels.iter().flat_map(|(_, p)| &p.points);
    let distances = |values: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
        values.map(|v| (v - reference).abs()).filter(|d| d.is_finite()).collect()
    };
    let mut bounds = distances(&mut points().flat_map(|p| [p.2, p.3]));
    bounds.sort_by(f64::total_cmp);
    let typical = bounds.get(bounds.len() * 3 / 4).copied().unwrap_or(0.0);
    let half = distances(&mut points().map(|p| p.1)).into_iter().fold(typical, f64::max);
    // A pixel without any spread still needs an axis.
    if half > 0.0 { half * 1.15 } else { 0.1 * if reference == 0.0 { 1.0 } else { reference.abs() } }
}

/// Band, reference line, mean and marks of one panel.
fn draw_mean(canvas: &Canvas, frame: &Frame, style: usize, probe: &ProbeResult, reference: f64) {
    let at = |n: u64, value: f64| (frame.x.at(n as f64), frame.y.beyond(value));
    let bounded: Vec<_> = probe.points.iter().filter(|p| p.2.is_finite() && p.3.is_finite()).collect();
    let lower = bounded.iter().map(|p| at(p.0, p.2));
    let upper = bounded.iter().rev().map(|p| at(p.0, p.3));
    let band: Vec<_> = lower.chain(upper).collect();
    canvas.fill(&clip(&band, frame.y.end, frame.y.start), colour(style), 0.22);
    let y = frame.y.at(reference);
    canvas.dashes(&[(frame.x.start, y), (frame.x.end, y)], INK, 1.1, (5.0, 3.0));
    let means: Vec<_> = probe.points.iter().filter(|p| p.1.is_finite()).map(|p| at(p.0, p.1)).collect();
    canvas.line(&means, colour(style), 1.6);
    for mean in means {
        canvas.marker(style, mean);
    }
}
