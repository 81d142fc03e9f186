//! What errors cost: a point with an interval per strategy and wanted error.

use super::axis::{Axis, Frame, Scale};
use super::canvas::{Anchor, Canvas, GREY, INK, TEXT, colour, fit, svg, text_width};
use super::plot::{Context, log_range};
use super::{Figure, plain};
use crate::record::{StrategyResult, TargetCost};
use crate::stats::number::{format_interval, significant};

const WIDTH: f64 = 740.0;
const ROW: f64 = 20.0;
/// Height of a group's heading.
const HEAD: f64 = 30.0;
const TOP: f64 = 10.0;
/// Space for the figures at the right.
const FIGURES: f64 = 190.0;
const LONGEST_NAME: f64 = 190.0;

/// The cost plot; `None` where nothing could be estimated.
pub(super) fn figure(context: &Context) -> Option<Figure> {
    let scene = context.scene;
    let seconds = || scene.strategies.iter().flat_map(|s| &s.cost).filter_map(|c| c.seconds);
    // Very wide intervals are cut at the frame rather than squeezing everything else.
    let lower = seconds().filter_map(|i| i.lower.map(|l| l.max(i.estimate / 10.0)));
    let upper = seconds().filter_map(|i| i.upper.map(|u| u.min(i.estimate * 10.0)));
    let (from, to) = log_range(seconds().map(|i| i.estimate).chain(lower).chain(upper), 1.3)?;
    let wanted = |t: &f64| scene.strategies.iter().any(|s| cost(s, *t).is_some());
    let targets: Vec<f64> = scene.targets.iter().copied().filter(wanted).collect();
    let names = scene.strategies.iter().map(|s| text_width(&plain(&s.name), TEXT - 1.0).min(LONGEST_NAME));
    let headings = targets.iter().map(|&t| text_width(&heading(context, t), TEXT));
    let left = names.chain(headings).fold(0.0, f64::max) + 32.0;
    let height = TOP + targets.len() as f64 * (HEAD + scene.strategies.len() as f64 * ROW) + 58.0;
    let x = Axis { scale: Scale::Decades, from, to, start: left, end: WIDTH - FIGURES };
    let frame = Frame { x, y: Axis { scale: Scale::Linear, from: 0.0, to: 1.0, start: height - 52.0, end: TOP } };
    let title = format!("Cost of errors on {}", plain(&scene.name));
    let alt = alt(context, &title);
    let picture = svg((WIDTH, height), &title, &alt, |canvas| {
        frame.draw_rows(canvas, "seconds of sampling");
        let mut top = TOP;
        for &target in &targets {
            if top > TOP {
                canvas.line(&[(8.0, top), (WIDTH - 8.0, top)], GREY, 0.6);
            }
            canvas.text(&heading(context, target), (left - 12.0, top + 16.0), Anchor::Right, TEXT, INK);
            top += HEAD;
            for strategy in &scene.strategies {
                draw_row(canvas, context, &x, strategy, target, top + ROW / 2.0 - 2.0);
                top += ROW;
            }
        }
    });
    let extrapolated = scene.strategies.iter().flat_map(|s| &s.cost).any(|c| c.extrapolated && c.seconds.is_some());
    let mut caption = format!(
        "Seconds of sampling that reach each wanted {}, with {} interval; logarithmic. Further left is cheaper.",
        context.headline.name,
        context.confidence()
    );
    if extrapolated {
        caption.push_str(" Hollow, with a star: extrapolated beyond the largest N measured.");
    }
    Some(context.figure("cost", "What an error costs".into(), caption, alt, vec![], picture))
}

fn cost(strategy: &StrategyResult, target: f64) -> Option<&TargetCost> {
    strategy.cost.iter().find(|c| c.target == target)
}

/// "√relMSE = 1 %".
fn heading(context: &Context, target: f64) -> String {
    format!("{} = {}", context.headline.name, context.headline.target(target))
}

/// One strategy's name, mark, interval and figures.
fn draw_row(canvas: &Canvas, context: &Context, x: &Axis, strategy: &StrategyResult, target: f64, y: f64) {
    let (style, name) = (context.style(&strategy.name), plain(&strategy.name));
    canvas.text(&fit(&name, LONGEST_NAME, TEXT - 1.0), (x.start - 12.0, y), Anchor::Right, TEXT - 1.0, GREY);
    let Some((cost, seconds)) = cost(strategy, target).and_then(|c| Some((c, c.seconds?))) else {
        canvas.text("no basis for an estimate", (x.end + 12.0, y), Anchor::Left, TEXT - 2.0, GREY);
        return;
    };
    let at = x.at(seconds.estimate);
    if let (Some(lower), Some(upper)) = (seconds.lower, seconds.upper) {
        let (low, high) = (x.at(lower), x.at(upper));
        canvas.line(&[(low, y), (high, y)], colour(style), 1.6);
        // Caps that the mark would hide in part look like dirt.
        for end in [low, high].into_iter().filter(|e| (e - at).abs() > 8.0) {
            canvas.line(&[(end, y - 4.0), (end, y + 4.0)], colour(style), 1.6);
        }
    }
    canvas.shape(style, (at, y), cost.extrapolated);
    let text = format_interval(&seconds, if cost.extrapolated { "*" } else { "" });
    canvas.text(&text, (x.end + 12.0, y), Anchor::Left, TEXT - 1.0, INK);
}

fn alt(context: &Context, title: &str) -> String {
    let rows =
        context.scene.strategies.iter().flat_map(|s| s.cost.iter().filter_map(move |c| Some((s, c, c.seconds?))));
    let texts = rows.map(|(s, c, i)| {
        let (name, target) = (plain(&s.name), context.headline.target(c.target));
        format!("{name} reaches {target} in {} s", significant(i.estimate, 2))
    });
    format!("{title}: {}.", texts.collect::<Vec<_>>().join(", "))
}
