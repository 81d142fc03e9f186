//! What a run computes and what it finds on disk.

use crate::determinism::{cornell, experiment, left, results, run_file};
use rootn::estimator::integrand::{Integrand, IntegrandEstimator};
use rootn::estimator::{Cell, Estimate, Estimator, Shape};
use rootn::record::{Dependence, Record};
use rootn::run::{Contender, Options, Plan, PlannedScene, ReferencePlan, Reuse, Stop, powers_of_two, run};
use rootn::sampling::Sequence;
use rootn::sampling::strategy::Preset;
use rootn::stats::Metric;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts the samples drawn.
struct Counting<'a> {
    inner: IntegrandEstimator,
    drawn: &'a AtomicU64,
}

impl Estimator for Counting<'_> {
    fn shape(&self) -> Shape {
        self.inner.shape()
    }
    fn identity(&self) -> String {
        self.inner.identity()
    }
    fn dependence(&self) -> Dependence {
        self.inner.dependence()
    }
    fn progressive(&self) -> bool {
        self.inner.progressive()
    }
    fn estimate(&self, cell: &Cell, checkpoint: u64, previous: &mut Option<Estimate>) -> rootn::Result<Estimate> {
        let before = previous.as_ref().map_or(0, |p| p.abscissa);
        self.drawn.fetch_add((checkpoint - before) * self.shape().pixels() as u64, Ordering::Relaxed);
        self.inner.estimate(cell, checkpoint, previous)
    }
}

/// Checkpoints computed, checkpoints reused, samples drawn per value.
fn counted(out: &Path, sequence: Sequence, checkpoints: Vec<u64>, fresh: bool) -> (u64, u64, u64) {
    let drawn = AtomicU64::new(0);
    let inner = IntegrandEstimator { integrand: Integrand::Gaussian2d, size: [4, 4], sequence };
    let contender = Contender {
        name: "it".into(),
        device: "cpu".into(),
        strategy: Preset::Mis.strategy(),
        estimator: Box::new(Counting { inner, drawn: &drawn }),
    };
    let plan = Plan {
        name: "counted".into(),
        question: None,
        experiment: String::new(),
        seed: 1,
        replicates: 2,
        stop: Stop::Never,
        checkpoints,
        metrics: vec![Metric::RelMse],
        targets: vec![0.01],
        probes: Vec::new(),
        log_pixels: false,
        scenes: vec![PlannedScene {
            name: "scene".into(),
            contenders: vec![contender],
            reference: ReferencePlan::Exact(Integrand::Gaussian2d.integral()),
            max_depth: None,
            rendered: true,
        }],
        claims: Vec::new(),
        devices: Vec::new(),
        warnings: Vec::new(),
    };
    let options = Options { out: out.to_owned(), fresh, quiet: true };
    let Reuse { computed, reused } = run(&plan, &options).unwrap().1;
    drop(plan);
    (computed, reused, drawn.into_inner() / 16)
}

#[test]
fn longer_runs_continue_from_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let go = |spp, fresh| counted(folder.path(), Sequence::Independent, powers_of_two(spp), fresh);
    // Two replicates of seven checkpoints; one sample more warms up.
    assert_eq!(go(64, false), (14, 0, 2 * 64 + 1));
    assert_eq!(go(64, false), (0, 14, 0));
    // Doubled: only the new samples.
    assert_eq!(go(128, false), (2, 14, 2 * 64 + 1));
    // Halved: nothing; the longer state stays.
    assert_eq!(go(32, false), (0, 12, 0));
    assert_eq!(go(256, false), (2, 16, 2 * 128 + 1));
    // A checkpoint between others is computed from the start, for the state is beyond it …
    assert_eq!(go(100, false), (2, 14, 2 * 100 + 1));
    // … and the state that is further on is still there.
    assert_eq!(go(512, false), (2, 18, 2 * 256 + 1));
    assert_eq!(go(64, true), (14, 0, 2 * 64 + 1));
    assert_eq!(go(512, false), (6, 14, 2 * 448 + 1));
}

#[test]
fn points_that_depend_on_their_number_are_drawn_for_each_n() {
    let folder = tempfile::tempdir().unwrap();
    let go = |spp| counted(folder.path(), Sequence::Stratified, powers_of_two(spp), false);
    assert_eq!(go(64), (14, 0, 2 * 127 + 1));
    assert_eq!(go(64), (0, 14, 0));
    assert_eq!(go(128), (2, 14, 2 * 128 + 1));
    assert_eq!(go(100), (2, 14, 2 * 100 + 1));
}

struct Small {
    folder: tempfile::TempDir,
    scene: PathBuf,
}

