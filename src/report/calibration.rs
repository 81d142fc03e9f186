//! What a calibration found: tables, and how often intervals miss the truth as samples grow.

use super::axis::{Axis, Frame, Scale};
use super::canvas::{Anchor, Canvas, GREY, INK, TEXT, colour, fit, png, rasterise, svg, text_width};
use super::plain;
use super::plot::PNG_SCALE;
use super::table::{CONSOLE, MARKDOWN, NONE, draw, escape};
use crate::analysis::calibration::{ALL, Check, ERROR, TRUSTED, What};
use crate::error::Result;
use crate::record::calibration::{Calibration, Forecasts, Outcomes, Verdicts};
use crate::record::write_atomically;
use crate::stats::multiple::binomial_band;
use crate::stats::number::{about, percent, significant};
use comfy_table::TableStyle;
use std::path::Path;

/// Writes `<name>.json`, `<name>.md` and, where there are verdicts at several N, `<name>.svg` and `.png` into a folder.
pub fn write(calibration: &Calibration, checks: &[Check], folder: &Path) -> Result<()> {
    let json = serde_json::to_string_pretty(calibration).expect("plain data");
    let name = &calibration.name;
    write_atomically(&folder.join(format!("{name}.json")), json.as_bytes())?;
    let picture = figure(calibration);
    if let Some(svg) = &picture {
        write_atomically(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
        write_atomically(&folder.join(format!("{name}.png")), &png(&rasterise(svg, PNG_SCALE)))?;
    }
    let text = markdown(calibration, checks, picture.is_some());
    write_atomically(&folder.join(format!("{name}.md")), text.as_bytes())
}

/// The tables for a terminal.
pub fn console(calibration: &Calibration, checks: &[Check]) -> String {
    let mut out = format!("{}: {}\n\n", plain(&calibration.name), repeated(calibration));
    for table in tables(calibration, checks, CONSOLE, plain) {
        out += &format!("{table}\n\n");
    }
    let [summary, rest @ ..] = &conclusions(checks)[..] else { return out };
    out += &format!("{summary}\n");
    rest.iter().for_each(|line| out += &format!("  {line}\n"));
    out + "\n"
}

fn markdown(calibration: &Calibration, checks: &[Check], picture: bool) -> String {
    let mut out = format!("# {}\n\n", escape(&calibration.name));
    if let Some(question) = &calibration.question {
        out += &format!("{}\n\n", escape(question));
    }
    out += &format!("{}.\n\n", repeated(calibration));
    for table in tables(calibration, checks, MARKDOWN, escape) {
        out += &format!("{table}\n\n");
    }
    for note in notes(calibration) {
        out += &format!("- {note}\n");
    }
    if picture {
        let name = &calibration.name;
        out += &format!("\n![Wrong verdicts and missed truths]({name}.svg)\n\n{CAPTION}\n");
    }
    let [summary, rest @ ..] = &conclusions(checks)[..] else { return out };
    out += &format!("\n{summary}\n");
    rest.iter().for_each(|line| out += &format!("\n- {}", escape(line)));
    out
}

fn repeated(c: &Calibration) -> String {
    format!("{} repetitions, each of {} replicates per strategy", c.repetitions, c.replicates)
}

/// Of verdicts, and of forecasts.
fn tables(c: &Calibration, checks: &[Check], style: TableStyle, cell: fn(&str) -> String) -> Vec<String> {
    let mut tables = Vec::new();
    if !c.verdicts.is_empty() {
        let columns = [
            "claim",
            "scene",
            "N",
            "κ/n",
            "hold the truth",
            "wrong",
            "undecided",
            "not trusted",
            "wrong of trusted",
            "found",
        ];
        let rows: Vec<_> = c.verdicts.iter().map(|v| verdict_row(v, checks)).collect();
        tables.push(draw(&columns.map(str::to_owned), &rows, 2, style, cell));
    }
    if !c.forecasts.is_empty() {
        let columns = ["scene", "strategy", "error", "pilot N", "forecast N", "samples held", "seconds held"];
        let mut rows: Vec<_> = c.forecasts.iter().map(|f| forecast_row(f, checks)).collect();
        rows.extend(
            checks.iter().filter(|k| k.scene == ALL && k.what == What::ForecastSpp).map(|k| all_row(k, checks)),
        );
        tables.push(draw(&columns.map(str::to_owned), &rows, 2, style, cell));
    }
    tables
}

/// A share, what is promised, and a mark where that is broken.
fn share(check: &Check) -> String {
    let mark = if check.kept { "" } else { " ✗" };
    let (found, promised) = (f64::from(check.found) / f64::from(check.trials.max(1)), percent(check.promised));
    let promised = match check.what {
        What::Coverage | What::ForecastSpp | What::ForecastSeconds => promised,
        What::Wrong | What::Unfounded => format!("≤ {promised}"),
        What::Power | What::CoverageAtLeast => format!("≥ {promised}"),
    };
    format!("{} ({promised}){mark}", rate(found))
}

/// A share to a tenth of a percent.
fn rate(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn find<'c>(checks: &'c [Check], what: What, scene: &str, subject: &str) -> Option<&'c Check> {
    checks.iter().find(|c| c.what == what && c.scene == scene && c.subject == subject)
}

