//! Reports: tables, curves, figures and one page, all pure functions of a [`Record`] and the images it names. The same
//! record gives the same bytes on every machine: fonts are built in, nothing asks for the time.

mod axis;
mod calibration;
mod canvas;
mod cost;
mod csv;
mod html;
mod image;
mod junit;
mod plot;
mod probe;
mod table;

use crate::error::Result;
use crate::record::{CheckpointResult, Interval, MetricInfo, Record, write_atomically};
use crate::stats::{Metric, number};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub use calibration::{console as calibration_table, write as write_calibration};
pub use image::picture;
pub use junit::junit;
pub use table::{console, verdicts};

/// Writes `curves.csv`, `summary.md`, `report.html` and `plots/` into a folder that holds a record's `images/`; returns
/// what was written. A missing or damaged image is an error.
pub fn write(record: &Record, folder: &Path) -> Result<Vec<PathBuf>> {
    let figures = figures(record, folder)?;
    let mut files = vec![
        (folder.join("curves.csv"), csv::curves(record)?.into_bytes()),
        (folder.join("summary.md"), table::markdown(record, &figures).into_bytes()),
        (folder.join("report.html"), html::page(record, &figures).into_bytes()),
    ];
    for figure in figures.into_iter().flatten() {
        let plots = folder.join("plots");
        if let Some(svg) = figure.svg {
            files.push((plots.join(format!("{}.svg", figure.stem)), svg.into_bytes()));
        }
        files.push((plots.join(format!("{}.png", figure.stem)), figure.png));
    }
    for (path, bytes) in &files {
        write_atomically(path, bytes)?;
    }
    Ok(files.into_iter().map(|f| f.0).collect())
}

/// A figure, ready to be written.
struct Figure {
    /// File name without extension.
    stem: String,
    /// Heading.
    title: String,
    /// What it shows and how it is read.
    caption: String,
    /// What a reader who cannot see it should know.
    alt: String,
    /// What is not in it, and why.
    notes: Vec<String>,
    /// Vector form, where it has one.
    svg: Option<String>,
    /// Pixels.
    png: Vec<u8>,
}

/// All figures, one list per scene.
fn figures(record: &Record, folder: &Path) -> Result<Vec<Vec<Figure>>> {
    let mut used = BTreeSet::new();
    let mut scenes = Vec::new();
    for scene in &record.scenes {
        let stem = file_stem(&scene.name, &mut used);
        let mut figures = plot::figures(record, scene, &stem);
        figures.extend(image::figures(scene, folder, &stem)?);
        scenes.push(figures);
    }
    Ok(scenes)
}

/// A name as part of a file name: lower-case letters, digits and hyphens, different from those in `used`.
fn file_stem(name: &str, used: &mut BTreeSet<String>) -> String {
    let mut stem = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            stem.push(c.to_ascii_lowercase());
        } else if !stem.ends_with('-') && !stem.is_empty() {
            stem.push('-');
        }
    }
    let stem: String = stem.trim_end_matches('-').chars().take(60).collect();
    let stem = if stem.is_empty() { "scene".to_owned() } else { stem };
    let numbered = (2..).map(|i| format!("{stem}-{i}"));
    let free = std::iter::once(stem.clone()).chain(numbered).find(|s| !used.contains(s)).unwrap_or(stem);
    used.insert(free.clone());
    free
}

/// The headline metric as curves and tables show it: its root where it is a square, in percent where it is relative.
#[derive(Clone)]
struct Headline {
    /// "√relMSE".
    name: String,
    /// "%" or the metric's unit.
    unit: String,
    /// Whether values are roots.
    squared: bool,
    /// 100 for percent, else 1.
    scale: f64,
    /// Whether it tends to 0 as the estimate gets better.
    converges: bool,
}

impl Headline {
    /// Of a record's first metric.
    fn of(record: &Record) -> Self {
        let none = MetricInfo {
            name: "error".into(),
            formula: String::new(),
            channels: String::new(),
            squared: false,
            unit: String::new(),
        };
        let metric = record.metrics.first().unwrap_or(&none);
        let relative = metric.unit == "relative";
        Self {
            name: if metric.squared { format!("√{}", metric.name) } else { metric.name.clone() },
            unit: if relative { "%".into() } else { metric.unit.clone() },
            squared: metric.squared,
            scale: if relative { 100.0 } else { 1.0 },
            converges: Metric::ALL.iter().all(|m| m.info().name != metric.name || m.converges_to_zero()),
        }
    }

    /// "√relMSE (%)".
    fn label(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{} ({})", self.name, self.unit) }
    }

    /// A value in the unit shown; `None` for the root of a negative number and for NaN.
    fn value(&self, x: f64) -> Option<f64> {
        let x = if self.squared { x.sqrt() } else { x };
        (!x.is_nan()).then_some(x * self.scale)
    }

    /// An interval in the unit shown. Negative bounds of a square count as 0.
    fn interval(&self, i: &Interval) -> Option<Interval> {
        let bound = |b: Option<f64>| b.and_then(|b| self.value(if self.squared { b.max(0.0) } else { b }));
        Some(Interval { estimate: self.value(i.estimate)?, lower: bound(i.lower), upper: bound(i.upper), ..*i })
    }

    /// The error at a checkpoint in the unit shown; `None` where it is negative after correction.
    fn at(&self, point: &CheckpointResult) -> Option<Interval> {
        point.metrics.first().and_then(|m| self.interval(&m.mean))
    }

    /// A wanted error (in the root metric) as text: "1 %", "0.02 radiance".
    fn target(&self, target: f64) -> String {
        if self.unit == "%" {
            number::percent(target)
        } else {
            format!("{} {}", number::significant(target, 3), self.unit)
        }
    }
}

/// Text without control characters, which could steer a terminal or break a table.
pub(crate) fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