impl Small {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.xml");
        std::fs::copy(cornell(), &scene).unwrap();
        Self { folder, scene }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    /// Runs with more lines at the end of the file and changes in it; (computed, reused) and the record.
    fn run(&self, spp: u64, rest: &str, changes: &[(&str, &str)]) -> ((u64, u64), Record) {
        let path = experiment(self.folder.path(), &self.scene, spp, rest);
        let mut text = std::fs::read_to_string(&path).unwrap();
        for (from, to) in changes {
            assert!(text.contains(from));
            text = text.replace(from, to);
        }
        std::fs::write(&path, text).unwrap();
        let (record, reuse) = run_file(&path, &self.out(), false).unwrap();
        ((reuse.computed, reuse.reused), record)
    }
}

/// Three strategies of three replicates at 1, 2, 4 … 32, and four replicates of the reference.
const ALL: u64 = 3 * 3 * 6 + 4;

#[test]
fn what_does_not_change_samples_is_reused() {
    let small = Small::new();
    assert_eq!(small.run(32, "", &[]).0, (ALL, 0));
    let before = left(&small.out(), "small");
    assert_eq!(small.run(32, "", &[]).0, (0, ALL));
    assert_eq!(left(&small.out(), "small"), before);
    let claim = "[[claim]]\ntext = \"no slower\"\nkind = \"slope\"\nof = \"sobol\"\nat_most = -0.3\n";
    let (reuse, record) = small.run(32, claim, &[]);
    assert_eq!((reuse, record.claims.len()), ((0, ALL), 1));
    for (from, to) in [
        ("name = \"small\"\n", "name = \"renamed\"\n"),
        ("max_depth", "metric = \"MAE\"\nmax_depth"),
        ("max_depth", "targets = [0.5]\nmax_depth"),
        ("max_depth", "log = \"pixels\"\nmax_depth"),
        ("probes = [[3, 4]]", "probes = [[0, 0], [7, 7]]"),
        ("preset = \"mis\"", "preset = \"mis\"\nname = \"another name\""),
        ("preset = \"mis\"", "preset = \"mis\"\nheuristic = \"power\""),
        ("[budget]", "name = \"box\"\n[budget]"),
    ] {
        assert_eq!(small.run(32, "", &[(from, to)]).0, (0, ALL), "{to}");
    }
    // Fewer replicates, fewer checkpoints, one strategy less.
    assert_eq!(small.run(8, "", &[("replicates = 3", "replicates = 2")]).0, (0, 3 * 2 * 4 + 4));
    assert_eq!(small.run(64, "", &[]).0, (9, ALL), "doubled");
    assert_eq!(small.run(32, "[[strategy]]\npreset = \"light\"\n", &[]).0, (18, ALL), "one strategy more");
    // Words of the scene file that mean nothing.
    let text = std::fs::read_to_string(&small.scene).unwrap();
    std::fs::write(&small.scene, text.replace("</scene>", "\n<!-- nothing -->\n</scene>")).unwrap();
    assert_eq!(small.run(32, "", &[]).0, (0, ALL), "a comment");
}

#[test]
fn what_changes_samples_is_computed_again() {
    let small = Small::new();
    assert_eq!(small.run(32, "", &[]).0, (ALL, 0));
    for (from, to) in
        [("width = 8", "width = 9"), ("max_depth = 4", "max_depth = 5"), ("replicates = 3", "replicates = 3\nseed = 7")]
    {
        assert_eq!(small.run(32, "", &[(from, to)]).0, (ALL, 0), "{to}");
    }
    assert_eq!(small.run(32, "", &[("spp = 16", "spp = 8")]).0, (4, ALL - 4), "the reference alone");
    assert_eq!(small.run(32, "", &[("preset = \"mis\"", "heuristic = \"balance\"")]).0, (18, ALL - 18), "one strategy");
    let text = std::fs::read_to_string(&small.scene).unwrap();
    for (from, to) in [
        ("0.62, 0.06, 0.05", "0.62, 0.06, 0.06"),
        ("17, 12, 4", "17, 12, 4.001"),
        ("value=\"37.5\"", "value=\"37.6\""),
        ("0, 1, 3.9", "0, 1, 3.8"),
        ("angle=\"-17\"", "angle=\"-18\""),
        ("type=\"box\"", "type=\"gaussian\""),
        ("value=\"100\"", "value=\"2\""),
    ] {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        std::fs::write(&small.scene, text.replace(from, to)).unwrap();
        assert_eq!(small.run(32, "", &[]).0, (ALL, 0), "{to}");
    }
    std::fs::write(&small.scene, text).unwrap();
    assert_eq!(small.run(32, "", &[]).0, (0, ALL), "back to the first");
}

/// Files below a folder with this end of the name, sorted.
fn files(folder: &Path, end: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path, end)),
            false if path.to_str().unwrap().ends_with(end) => found.push(path),
            false => {}
        }
    }
    found.sort();
    found
}