fn verdict_row(v: &Verdicts, checks: &[Check]) -> Vec<String> {
    let Some(last) = v.points.last() else { return vec![v.text.clone()] };
    let cell = |what| find(checks, what, &v.scene, &v.text).map_or_else(|| NONE.into(), share);
    let total = f64::from(last.total());
    // What is not held to its confidence is still shown.
    let covered = f64::from(last.holding()) / total;
    let promise = [What::Coverage, What::CoverageAtLeast].into_iter().find_map(|w| find(checks, w, &v.scene, &v.text));
    let covered = match (promise, v.truth) {
        (Some(check), _) => share(check),
        (None, Some(_)) => format!("({})", rate(covered)),
        _ => NONE.into(),
    };
    let of_trusted = match last.trusted() {
        0 => NONE.into(),
        trusted => rate(f64::from(last.wrong(v.holds)) / f64::from(trusted)),
    };
    let wrong = if v.holds.is_some() { What::Wrong } else { What::Unfounded };
    let found = match &v.power {
        Some(power) => format!("{} at N = {}", cell(What::Power), significant(power.spp, 2)),
        None => NONE.into(),
    };
    vec![
        v.text.clone(),
        v.scene.clone(),
        last.spp.to_string(),
        last.variance_of_variance.map_or_else(|| NONE.into(), |x| significant(x, 2)),
        covered,
        cell(wrong),
        rate(f64::from(last.open) / total),
        rate(f64::from(last.doubtful) / total),
        of_trusted,
        found,
    ]
}

fn forecast_row(f: &Forecasts, checks: &[Check]) -> Vec<String> {
    let cell = |what, held: Option<u32>| match (find(checks, what, &f.scene, &f.subject()), held) {
        (Some(check), _) => share(check),
        // Too few to be judged alone.
        (None, Some(held)) => format!("({})", rate(f64::from(held) / f64::from(f.trials))),
        (None, None) => NONE.into(),
    };
    vec![
        f.scene.clone(),
        f.strategy.clone(),
        percent(f.target),
        f.pilot.to_string(),
        significant(f.spp, 2),
        cell(What::ForecastSpp, Some(f.spp_held)),
        cell(What::ForecastSeconds, f.seconds_held),
    ]
}

/// A strategy's forecasts on all scenes together.
fn all_row(samples: &Check, checks: &[Check]) -> Vec<String> {
    let seconds = find(checks, What::ForecastSeconds, ALL, &samples.subject).map_or_else(|| NONE.into(), share);
    let none = || String::from(NONE);
    vec![ALL.into(), samples.subject.clone(), none(), none(), none(), share(samples), seconds]
}

