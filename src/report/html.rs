//! `report.html`: one file with everything in it, for a browser without network or JavaScript.

use super::table::{between, scene_table, word};
use super::{Figure, Headline, plain};
use crate::analysis::cost::PREDICTION;
use crate::analysis::curve::common_spp;
use crate::record::{
    ClaimResult, Dependence, DeviceNote, Forecast, MetricInfo, Record, SceneResult, StrategyResult, Verdict,
};
use crate::stats::number::{about, confidence, format_interval, percent, significant};
use serde::Serialize;

/// The page around the results. Its name ends in `.html`, so that every value is escaped.
const TEMPLATE: &str = include_str!("templates/report.html");

#[derive(Serialize)]
struct Page<'a> {
    name: &'a str,
    question: &'a Option<String>,
    claims: Vec<Claim<'a>>,
    warnings: &'a [String],
    metrics: &'a [MetricInfo],
    scenes: Vec<Scene>,
    provenance: Vec<(&'static str, String)>,
    experiment: &'a str,
}

#[derive(Serialize)]
struct Claim<'a> {
    verdict: &'static str,
    class: &'static str,
    text: &'a str,
    scene: &'a str,
    sentence: &'a str,
    measured: String,
}

#[derive(Serialize)]
struct Scene {
    name: String,
    heading: String,
    notes: Vec<String>,
    summary: Grid,
    /// Further tables, those without rows left out.
    tables: Vec<Grid>,
    reference: Vec<(&'static str, String)>,
    figures: Vec<Picture>,
}

/// A table with a row per strategy.
#[derive(Serialize)]
struct Grid {
    title: String,
    caption: String,
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

#[derive(Serialize)]
struct Picture {
    title: String,
    caption: String,
    alt: String,
    notes: Vec<String>,
    /// Inline SVG of our own making: the only values that are not escaped.
    svg: Option<String>,
    /// Data URI, where there is no SVG.
    png: Option<String>,
    /// Width of the PNG in CSS pixels.
    width: u32,
}

/// The page.
pub(super) fn page(record: &Record, figures: &[Vec<Figure>]) -> String {
    let headline = Headline::of(record);
    let scenes = record.scenes.iter().zip(figures).map(|(s, f)| scene(record, s, &headline, f)).collect();
    let p = &record.provenance;
    let device = |d: &DeviceNote| format!("{}, because {}", d.name, d.reason);
    let devices = match &p.devices[..] {
        [] => "none of its own".to_owned(),
        devices => devices.iter().map(device).collect::<Vec<_>>().join("; "),
    };
    let page = Page {
        name: &record.name,
        question: &record.question,
        claims: record.claims.iter().map(claim).collect(),
        warnings: &record.warnings,
        metrics: &record.metrics,
        scenes,
        provenance: vec![
            ("rootn", p.version.clone()),
            ("machine", p.machine.clone()),
            ("threads", p.threads.to_string()),
            ("devices", plain(&devices)),
            ("experiment seed", p.seed.to_string()),
            ("seconds of sampling", significant(p.sampling_seconds, 4)),
        ],
        experiment: &record.experiment,
    };
    let mut templates = minijinja::Environment::new();
    templates.add_template("report.html", TEMPLATE).expect("a template that tests render");
    let template = templates.get_template("report.html").expect("added above");
    template.render(minijinja::value::Serde(&page)).expect("plain data")
}

fn claim(claim: &ClaimResult) -> Claim<'_> {
    let class = match claim.verdict {
        Verdict::Supported => "supported",
        Verdict::Refuted => "refuted",
        Verdict::Inconclusive => "inconclusive",
    };
    Claim {
        verdict: word(claim.verdict),
        class,
        text: &claim.text,
        scene: &claim.scene,
        sentence: &claim.sentence,
        measured: format!("{} at {}", format_interval(&claim.interval, ""), confidence(claim.interval.confidence)),
    }
}

fn scene(record: &Record, scene: &SceneResult, headline: &Headline, figures: &[Figure]) -> Scene {
    let table = scene_table(record, scene);
    let reference = &scene.reference;
    let mut about = vec![("made by", reference.description.clone()), ("mean value", significant(reference.mean, 4))];
    if let Some(floor) = headline.value(reference.variance) {
        let floor = format!("{} {}", significant(floor, 2), headline.unit);
        about.push(("its own error (floor)", if reference.variance == 0.0 { "none, exact".into() } else { floor }));
    }
    about.extend(reference.seconds.map(|s| ("seconds of sampling", significant(s, 3))));
    about.extend(reference.image.clone().map(|i| ("image", i)));
    let tables = [
        metrics(record, scene),
        costs(scene, headline),
        forecasts(scene, headline),
        ratios(scene),
        health(scene),
        largest(scene),
        strategies(scene),
    ];
    let summary = Grid { title: "Summary".into(), caption: String::new(), columns: table.columns, rows: table.rows };
    Scene {
        name: plain(&scene.name),
        heading: table.heading,
        notes: table.notes,
        summary,
        tables: tables.into_iter().filter(|t| !t.rows.is_empty()).collect(),
        reference: about,
        figures: figures.iter().map(picture).collect(),
    }
}

/// A table from heads and rows.
fn grid(title: &str, caption: &str, columns: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Grid {
    let columns = std::iter::once("strategy").chain(columns.iter().copied()).map(str::to_owned).collect();
    Grid { title: title.into(), caption: caption.into(), columns, rows: rows.collect() }
}

/// Every metric at the largest N that all strategies share.
fn metrics(record: &Record, scene: &SceneResult) -> Grid {
    let spp = common_spp(&scene.strategies);
    let columns: Vec<_> = record.metrics.iter().flat_map(|m| [m.name.as_str(), "without the largest 0.1 %"]).collect();
    let row = |s: &StrategyResult| {
        let point = s.checkpoints.iter().find(|c| Some(c.spp) == spp)?;
        let cells = point
            .metrics
            .iter()
            .flat_map(|m| [format_interval(&m.mean, ""), m.trimmed.map_or_else(|| "–".into(), |t| significant(t, 3))]);
        Some(std::iter::once(plain(&s.name)).chain(cells).collect())
    };
    let caption = "The metrics themselves, not their roots: mean over replicates with interval, and the same mean without \
                   the 0.1 % largest terms of each replicate. Where the two differ much, a few pixels decide.";
    let title = spp.map_or_else(|| "All metrics".into(), |n| format!("All metrics at N = {n}"));
    grid(&title, caption, &columns, scene.strategies.iter().filter_map(row))
}

/// Variance over the first strategy's, with the spread over pixels.
fn ratios(scene: &SceneResult) -> Grid {
    let row = |s: &StrategyResult| {
        let quantiles = s.variance_ratio.and_then(|r| r.quantiles).map(|q| q.map(|v| significant(v, 3)).to_vec());
        let ratio = s.variance_ratio.map_or_else(|| "–".into(), |r| format_interval(&r.ratio, ""));
        let mut row = vec![plain(&s.name), format_interval(&s.relative_variance, ""), ratio];
        row.extend(quantiles.unwrap_or_else(|| vec!["–".into(); 5]));
        row
    };
    let mut caption =
        "Relative variance of one sample, its ratio to the first strategy's, and quantiles of that ratio over \
                       pixels: the ratio of a whole image may hide that most pixels say otherwise."
            .to_owned();
    if scene.strategies.iter().any(|s| s.dependence != Dependence::Independent) {
        caption.push_str(
            " Where samples depend on one another the variance is N times that of the replicates' means at the largest N. \
             A single pixel then knows it from so few means that the outer quantiles show this noise too.",
        );
    }
    let columns = ["relative variance", "ratio", "5 %", "25 %", "50 %", "75 %", "95 %"];
    grid("Variance", &caption, &columns, scene.strategies.iter().map(row))
}

/// What each wanted error costs.
fn costs(scene: &SceneResult, headline: &Headline) -> Grid {
    let cell = |s: &StrategyResult, t: f64| {
        let Some(cost) = s.cost.iter().find(|c| c.target == t) else { return "–".to_owned() };
        let mark = if cost.extrapolated { "*" } else { "" };
        let seconds = cost.seconds.map_or_else(|| "no basis".into(), |i| format!("{} s", format_interval(&i, mark)));
        let spp = cost.spp.ceil();
        // Whole numbers as such, but not twenty digits of them.
        let spp = if spp < 1e6 { spp.to_string() } else { significant(spp, 3) };
        format!("{seconds}, N ≈ {spp}")
    };
    let row =
        |s: &StrategyResult| std::iter::once(plain(&s.name)).chain(scene.targets.iter().map(|&t| cell(s, t))).collect();
    let caption =
        "Seconds of sampling with interval, and samples per value. *: extrapolated beyond the largest N measured.";
    let targets: Vec<_> = scene.targets.iter().map(|&t| headline.target(t)).collect();
    let columns: Vec<_> = targets.iter().map(String::as_str).collect();
    grid(
        "Cost of each wanted error",
        caption,
        &columns,
        scene.strategies.iter().filter(|s| !s.cost.is_empty()).map(row),
    )
}

/// What one more run will need for each wanted error.
fn forecasts(scene: &SceneResult, headline: &Headline) -> Grid {
    let cell = |s: &StrategyResult, t: f64| {
        let forecast = s.cost.iter().find(|c| c.target == t).and_then(|c| c.forecast);
        let Some(Forecast { spp, seconds, .. }) = forecast else { return "–".to_owned() };
        format!("{} {}, {} s", between(&spp), scene.abscissa, between(&seconds))
    };
    let row = |s: &StrategyResult| {
        let halving = s.cost.iter().find_map(|c| c.forecast)?.halving;
        let cells = scene.targets.iter().map(|&t| cell(s, t));
        let halving = format!("{} times as much", significant(halving, 2));
        Some(std::iter::once(plain(&s.name)).chain(cells).chain([halving]).collect())
    };
    let caption = format!(
        "What one more run of this length needs for each wanted error: {} prediction intervals, from the spread of the \
         replicates' errors and times. Last column: what each halving of the error costs.",
        percent(PREDICTION)
    );
    let targets: Vec<_> = scene.targets.iter().map(|&t| headline.target(t)).collect();
    let columns: Vec<_> = targets.iter().map(String::as_str).chain(["half the error"]).collect();
    grid("Forecast", &caption, &columns, scene.strategies.iter().filter_map(row))
}

/// The checks of how far figures on variance can be trusted.
fn health(scene: &SceneResult) -> Grid {
    let row = |s: &StrategyResult| {
        let h = s.health.as_ref()?;
        let tail = h.tail_index.map(|[k, e]| format!("{} ± {}", significant(k, 2), significant(e, 1)));
        Some(vec![
            plain(&s.name),
            h.word(),
            format!("± {}", about(h.variance_of_variance.sqrt())),
            tail.unwrap_or_else(|| "–".into()),
            about(h.largest_share),
            about(h.unseen_share()),
            about(h.top_share),
            h.drift.map_or_else(|| "–".into(), |d| format_interval(&d, "")),
            about(h.zero_fraction),
        ])
    };
    let caption = "The checks of MCNP and Geant4 on the samples behind every figure. Variance known to: its relative standard \
                   error by the samples' fourth moments. Tail index k: moments of the samples above the (1/k)-th look infinite \
                   (– where too few samples stand out). Not seen: share of the variance to be expected in samples larger than \
                   the largest seen; beyond 5 % no verdict rests on it. Drift: the power of \
                   N by which 1/(error² × seconds) moves in the second half of the curve; below 0 is bad, above 0 is the \
                   merit of points that are better than random.";
    let columns = [
        "health",
        "variance known to",
        "tail index",
        "largest sample",
        "not seen",
        "largest 0.1 % of values",
        "drift",
        "samples = 0",
    ];
    grid("Health", caption, &columns, scene.strategies.iter().filter_map(row))
}

/// The samples that have most of the variance.
fn largest(scene: &SceneResult) -> Grid {
    let rows = scene.strategies.iter().flat_map(|s| {
        s.health.iter().flat_map(|h| h.largest.iter().take(3)).map(|l| {
            let [x, y] = l.pixel;
            let place = [format!("{x}, {y}"), l.channel.to_string(), l.replicate.to_string(), l.sample.to_string()];
            let figures = [significant(l.value, 4), about(l.share)];
            std::iter::once(plain(&s.name)).chain(place).chain(figures).collect()
        })
    });
    let caption = "The three samples with the largest share of the variance (weighted like the relative variance); rootn replay \
                   traces them again, vertex by vertex.";
    let columns = ["pixel", "channel", "replicate", "sample", "value", "share of the variance"];
    grid("Largest samples", caption, &columns, rows)
}

/// What each strategy is.
fn strategies(scene: &SceneResult) -> Grid {
    // The axes under their names in experiment files, in the order of the type.
    let axes = |s: &StrategyResult| match serde_json::to_value(s.strategy) {
        Ok(serde_json::Value::Object(axes)) => axes,
        _ => serde_json::Map::new(),
    };
    let word = |v: &serde_json::Value| match v {
        serde_json::Value::Null => "the scene's".to_owned(),
        serde_json::Value::String(s) => s.clone(),
        other => other.to_string(),
    };
    let names = scene.strategies.first().map(|s| axes(s).keys().map(|k| k.replace('_', " ")).collect::<Vec<_>>());
    let names = names.unwrap_or_default();
    let columns: Vec<_> = ["device", "samples", "set-up (s)", "sampling (s)", "wall clock (s)"]
        .into_iter()
        .chain(names.iter().map(String::as_str))
        .collect();
    let row = |s: &StrategyResult| {
        let dependence = serde_json::to_value(s.dependence).map_or_else(|_| String::new(), |v| word(&v));
        let last = s.checkpoints.last();
        let sum = |seconds: Option<&Vec<f64>>| seconds.filter(|s| !s.is_empty()).map_or(f64::NAN, |s| s.iter().sum());
        let seconds = [s.setup_seconds, sum(last.map(|c| &c.seconds)), sum(last.map(|c| &c.wall_seconds))];
        let mut row = vec![plain(&s.name), plain(&s.device), dependence];
        row.extend(seconds.map(|s| if s.is_finite() { significant(s, 2) } else { "–".into() }));
        row.extend(axes(s).values().map(word));
        row
    };
    grid("Strategies", "How each one draws its samples.", &columns, scene.strategies.iter().map(row))
}

fn picture(figure: &Figure) -> Picture {
    // Eight bytes of signature, then the IHDR chunk: length, name, width.
    let width = figure.png.get(16..20).map_or(0, |b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]));
    Picture {
        title: figure.title.clone(),
        caption: figure.caption.clone(),
        alt: figure.alt.clone(),
        notes: figure.notes.clone(),
        // Inside HTML the namespace is implied.
        svg: figure.svg.as_ref().map(|s| s.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1)),
        png: figure.svg.is_none().then(|| format!("data:image/png;base64,{}", base64(&figure.png))),
        width: width / 2,
    }
}

/// Base64 with padding (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let group = chunk.iter().enumerate().fold(0u32, |g, (i, &b)| g | u32::from(b) << (16 - 8 * i));
        for i in 0..4 {
            let digit = DIGITS[(group >> (18 - 6 * i)) as usize & 63] as char;
            out.push(if i <= chunk.len() { digit } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    /// The vectors of RFC 4648, section 10.
    #[test]
    fn base64_vectors() {
        let cases =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")];
        for (plain, encoded) in cases {
            assert_eq!(super::base64(plain.as_bytes()), encoded);
        }
    }
}