/// Warnings of stored results that were computed again.
fn recomputed(record: &Record) -> u64 {
    record.warnings.iter().filter(|w| w.contains("recomputed") && w.contains(".cell")).count() as u64
}

#[test]
fn damaged_cells_are_computed_again_and_told() {
    let small = Small::new();
    small.run(32, "", &[]);
    let before = left(&small.out(), "small");
    let cells = small.out().join("cells");
    // Every cell file once, each damaged in another way.
    let all = files(&cells, ".cell");
    for (i, path) in all.iter().enumerate() {
        let mut bytes = std::fs::read(path).unwrap();
        let middle = bytes.len() / 2;
        match i % 6 {
            0 => bytes.truncate(middle),
            1 => bytes.clear(),
            2 => bytes[middle] ^= 16,
            3 => bytes[8] = 9,
            4 => bytes.extend(b"more"),
            _ => bytes = std::fs::read(&all[(i + 7) % all.len()]).unwrap(),
        }
        std::fs::write(path, bytes).unwrap();
    }
    let (reuse, record) = small.run(32, "", &[]);
    assert_eq!(reuse, (ALL, 0));
    assert_eq!(left(&small.out(), "small"), before);
    let told = recomputed(&record);
    assert!(told >= ALL, "{told} of {ALL}: {:?}", record.warnings);
    assert!(recomputed(&small.run(32, "", &[]).1) == 0, "mended");
    let before = results(&small.out(), "small");
    // Single files: the rest is reused, whatever N the file is of.
    for n in ["1.cell", "4.cell", "32.cell", "state.cell"] {
        for path in files(&cells, &format!("/{n}")) {
            std::fs::write(path, b"rootncel").unwrap();
        }
        let ((computed, _), record) = small.run(32, "", &[]);
        let expected = if n == "state.cell" { 0 } else { 9 };
        assert_eq!(computed, expected, "{n}");
        assert_eq!(recomputed(&record), expected, "{n}: {:?}", record.warnings);
        if n == "state.cell" {
            assert_eq!(small.run(64, "", &[]).0.0, 9, "a run that needs the state does without");
            small.run(32, "", &[]);
        }
        assert_eq!(results(&small.out(), "small"), before, "{n}");
    }
}

#[test]
fn deleted_cells_are_computed_again() {
    let small = Small::new();
    small.run(32, "", &[]);
    let before = left(&small.out(), "small");
    for path in files(&small.out().join("cells"), "/32.cell") {
        std::fs::remove_file(path).unwrap();
    }
    let ((computed, _), record) = small.run(32, "", &[]);
    assert_eq!((computed, recomputed(&record)), (9, 0));
    assert_eq!(left(&small.out(), "small"), before);
}

#[test]
fn records_survive_what_json_cannot_hold() {
    // One sample, one replicate: no variance, no interval, no slope, and an infinite PSNR where there is no error.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none.toml");
    let text = "name = \"none\"\nfilm = { width = 1, height = 1 }\n[[scene]]\nintegrand = \"constant\"\n\
                [[scene]]\nintegrand = \"linear\"\n[budget]\nspp = 1\nreplicates = 1\n\
                [[strategy]]\nsequence = \"independent\"\n[[strategy]]\nname = \"s\"\nsequence = \"stratified\"\n\
                [[claim]]\ntext = \"t\"\nkind = \"slope\"\nof = \"s\"\nat_most = 0.0\n\
                [[claim]]\ntext = \"t\"\nkind = \"efficiency-ratio\"\nof = \"s\"\nto = \"mis\"\nat_most = 0.0\n";
    std::fs::write(&path, text).unwrap();
    let (record, _) = run_file(&path, folder.path(), false).unwrap();
    let out = folder.path().join("none");
    let loaded = Record::load(&out).unwrap();
    assert_eq!(serde_json::to_string(&loaded).unwrap(), serde_json::to_string(&record).unwrap());
    let psnr = record.metrics.iter().position(|m| m.name == "PSNR").unwrap();
    assert_eq!(loaded.scenes[0].strategies[0].checkpoints[0].metrics[psnr].values, [f64::INFINITY]);
    assert!(loaded.scenes[1].strategies[0].relative_variance.estimate.is_nan());
    assert!(loaded.claims.iter().all(|c| c.verdict == rootn::record::Verdict::Inconclusive));
    // Reports from memory and from the file are the same, and show no NaN.
    let shown = rootn::report::console(&record);
    assert_eq!(rootn::report::console(&loaded), shown);
    assert!(!shown.contains("NaN") && !shown.contains("inf"), "{shown}");
    let page = std::fs::read(out.join("report.html")).unwrap();
    rootn::report::write(&loaded, &out).unwrap();
    assert!(page == std::fs::read(out.join("report.html")).unwrap());
}