/// What columns mean.
fn notes(c: &Calibration) -> Vec<String> {
    let mut notes = Vec::new();
    if !c.verdicts.is_empty() {
        notes.push(format!(
            "κ/n: median over repetitions of the measured variance of the variance, about kurtosis / number of samples. Up to \
             {} intervals must hold the truth as often as they say; shares in brackets are beyond it and only shown.",
            significant(TRUSTED, 1)
        ));
        notes.push(
            "hold the truth: of all intervals. wrong: verdicts against the truth or, where there is none, any; of all \
             repetitions, since that is what a confidence speaks of, and beside it of those that the tool trusts: where it \
             trusts few, they are the unlucky ones. undecided: the interval straddles the threshold. not trusted: the tool itself says that too few \
             samples carry the result. found: false claims refuted by a fresh run with as many samples as the tool asks for \
             after a pilot (median)."
                .into(),
        );
    }
    if !c.forecasts.is_empty() {
        notes.push(
            "samples held, seconds held: one more run needed as many as the 90 % prediction interval of the pilot said. Shares \
             in brackets are of too few trials to be judged alone and are judged together."
                .into(),
        );
    }
    notes
}

/// How many promises are kept, and which are not.
fn conclusions(checks: &[Check]) -> Vec<String> {
    let broken: Vec<&Check> = checks.iter().filter(|c| !c.kept).collect();
    let tested = checks.iter().filter(|c| c.p.is_some()).count();
    let mut lines = vec![match broken.len() {
        0 => format!("All {} promises are kept at the largest N", checks.len()),
        n => format!("{n} of {} promises are broken at the largest N", checks.len()),
    }];
    lines[0] += &format!(
        " ({tested} binomial tests that together give a false alarm with probability {}, Holm; {} limits).",
        about(ERROR),
        checks.len() - tested
    );
    lines.extend(broken.into_iter().map(|c| {
        let p = c.p.map(|p| format!(", p = {}", significant(p, 2))).unwrap_or_default();
        format!("{}, {}: {} of {}: {}{p}", c.scene, c.subject, c.found, c.trials, share(c))
    }));
    lines
}

const PANEL: (f64, f64) = (200.0, 130.0);
const GAP: (f64, f64) = (34.0, 58.0);
const LEFT: f64 = 70.0;
const TOP: f64 = 40.0;
const COLUMNS: usize = 3;
/// Level of the band of counts that a kept promise gives.
const BAND: f64 = 0.99;

const CAPTION: &str = "Solid: wrong verdicts, of all repetitions. Dashed: intervals that miss the truth. Grey: what chance makes \
                       of the error probability that the confidence allows, in 99 % of calibrations; a claim whose only \
                       threshold is the truth has half of it. Shares are cut at the frame.";

