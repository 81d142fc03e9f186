//! `report.html`: one file with everything in it, for a browser without network or JavaScript.

use super::number::{format_interval, percent, significant};
use super::table::{scene_table, word};
use super::{Figure, Headline};
use crate::record::{MetricInfo, Record, SceneResult, Verdict};
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
    heading: String,
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
    notes: Vec<String>,
    ratios: Vec<Vec<String>>,
    costs: Costs,
    reference: Vec<(&'static str, String)>,
    figures: Vec<Picture>,
}

/// What each wanted error costs, a row per strategy.
#[derive(Serialize)]
struct Costs {
    targets: Vec<String>,
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

fn claim(claim: &crate::record::ClaimResult) -> Claim<'_> {
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
        measured: format!("{} at {}", format_interval(&claim.interval, ""), percent(claim.interval.confidence)),
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
    Scene {
        heading: table.heading,
        columns: table.columns,
        rows: table.rows,
        notes: table.notes,
        ratios: ratios(scene),
        costs: costs(scene, headline),
        reference: about,
        figures: figures.iter().map(picture).collect(),
    }
}

/// Variance over the first strategy's, with the spread over pixels.
fn ratios(scene: &SceneResult) -> Vec<Vec<String>> {
    let row = |s: &crate::record::StrategyResult| {
        let ratio = s.variance_ratio?;
        let mut row =
            vec![s.name.clone(), format_interval(&s.relative_variance, ""), format_interval(&ratio.ratio, "")];
        let quantiles = ratio.quantiles.map_or_else(|| vec!["–".into(); 5], |q| q.map(|v| significant(v, 3)).to_vec());
        row.extend(quantiles);
        Some(row)
    };
    scene.strategies.iter().filter_map(row).collect()
}

fn costs(scene: &SceneResult, headline: &Headline) -> Costs {
    let cell = |s: &crate::record::StrategyResult, t: f64| {
        let Some(cost) = s.cost.iter().find(|c| c.target == t) else { return "–".to_owned() };
        let mark = if cost.extrapolated { "*" } else { "" };
        let seconds = cost.seconds.map_or_else(|| "no basis".into(), |i| format!("{} s", format_interval(&i, mark)));
        format!("{seconds}, N ≈ {}", significant(cost.spp, 3))
    };
    let row = |s: &crate::record::StrategyResult| {
        let mut row = vec![s.name.clone()];
        row.extend(scene.targets.iter().map(|&t| cell(s, t)));
        row
    };
    let any = scene.strategies.iter().any(|s| !s.cost.is_empty());
    Costs {
        targets: scene.targets.iter().map(|&t| headline.target(t)).collect(),
        rows: if any { scene.strategies.iter().map(row).collect() } else { vec![] },
    }
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
