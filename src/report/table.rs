//! The results as text: for the console and as Markdown.

use super::{Figure, Headline, plain};
use crate::analysis::cost::PREDICTION;
use crate::analysis::curve::common_spp;
use crate::analysis::health::RestsOn;
use crate::record::{ClaimResult, Forecast, Interval, Record, SceneResult, StrategyResult, Verdict};
use crate::sampling::strategy::Technique;
use crate::stats::number::{format_half_width, format_interval, percent, range, significant};
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle, presets};

/// One scene's results as cells, with what must be said below them.
pub(super) struct SceneTable {
    /// The scene and its field.
    pub heading: String,
    /// Column heads.
    pub columns: Vec<String>,
    /// One row per strategy.
    pub rows: Vec<Vec<String>>,
    /// Definitions and marks.
    pub notes: Vec<String>,
    /// What one more run will need, a line per strategy; empty where nothing can be said.
    forecasts: Vec<String>,
}

/// What tables put where there is no figure.
pub(super) const NONE: &str = "–";

/// How tables look on a terminal.
pub(super) const CONSOLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));
/// How they look in Markdown.
pub(super) const MARKDOWN: TableStyle = presets::ASCII_MARKDOWN;

/// The table of one scene.
pub(super) fn scene_table(record: &Record, scene: &SceneResult) -> SceneTable {
    let headline = Headline::of(record);
    let spp = common_spp(&scene.strategies);
    let target = nearest_target(scene);
    let at = spp.map_or_else(|| "at equal N".into(), |n| format!("at N = {n}"));
    let mut columns = vec![
        "strategy".to_owned(),
        format!("{} {at}{}", headline.name, unit_suffix(&headline.unit)),
        "slope".to_owned(),
        "time/sample (µs)".to_owned(),
    ];
    columns.extend(target.map(|t| format!("seconds to {}", headline.target(t))));
    columns.push("efficiency".to_owned());
    let health = scene.strategies.iter().any(|s| s.health.is_some());
    if health {
        columns.push("health".to_owned());
    }
    let devices = scene.strategies.iter().any(|s| s.device != scene.strategies[0].device);
    if devices {
        columns.insert(1, "device".to_owned());
    }
    let rows = scene.strategies.iter().enumerate().map(|(index, strategy)| {
        let mut row = vec![
            plain(&strategy.name),
            error_cell(&headline, strategy, spp),
            strategy.slope.as_ref().map_or_else(|| NONE.into(), |s| format_interval(&s.slope, "")),
            format_interval(&scaled(&strategy.seconds_per_sample, 1e6), ""),
        ];
        row.extend(target.map(|t| cost_cell(strategy, t)));
        row.push(match &strategy.efficiency_ratio {
            Some(ratio) => format_interval(ratio, "×"),
            None if index == 0 => "1×".into(),
            None => NONE.into(),
        });
        if health {
            row.push(strategy.health.as_ref().map_or_else(|| NONE.into(), |h| h.word()));
        }
        if devices {
            row.insert(1, plain(&strategy.device));
        }
        row
    });
    let rows = rows.collect();
    let (notes, forecasts) = (notes(record, scene, &headline, spp), forecasts(scene, &headline));
    SceneTable { heading: heading(scene), columns, rows, notes, forecasts }
}

/// "cornell: 64 × 64 pixels, 3 channels, paths of at most 8 edges".
fn heading(scene: &SceneResult) -> String {
    let [width, height, channels] = scene.shape;
    let field = match (width * height, channels) {
        (1, 1) => "one number".to_owned(),
        (_, 1) => format!("{width} × {height} values"),
        _ => format!("{width} × {height} pixels, {channels} channels"),
    };
    let depth = scene.max_depth.map(|d| format!(", paths of at most {d} edges")).unwrap_or_default();
    format!("{}: {field}{depth}", plain(&scene.name))
}

/// " (%)", or nothing.
fn unit_suffix(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" ({unit})") }
}

/// The target nearest to 1 %.
fn nearest_target(scene: &SceneResult) -> Option<f64> {
    let distance = |t: f64| (t / 0.01).ln().abs();
    scene.targets.iter().copied().filter(|t| *t > 0.0).min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
}

/// An interval in other units.
fn scaled(i: &Interval, factor: f64) -> Interval {
    let times = |b: Option<f64>| b.map(|b| b * factor);
    Interval { estimate: i.estimate * factor, lower: times(i.lower), upper: times(i.upper), ..*i }
}