/// How often verdicts are wrong and intervals miss the truth, over N: a panel per claim, a line per scene. `None` without
/// verdicts at three N.
fn figure(c: &Calibration) -> Option<String> {
    let shown: Vec<&Verdicts> = c.verdicts.iter().filter(|v| v.truth.is_some() && v.points.len() >= 3).collect();
    let (mut claims, mut scenes): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for v in &shown {
        if !claims.contains(&v.text.as_str()) {
            claims.push(&v.text);
        }
        if !scenes.contains(&v.scene.as_str()) {
            scenes.push(&v.scene);
        }
    }
    let all = || shown.iter().flat_map(|v| &v.points).map(|p| p.spp as f64);
    let (from, to) = (all().reduce(f64::min)?, all().reduce(f64::max)?);
    let (rows, columns) = (claims.len().div_ceil(COLUMNS), claims.len().min(COLUMNS));
    let bottom = TOP + rows as f64 * (PANEL.1 + GAP.1) - GAP.1;
    let size = (LEFT + columns.max(2) as f64 * (PANEL.0 + GAP.0), bottom + 76.0);
    let title = format!("Calibration: {}", plain(&c.name));
    let alt = format!("{title}: share of wrong verdicts and of missed truths over N, for {} claims", claims.len());
    Some(svg(size, &title, &alt, |canvas| {
        for (i, claim) in claims.iter().enumerate() {
            let of: Vec<&Verdicts> = shown.iter().filter(|v| v.text == **claim).copied().collect();
            let left = LEFT + (i % COLUMNS) as f64 * (PANEL.0 + GAP.0);
            let top = TOP + (i / COLUMNS) as f64 * (PANEL.1 + GAP.1);
            let nominal = 1.0 - of[0].confidence;
            let frame = Frame {
                x: Axis { scale: Scale::Octaves, from: from / 1.2, to: to * 1.2, start: left, end: left + PANEL.0 },
                y: Axis { scale: Scale::Linear, from: 0.0, to: 400.0 * nominal, start: top + PANEL.1, end: top },
            };
            frame.draw_panel(canvas, true, i + COLUMNS >= claims.len());
            let band = binomial_band(c.repetitions.into(), nominal, BAND);
            let [low, high] = [band.0, band.1].map(|n| frame.y.at(100.0 * n as f64 / f64::from(c.repetitions)));
            let (a, b) = (frame.x.start, frame.x.end);
            canvas.fill(&[(a, low), (b, low), (b, high), (a, high)], GREY, 0.25);
            for v in of {
                draw_shares(canvas, &frame, v, scenes.iter().position(|s| *s == v.scene).unwrap_or(0));
            }
            let lines = wrap(&plain(claim), PANEL.0 + GAP.0 - 8.0);
            for (k, line) in lines.iter().enumerate() {
                let y = top - 12.0 - 14.0 * (lines.len() - 1 - k) as f64;
                canvas.text(line, (left - 4.0, y), Anchor::Left, TEXT - 1.0, INK);
            }
        }
        let centre = LEFT + (columns as f64 * (PANEL.0 + GAP.0) - GAP.0) / 2.0;
        canvas.text("N (samples per value and replicate)", (centre, bottom + 34.0), Anchor::Centre, TEXT, INK);
        canvas.upward_text("share of repetitions (%)", (18.0, (TOP + bottom) / 2.0), TEXT, INK);
        let mut x = LEFT;
        for (i, scene) in scenes.iter().enumerate() {
            let name = plain(scene);
            canvas.marker(i, (x + 6.0, bottom + 60.0));
            canvas.text(&name, (x + 18.0, bottom + 60.0), Anchor::Left, TEXT, INK);
            x += 36.0 + text_width(&name, TEXT);
        }
    }))
}

/// Wrong verdicts and missed truths of one claim on one scene.
fn draw_shares(canvas: &Canvas, frame: &Frame, v: &Verdicts, style: usize) {
    let line = |count: &dyn Fn(&Outcomes) -> u32| -> Vec<(f64, f64)> {
        let share = |p: &Outcomes| 100.0 * f64::from(count(p)) / f64::from(p.total());
        v.points.iter().map(|p| (frame.x.at(p.spp as f64), frame.y.at(share(p)))).collect()
    };
    let wrong = line(&|p| p.wrong(v.holds));
    let missed = line(&|p| p.total() - p.holding());
    canvas.dashes(&missed, colour(style), 1.0, (3.0, 3.0));
    canvas.line(&wrong, colour(style), 1.5);
    for at in wrong {
        canvas.marker(style, at);
    }
}

/// Text in at most two lines of a width in pixels.
fn wrap(text: &str, width: f64) -> Vec<String> {
    let mut first = String::new();
    let mut words = text.split(' ').peekable();
    while let Some(word) = words.next_if(|w| text_width(&format!("{first} {w}"), TEXT - 1.0) <= width) {
        first = format!("{first} {word}").trim_start().to_owned();
    }
    let rest: Vec<&str> = words.collect();
    match rest.is_empty() {
        true => vec![first],
        false => vec![first, fit(&rest.join(" "), width, TEXT - 1.0)],
    }
}