/// The error at N.
fn error_cell(headline: &Headline, strategy: &StrategyResult, spp: Option<u64>) -> String {
    let Some(point) = strategy.checkpoints.iter().find(|c| Some(c.spp) == spp) else { return NONE.into() };
    if let Some(error) = headline.at(point) {
        return format_half_width(&error);
    }
    let upper = point.metrics.first().and_then(|m| m.mean.upper).and_then(|u| headline.value(u));
    upper.map_or_else(|| "< floor†".into(), |u| format!("< {}†", significant(u, 2)))
}

/// Seconds to an error; a star marks extrapolation.
fn cost_cell(strategy: &StrategyResult, target: f64) -> String {
    let Some(cost) = strategy.cost.iter().find(|c| c.target == target) else { return NONE.into() };
    let mark = if cost.extrapolated { "*" } else { "" };
    cost.seconds.as_ref().map_or_else(|| NONE.into(), |s| format_interval(s, mark))
}

/// What stands below a scene's table.
fn notes(record: &Record, scene: &SceneResult, headline: &Headline, spp: Option<u64>) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(metric) = record.metrics.first() {
        let percent = if headline.unit == "%" { ", in percent" } else { "" };
        let root = if metric.squared { format!("; the table shows its root{percent}") } else { percent.to_owned() };
        notes.push(format!("{} = {}; {}{root}.", metric.name, metric.formula, metric.channels));
    }
    let replicates = |s: &StrategyResult| s.checkpoints.iter().map(|c| c.seconds.len()).max().unwrap_or(0);
    let counts = scene.strategies.iter().map(replicates);
    let (low, high) = (counts.clone().min().unwrap_or(0), counts.max().unwrap_or(0));
    let range = if low == high { low.to_string() } else { format!("{low} to {high}") };
    let level = scene.strategies.first().map_or(0.95, |s| s.seconds_per_sample.confidence);
    let intervals = if high > 1 {
        format!("± and brackets: {} intervals over replicates", percent(level))
    } else {
        "one replicate, hence no intervals".to_owned()
    };
    notes.push(format!("{range} replicate{}; {intervals}.", if high == 1 { "" } else { "s" }));
    let direct = scene.strategies.iter().filter(|s| s.strategy.technique == Technique::Direct);
    let direct: Vec<String> = direct.map(|s| plain(&s.name)).collect();
    if !direct.is_empty() {
        notes.push(format!("Emission and direct light only: {}.", direct.join(", ")));
    }
    notes.push(format!("Reference: {}.", plain(&scene.reference.description).trim_end_matches('.')));
    if let Some(first) = scene.strategies.first().filter(|_| scene.strategies.len() > 1) {
        let name = plain(&first.name);
        notes.push(format!("Efficiency = 1/(relative variance × seconds per sample), over that of {name}."));
    }
    notes.extend(marks(scene, headline, spp));
    notes
}

/// What one more run will need for the error that the table speaks of, a line per strategy.
fn forecasts(scene: &SceneResult, headline: &Headline) -> Vec<String> {
    let Some(target) = nearest_target(scene) else { return Vec::new() };
    let line = |s: &StrategyResult| {
        let cost = s.cost.iter().find(|c| c.target == target)?;
        if let (None, Some(why)) = (&cost.forecast, s.health.as_ref().and_then(|h| h.distrust(RestsOn::Variance))) {
            return Some(format!("{}: none can be given; {why}.", plain(&s.name)));
        }
        let Forecast { spp, seconds, halving } = cost.forecast?;
        Some(format!(
            "{}: {} error needs {} {}, {} s; half the error {} times as much.",
            plain(&s.name),
            headline.target(target),
            between(&spp),
            scene.abscissa,
            between(&seconds),
            significant(halving, 2)
        ))
    };
    let mut lines: Vec<String> = scene.strategies.iter().filter_map(line).collect();
    if !lines.is_empty() {
        lines.insert(0, format!("Forecast for one more run ({} prediction intervals):", percent(PREDICTION)));
    }
    lines
}

/// "5100 to 5600".
pub(super) fn between(i: &Interval) -> String {
    match (i.lower, i.upper) {
        (Some(lower), Some(upper)) => range(i.estimate, lower, upper).join(" to "),
        _ => significant(i.estimate, 2),
    }
}

/// Notes on what is marked or missing in the table.
fn marks(scene: &SceneResult, headline: &Headline, spp: Option<u64>) -> Vec<String> {
    let mut notes = Vec::new();
    let target = nearest_target(scene);
    if scene
        .strategies
        .iter()
        .any(|s| s.cost.iter().any(|c| Some(c.target) == target && c.extrapolated && c.seconds.is_some()))
    {
        notes.push("* extrapolated beyond the largest N measured.".into());
    }
    let negative = |s: &&StrategyResult| {
        s.checkpoints.iter().any(|c| Some(c.spp) == spp && !c.metrics.is_empty() && headline.at(c).is_none())
    };
    if scene.strategies.iter().any(|s| negative(&s)) {
        notes.push("† the error is below the reference's own noise: its corrected square is not positive. The bound is the interval's upper end.".into());
    }
    if spp.is_none() {
        notes.push("There is no N at which every strategy has an error that the reference can judge.".into());
    }
    for strategy in &scene.strategies {
        let name = plain(&strategy.name);
        let refused: Vec<_> = strategy.checkpoints.iter().filter_map(|c| Some((c.spp, c.refused.as_ref()?))).collect();
        if let (Some((from, reason)), Some((to, _))) = (refused.first(), refused.last()) {
            let at = if from == to { from.to_string() } else { format!("{from} to {to}") };
            notes.push(format!("{name}: refused at N = {at}: {}.", plain(reason).trim_end_matches('.')));
        }
        if strategy.slope.is_none() {
            notes.push(format!("{name}: no slope, {}.", why_no_slope(strategy, headline)));
        }
        if strategy.non_finite.count > 0 {
            let first = strategy.non_finite.first.first();
            let place = first.map(|(r, p, s)| format!(", first at replicate {r}, pixel {p}, sample {s}"));
            let (count, place) = (strategy.non_finite.count, place.unwrap_or_default());
            notes.push(format!("{name}: {count} non-finite samples kept out of the mean{place}."));
        }
    }
    notes
}

/// Why no slope could be fitted.
fn why_no_slope(strategy: &StrategyResult, headline: &Headline) -> &'static str {
    let values = || strategy.checkpoints.iter().flat_map(|c| c.metrics.first()).flat_map(|m| &m.values);
    if !headline.converges {
        "the metric does not tend to 0"
    } else if strategy.checkpoints.iter().any(|c| c.seconds.len() < 2) {
        "it takes two replicates"
    } else if strategy.checkpoints.len() < 3 {
        "it takes three checkpoints"
    } else if values().all(|v| *v == 0.0) {
        "the error is 0 throughout"
    } else {
        "fewer than three checkpoints have an error that the reference can judge and that is positive in every replicate"
    }
}

/// The verdict as one word.
pub(super) const fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Supported => "SUPPORTED",
        Verdict::Refuted => "REFUTED",
        Verdict::Inconclusive => "INCONCLUSIVE",
    }
}

/// "SUPPORTED (cornell): text. Sentence".
fn claim_line(claim: &ClaimResult) -> String {
    let text = plain(&claim.text);
    let text = text.trim_end_matches('.');
    format!("({}) {text}. {}", plain(&claim.scene), plain(&claim.sentence))
}

/// Columns laid out in a style; the first ones, of names, to the left.
pub(super) fn draw(
    columns: &[String],
    rows: &[Vec<String>],
    names: usize,
    style: TableStyle,
    cell: impl Fn(&str) -> String,
) -> String {
    let mut out = Table::new();
    out.load_style(style).set_content_arrangement(ContentArrangement::Disabled);
    out.set_header(columns.iter().map(|c| cell(c)).collect::<Vec<_>>());
    for row in rows {
        out.add_row(row.iter().map(|c| cell(c)).collect::<Vec<_>>());
    }
    for column in out.column_iter_mut().skip(names) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    out.trim_fmt()
}

/// The verdicts alone: for a terminal, or as Markdown.
pub fn verdicts(record: &Record, markdown: bool) -> String {
    let mut out = match markdown {
        true => format!(
            "### {}\n\n| verdict | scene | claim | measured |\n| --- | --- | --- | --- |\n",
            escape(&record.name)
        ),
        false => format!("{}\n", plain(&record.name)),
    };
    for claim in &record.claims {
        out += &match markdown {
            true => {
                let cells = [&claim.scene, &claim.text, &claim.sentence].map(|text| escape(text));
                format!("| **{}** | {} |\n", word(claim.verdict), cells.join(" | "))
            }
            false => format!("  {:<12}  {}\n", word(claim.verdict), claim_line(claim)),
        };
    }
    if record.claims.is_empty() {
        out += if markdown { "| – | – | nothing is claimed | – |\n" } else { "  nothing is claimed\n" };
    }
    out + "\n"
}

/// The results for a terminal: a table per scene with notes, then claims, then warnings. No colours, no control characters.
pub fn console(record: &Record) -> String {
    let mut out = String::new();
    let mut line = |text: &str| out.extend([text, "\n"]);
    let tables: Vec<SceneTable> = record.scenes.iter().map(|scene| scene_table(record, scene)).collect();
    // What holds for every table is said once, below the last.
    let several = tables.len() > 1;
    let common = |note: &&String| several && tables.iter().all(|t| t.notes.contains(note));
    for table in &tables {
        line(&table.heading);
        line("");
        line(&draw(&table.columns, &table.rows, 1, CONSOLE, str::to_owned));
        line("");
        let mut notes = table.notes.iter().filter(|n| !common(n)).peekable();
        if notes.peek().is_some() {
            notes.for_each(|note| line(&format!("  {note}")));
            line("");
        }
        if let Some((head, lines)) = table.forecasts.split_first() {
            line(&format!("  {head}"));
            lines.iter().for_each(|forecast| line(&format!("    {forecast}")));
            line("");
        }
    }
    if let Some(first) = tables.first().filter(|_| several) {
        first.notes.iter().filter(common).for_each(|note| line(&format!("  {note}")));
        line("");
    }
    if !record.claims.is_empty() {
        line("Claims");
        for claim in &record.claims {
            line(&format!("  {:<12}  {}", word(claim.verdict), claim_line(claim)));
        }
        line("");
    }
    if !record.warnings.is_empty() {
        line("Warnings");
        for warning in &record.warnings {
            line(&format!("  {}", plain(warning)));
        }
        line("");
    }
    while out.ends_with("\n\n") {
        out.pop();
    }
    out
}

/// The same as Markdown, with each scene's first figure.
pub(super) fn markdown(record: &Record, figures: &[Vec<Figure>]) -> String {
    let mut out = format!("# {}\n\n", escape(&record.name));
    let mut line = |text: &str| out.extend([text, "\n"]);
    if let Some(question) = &record.question {
        line(&format!("{}\n", escape(question)));
    }
    for (scene, figures) in record.scenes.iter().zip(figures) {
        let table = scene_table(record, scene);
        line(&format!("## {}\n", escape(&table.heading)));
        line(&draw(&table.columns, &table.rows, 1, MARKDOWN, escape));
        line("");
        for note in &table.notes {
            line(&format!("- {}", escape(note)));
        }
        line("");
        if let Some((head, lines)) = table.forecasts.split_first() {
            line(&format!("{}\n", escape(head)));
            lines.iter().for_each(|forecast| line(&format!("- {}", escape(forecast))));
            line("");
        }
        if let Some(figure) = figures.first() {
            let kind = if figure.svg.is_some() { "svg" } else { "png" };
            line(&format!("![{}](plots/{}.{kind})\n", escape(&figure.title), figure.stem));
        }
    }
    if !record.claims.is_empty() {
        line("## Claims\n");
        for claim in &record.claims {
            line(&format!("- **{}** {}", word(claim.verdict), escape(&claim_line(claim))));
        }
        line("");
    }
    if !record.warnings.is_empty() {
        line("## Warnings\n");
        for warning in &record.warnings {
            line(&format!("- {}", escape(warning)));
        }
        line("");
    }
    let p = &record.provenance;
    let devices: String = p.devices.iter().map(|d| format!("{}, ", escape(&d.name))).collect();
    line(&format!(
        "rootn {}, {}, {devices}{} threads, seed {}, {} s of sampling.",
        escape(&p.version),
        escape(&p.machine),
        p.threads,
        p.seed,
        significant(p.sampling_seconds, 3)
    ));
    out
}

/// Text that Markdown shows as it is.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in plain(text).chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '\\' | '`' | '*' | '_' | '|' | '[' | ']' | '#' | '~' => out.extend(['\\', c]),
            _ => out.push(c),
        }
    }
    out
}
