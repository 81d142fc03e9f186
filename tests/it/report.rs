//! Reports: every output from records made by hand, with the awkward cases among them; EXR files in and out.
//!
//! The pages are left in cargo's temporary folder for tests (`target/tmp/report-*`), to be looked at.

use rootn::error::Error;
use rootn::record::image::{Attributes, Layers, read_exr, write_exr};
use rootn::record::*;
use rootn::report;
use rootn::sampling::strategy::Preset;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A deterministic stand-in for noise, uniform in −1..1.
fn noise(i: usize) -> f64 {
    let h = blake3::hash(&i.to_le_bytes());
    f64::from(u32::from_le_bytes(h.as_bytes()[..4].try_into().unwrap())) / f64::from(u32::MAX) * 2.0 - 1.0
}

fn interval(estimate: f64, half: f64) -> Interval {
    Interval { estimate, lower: Some(estimate - half), upper: Some(estimate + half), confidence: 0.95 }
}

fn alone(estimate: f64) -> Interval {
    Interval { estimate, lower: None, upper: None, confidence: 0.95 }
}

fn relmse() -> MetricInfo {
    MetricInfo {
        name: "relMSE".into(),
        formula: "mean (x − r)²/(r² + 0.01)".into(),
        channels: "mean over pixels and channels".into(),
        squared: true,
        unit: "relative".into(),
    }
}

/// A strategy of relative variance `v` per sample and `seconds` per pixel sample, measured at N = 1, 2 … 2^last.
fn strategy(name: &str, preset: Preset, v: f64, seconds: f64, replicates: usize, last: u32) -> StrategyResult {
    let order = if preset == Preset::Sobol { 1.25 } else { 1.0 };
    let checkpoints = (0..=last).map(|e| {
        let spp = 1u64 << e;
        let exact = v / (spp as f64).powf(order);
        let id = |r: usize| name.len() * 1000 + e as usize * 50 + r;
        let values: Vec<f64> = (0..replicates).map(|r| exact * (1.0 + 0.1 * noise(id(r)))).collect();
        let mean = values.iter().sum::<f64>() / replicates as f64;
        let seconds: Vec<f64> =
            (0..replicates).map(|r| seconds * 4096.0 * spp as f64 * (1.0 + 0.01 * noise(id(r) + 7))).collect();
        CheckpointResult {
            spp,
            wall_seconds: seconds.clone(),
            seconds,
            metrics: vec![MetricResult {
                values,
                mean: if replicates > 1 { interval(mean, 0.06 * mean) } else { alone(mean) },
                trimmed: Some(0.9 * mean),
            }],
            predicted: (preset != Preset::Sobol).then_some(exact * 1.02),
            refused: None,
        }
    });
    let checkpoints: Vec<_> = checkpoints.collect();
    let several = replicates > 1;
    let bounded = |x: f64, h: f64| if several { interval(x, h * x) } else { alone(x) };
    let targets = [0.1, 0.01].map(|t: f64| {
        let spp = (v / (t * t)).powf(1.0 / order);
        let seconds = Some(bounded(spp * seconds * 4096.0, 0.05));
        TargetCost { target: t, spp, seconds, extrapolated: spp > f64::from(1 << last), forecast: None }
    });
    StrategyResult {
        name: name.into(),
        device: "cpu".into(),
        strategy: preset.strategy(),
        identity: String::new(),
        dependence: if preset == Preset::Sobol { Dependence::Dependent } else { Dependence::Independent },
        setup_seconds: 0.01,
        seconds_per_sample: bounded(seconds, 0.02),
        checkpoints,
        slope: several.then(|| Slope {
            slope: interval(-order / 2.0, 0.0091),
            values: Vec::new(),
            from: 1,
            to: 1 << last,
        }),
        relative_variance: bounded(v, 0.03),
        relative_variance_without: Vec::new(),
        efficiency_ratio: None,
        variance_ratio: None,
        cost: targets.to_vec(),
        probes: (0..2u32)
            .map(|p| ProbeResult {
                pixel: [32 - 20 * p, 40 - 30 * p],
                reference: 0.5,
                points: (0..=last)
                    .map(|e| {
                        let half = (v / f64::from(1u32 << e) / 16.0).sqrt();
                        let mean = 0.5 + 0.6 * half * noise(name.len() + e as usize + 100 * p as usize);
                        (1 << e, mean, mean - half, mean + half)
                    })
                    .collect(),
            })
            .collect(),
        means: Vec::new(),
        dispersion: None,
        largest_deviation: 0.0,
        health: None,
        non_finite: NonFinite::default(),
        image: None,
    }
}

fn scene(name: &str, strategies: Vec<StrategyResult>) -> SceneResult {
    SceneResult {
        name: name.into(),
        shape: [64, 64, 3],
        abscissa: "spp".into(),
        max_depth: Some(8),
        reference: ReferenceResult {
            description: "Sobol + MIS, 32 replicates of 512 spp".into(),
            mean: 0.31,
            mean_std_error: 1e-4,
            mean_degrees: Some(31.0),
            variance: 4e-7,
            seconds: Some(41.2),
            image: None,
        },
        targets: vec![0.1, 0.01],
        strategies,
        regions: Vec::new(),
    }
}

fn record(scenes: Vec<SceneResult>) -> Record {
    Record {
        format: FORMAT,
        name: "sample".into(),
        question: Some("Does MIS pay?".into()),
        experiment: "name = \"sample\"\n".into(),
        provenance: Provenance {
            version: "0.1.0".into(),
            machine: "made by hand".into(),
            threads: 2,
            devices: vec![DeviceNote { name: "cpu".into(), reason: "it was asked for".into() }],
            seed: 1,
            sampling_seconds: 12.5,
        },
        metrics: vec![relmse()],
        scenes,
        claims: vec![],
        warnings: vec![],
    }
}

/// An image with a bright emitter, darker walls and the layers that a run writes.
fn picture(path: &Path, v: f64, seed: usize) {
    let (w, h) = (64, 64);
    let mut layers = Layers::new(w, h);
    let mean = |i: usize, c: usize| {
        let (x, y) = ((i % w) as f64 / w as f64, (i / w) as f64 / h as f64);
        let lamp = if (0.4..0.6).contains(&x) && y < 0.12 { 8.0 } else { 0.0 };
        let wall = if x < 0.2 {
            [0.5, 0.08, 0.06]
        } else if x > 0.8 {
            [0.08, 0.4, 0.1]
        } else {
            [0.4, 0.38, 0.33]
        };
        lamp + wall[c] * (1.2 - y)
    };
    let ids = || (0..w * h * 3).map(|i| (i / 3, i % 3));
    layers.insert("", 3, ids().map(|(i, c)| (mean(i, c) * (1.0 + 0.02 * noise(i * 3 + c + seed))) as f32));
    layers.insert("sample_variance", 3, ids().map(|(i, c)| if i == 0 { 0.0 } else { (v * mean(i, c).powi(2)) as f32 }));
    layers.insert_counts("n", vec![256; w * h]);
    write_exr(path, &layers, &Attributes::default()).unwrap();
}

/// An empty folder that stays after the test.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// What a run of the seven presets on one scene leaves, with images, claims and probes.
fn seven_presets(folder: &Path) -> Record {
    let variances = [9.0, 5.5, 5.3, 0.9, 0.35, 0.42, 0.4];
    let seconds = [1.1e-6, 1.15e-6, 1.2e-6, 1.5e-6, 1.9e-6, 1.8e-6, 1.85e-6];
    let strategies = Preset::ALL.iter().enumerate().map(|(i, &preset)| {
        let mut s = strategy(preset.label(), preset, variances[i], seconds[i], 16, 8);
        let image = format!("images/{}-all-256.exr", preset.label());
        picture(&folder.join(&image), variances[i], i * 100_000);
        s.image = Some(image);
        if i > 0 {
            let ratio = variances[0] * seconds[0] / (variances[i] * seconds[i]);
            s.efficiency_ratio = Some(interval(ratio, 0.04 * ratio));
            let ratio = variances[i] / variances[0];
            let quantiles = Some([0.2, 0.6, 1.0, 1.3, 2.0].map(|q| q * ratio));
            s.variance_ratio = Some(VarianceRatio { ratio: interval(ratio, 0.03 * ratio), quantiles });
        }
        s
    });
    let mut record = record(vec![scene("cornell", strategies.collect())]);
    picture(&folder.join("images/reference.exr"), 0.1, 9);
    record.scenes[0].reference.image = Some("images/reference.exr".into());
    let claim = |text: &str, verdict, sentence: &str| ClaimResult {
        text: text.into(),
        kind: "variance-ratio".into(),
        replicates: 16,
        detectable: Some(1.05),
        open: None,
        doubtful: false,
        scene: "cornell".into(),
        interval: interval(0.0467, 0.0014),
        verdict,
        sentence: sentence.into(),
    };
    record.claims = vec![
        claim(
            "MIS needs at most a quarter of the variance of uniform sampling",
            Verdict::Supported,
            "Its variance is 0.0467 [0.0453, 0.0481] of uniform's, below 0.25.",
        ),
        claim("Stratification doubles efficiency", Verdict::Refuted, "The ratio is 1.14 [1.10, 1.19], below 2."),
        claim("Light sampling is unbiased", Verdict::Inconclusive, "Twice the replicates would decide."),
    ];
    record
}

/// Everything that may go wrong in a record that is still valid.
fn awkward(folder: &Path) -> Record {
    let hostile = "<script>alert(\"1\")</script> & 'quotes' | pipes";
    let long = "a-strategy-with-a-name-that-is-far-too-long-for-any-legend-or-table-column-of-a-report";
    let mut noisy = strategy(hostile, Preset::Uniform, 9.0, 1.1e-6, 16, 8);
    noisy.checkpoints[8].refused = Some("the reference's variance is 31 % of the measured MSE".into());
    noisy.non_finite = NonFinite { count: 3, first: vec![(0, 17, 5)] };
    let mut negative = strategy(long, Preset::Mis, 0.4, 1.8e-6, 16, 8);
    negative.checkpoints[7].metrics[0].mean = interval(-2e-5, 5e-5);
    negative.device = "vulkan: llvmpipe".into();
    negative.efficiency_ratio = Some(Interval { estimate: f64::INFINITY, lower: None, upper: None, confidence: 0.95 });
    negative.slope = Some(Slope { slope: alone(f64::NEG_INFINITY), values: Vec::new(), from: 1, to: 256 });
    negative.cost[1].seconds = None;
    let single = strategy("one replicate", Preset::Light, 0.9, 1.5e-6, 1, 5);
    let mut number = scene("gaussian-2d", vec![strategy("plain", Preset::Cosine, 1.0, 2e-8, 16, 10)]);
    number.shape = [1, 1, 1];
    number.abscissa = "samples".into();
    number.max_depth = None;
    number.reference.variance = 0.0;
    number.strategies[0].probes.clear();
    let mut empty = scene("Nothing / at \u{7} all", vec![strategy("none", Preset::Cosine, 1.0, 1e-6, 4, 2)]);
    for checkpoint in &mut empty.strategies[0].checkpoints {
        checkpoint.refused = Some("no reference".into());
    }
    empty.strategies[0].cost.clear();
    empty.strategies[0].probes[0].points.clear();
    empty.targets.clear();
    let bare = scene("nothing / at \u{7} all", vec![]);
    let mut record = record(vec![scene(hostile, vec![noisy, negative, single]), number, empty, bare]);
    record.name = hostile.into();
    record.experiment = format!("name = '''{hostile}'''\n");
    record.question = Some(hostile.into());
    record.warnings = vec![format!("{hostile}: advice")];
    record.claims = vec![ClaimResult {
        text: hostile.into(),
        kind: "slope".into(),
        replicates: 1,
        detectable: None,
        open: Some(hostile.into()),
        doubtful: false,
        scene: hostile.into(),
        interval: alone(f64::NAN),
        verdict: Verdict::Inconclusive,
        sentence: hostile.into(),
    }];
    let path = "images/one channel.exr";
    let mut layers = Layers::new(3, 2);
    layers.insert("", 1, [0.0, 1.0, f32::NAN, f32::INFINITY, -1.0, 2.0]);
    layers.insert("sample_variance", 1, [0.0, 1.0, f32::NAN, f32::INFINITY, 0.5, 1e-30]);
    write_exr(&folder.join(path), &layers, &Attributes::default()).unwrap();
    record.scenes[0].strategies[2].image = Some(path.into());
    record
}

/// Fifteen strategies whose curves end close together, wide intervals that reach below zero, a visible reference floor,
/// and a second scene whose errors span less than a decade.
fn crowded() -> Record {
    let named = |i: usize| format!("variant-{i:02}-of-the-sampler");
    let many = (0..15usize).map(|i| {
        let mut s = strategy(&named(i), Preset::ALL[i % 6], 1.0 + 0.02 * i as f64, 1e-6, 3, 12);
        for point in &mut s.checkpoints {
            let mean = point.metrics[0].mean.estimate;
            point.metrics[0].mean = interval(mean, mean * if point.spp > 256 { 1.5 } else { 0.5 });
        }
        for cost in &mut s.cost {
            cost.seconds = cost.seconds.map(|i| interval(i.estimate, i.estimate * 0.8));
        }
        s
    });
    let mut first = scene("crowded", many.collect());
    first.reference.variance = 2e-4;
    let mut second =
        scene("short", vec![strategy("a", Preset::Mis, 1.0, 1e-6, 4, 2), strategy("b", Preset::Mis, 1.4, 1e-6, 4, 2)]);
    second.targets = vec![0.5];
    for s in &mut second.strategies {
        s.cost = vec![TargetCost {
            target: 0.5,
            spp: 4.0,
            seconds: Some(interval(0.0164, 0.002)),
            extrapolated: false,
            forecast: None,
        }];
    }
    record(vec![first, second])
}

/// Every text of every figure is inside its figure and apart from every other text.
#[test]
fn labels_do_not_overlap() {
    let mut fonts = resvg::usvg::fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    let options = resvg::usvg::Options { fontdb: std::sync::Arc::new(fonts), ..Default::default() };
    let folder = folder("report-crowded");
    let presets = seven_presets(&folder);
    let awkward = awkward(&folder);
    let mut checked = 0;
    for record in [crowded(), presets, awkward] {
        let files = report::write(&record, &folder).unwrap();
        for file in files.iter().filter(|f| f.extension().is_some_and(|e| e == "svg")) {
            let tree = resvg::usvg::Tree::from_str(&std::fs::read_to_string(file).unwrap(), &options).unwrap();
            let whole = tree.size();
            let mut texts = Vec::new();
            collect_texts(tree.root(), &mut texts);
            for (i, (text, a)) in texts.iter().enumerate() {
                let name = file.file_name().unwrap().display();
                let inside =
                    a.left() >= 0.0 && a.top() >= 0.0 && a.right() <= whole.width() && a.bottom() <= whole.height();
                assert!(inside, "{name}: {text:?} leaves the figure");
                for (other, b) in &texts[..i] {
                    let apart = a.right() <= b.left()
                        || b.right() <= a.left()
                        || a.bottom() <= b.top()
                        || b.bottom() <= a.top();
                    assert!(apart, "{name}: {text:?} and {other:?} overlap");
                }
            }
            checked += texts.len();
        }
    }
    assert!(checked > 500, "only {checked} texts found");
}

/// Texts below a node with their ink's bounding boxes in pixels.
fn collect_texts(group: &resvg::usvg::Group, texts: &mut Vec<(String, resvg::tiny_skia::Rect)>) {
    for node in group.children() {
        match node {
            resvg::usvg::Node::Group(group) => collect_texts(group, texts),
            resvg::usvg::Node::Text(text) => {
                let content: String = text.chunks().iter().map(|c| c.text()).collect();
                let mut ink = Vec::new();
                collect_ink(text.flattened(), &mut ink);
                let all = ink.into_iter().reduce(|a, b| {
                    let (l, t) = (a.left().min(b.left()), a.top().min(b.top()));
                    resvg::tiny_skia::Rect::from_ltrb(l, t, a.right().max(b.right()), a.bottom().max(b.bottom()))
                        .unwrap()
                });
                texts.extend(all.map(|b| (content, b)));
            }
            _ => {}
        }
    }
}

fn collect_ink(group: &resvg::usvg::Group, ink: &mut Vec<resvg::tiny_skia::Rect>) {
    for node in group.children() {
        match node {
            resvg::usvg::Node::Group(group) => collect_ink(group, ink),
            other => ink.push(other.abs_bounding_box()),
        }
    }
}

/// File names below a folder with their bytes, images left out.
fn outputs(folder: &Path, files: &[PathBuf]) -> BTreeMap<PathBuf, Vec<u8>> {
    files.iter().map(|f| (f.strip_prefix(folder).unwrap().to_owned(), std::fs::read(f).unwrap())).collect()
}

#[test]
fn every_output_is_written_and_the_same_twice() {
    let folder = folder("report-presets");
    let record = seven_presets(&folder);
    record.save(&folder).unwrap();
    let files = report::write(&record, &folder).unwrap();
    let first = outputs(&folder, &files);
    let names: Vec<_> = first.keys().map(|p| p.to_str().unwrap()).collect();
    let expected = [
        "curves.csv",
        "plots/cornell-cost.png",
        "plots/cornell-cost.svg",
        "plots/cornell-error-seconds.png",
        "plots/cornell-error-seconds.svg",
        "plots/cornell-error-spp.png",
        "plots/cornell-error-spp.svg",
        "plots/cornell-images.png",
        "plots/cornell-probe-12-10.png",
        "plots/cornell-probe-12-10.svg",
        "plots/cornell-probe-32-40.png",
        "plots/cornell-probe-32-40.svg",
        "plots/cornell-variance.png",
        "report.html",
        "summary.md",
    ];
    assert_eq!(names, expected);
    // Through the file, as `report` goes: nothing may depend on what the record does not hold.
    let files = report::write(&Record::load(&folder).unwrap(), &folder).unwrap();
    assert!(first == outputs(&folder, &files), "the second report differs from the first");
}

#[test]
fn awkward_records_are_reported_whole() {
    let folder = folder("report-awkward");
    let record = awkward(&folder);
    let files = report::write(&record, &folder).unwrap();
    let html = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(!html.to_lowercase().contains("<script"), "a name became markup");
    assert!(html.contains("&lt;script&gt;alert"), "the name is not shown");
    assert!(!html.contains("http://") && !html.contains("https://"), "a report refers to nothing outside itself");
    for file in &files {
        if file.extension().is_some_and(|e| e == "svg") {
            let text = std::fs::read_to_string(file).unwrap();
            let parsed = roxmltree::Document::parse(&text).expect("SVG is XML");
            assert!(!parsed.descendants().any(|n| n.tag_name().name() == "script"));
        }
    }
    let console = report::console(&record);
    assert!(!console.contains(|c: char| c.is_control() && c != '\n'), "control characters reach the terminal");
    let markdown = std::fs::read_to_string(folder.join("summary.md")).unwrap();
    assert!(!markdown.contains("<script"));
    // What is left out is said, not dropped in silence.
    for said in ["refused at N = 256", "3 non-finite samples", "below the reference&#x27;s own noise", "no slope"] {
        assert!(html.contains(said), "{said:?} is missing in the page");
    }
    assert!(html.contains("N = 128: no positive error"));
    // Two scenes whose names make the same file name keep their plots apart.
    assert!(folder.join("plots/nothing-at-all-probe-12-10.svg").is_file());
}

#[test]
fn a_missing_image_is_an_error() {
    let folder = folder("report-missing");
    let mut record = record(vec![scene("a", vec![strategy("b", Preset::Mis, 1.0, 1e-6, 4, 4)])]);
    record.scenes[0].strategies[0].image = Some("images/none.exr".into());
    let error = report::write(&record, &folder).unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
}

/// A small record of round figures.
fn golden() -> Record {
    let point = |spp: u64, value: f64| CheckpointResult {
        spp,
        seconds: vec![0.5, 0.25],
        wall_seconds: vec![0.5, 0.25],
        metrics: vec![MetricResult {
            values: vec![value, value / 2.0],
            mean: interval(0.75 * value, 0.1 * value),
            trimmed: None,
        }],
        predicted: Some(value),
        refused: None,
    };
    let mut first = strategy("uniform", Preset::Uniform, 4.0, 1e-6, 2, 2);
    first.checkpoints = vec![point(1, 4.0), point(4, 1.0)];
    first.cost = vec![TargetCost {
        target: 0.01,
        spp: 40_000.0,
        seconds: Some(interval(163.84, 8.0)),
        extrapolated: true,
        forecast: None,
    }];
    let mut second = strategy("mis", Preset::Mis, 0.4, 2e-6, 2, 2);
    second.checkpoints = vec![point(1, 0.4), point(4, 0.1)];
    second.cost = vec![TargetCost {
        target: 0.01,
        spp: 4000.0,
        seconds: Some(interval(32.77, 1.6)),
        extrapolated: true,
        forecast: None,
    }];
    second.efficiency_ratio = Some(Interval { estimate: 5.0, lower: Some(4.6), upper: Some(5.5), confidence: 0.95 });
    let mut record = record(vec![scene("box", vec![first, second])]);
    record.claims = vec![ClaimResult {
        text: "MIS pays".into(),
        kind: "efficiency-ratio".into(),
        replicates: 16,
        detectable: Some(1.1),
        open: None,
        doubtful: false,
        scene: "box".into(),
        interval: interval(5.0, 0.4),
        verdict: Verdict::Supported,
        sentence: "Its efficiency is 5.0 [4.6, 5.5] times uniform's.".into(),
    }];
    record.warnings = vec!["Two replicates are few: raise budget.replicates.".into()];
    record
}

#[test]
fn console_table() {
    let text = report::console(&golden());
    let expected = "\
box: 64 × 64 pixels, 3 channels, paths of at most 8 edges

 strategy   √relMSE at N = 4 (%)                     slope       time/sample (µs)       seconds to 1 %           efficiency
────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────
 uniform                  87 ± 6   -0.500 [-0.509, -0.491]   1.000 [0.980, 1.020]      164* [156, 172]                   1×
 mis                  27.4 ± 1.8   -0.500 [-0.509, -0.491]   2.000 [1.960, 2.040]   32.8* [31.2, 34.4]   5.00× [4.60, 5.50]

  relMSE = mean (x − r)²/(r² + 0.01); mean over pixels and channels; the table shows its root, in percent.
  2 replicates; ± and brackets: 95 % intervals over replicates.
  Reference: Sobol + MIS, 32 replicates of 512 spp.
  Efficiency = 1/(relative variance × seconds per sample), over that of uniform.
  * extrapolated beyond the largest N measured.

Claims
  SUPPORTED     (box) MIS pays. Its efficiency is 5.0 [4.6, 5.5] times uniform's.

Warnings
  Two replicates are few: raise budget.replicates.
";
    assert!(text == expected, "the console shows:\n{text}");
}

#[test]
fn curves_csv() {
    let folder = folder("report-golden");
    report::write(&golden(), &folder).unwrap();
    let text = std::fs::read_to_string(folder.join("curves.csv")).unwrap();
    let expected = "\
scene,strategy,device,replicate,spp,seconds,metric,value,predicted
box,uniform,cpu,0,1,0.5,relMSE,4,4
box,uniform,cpu,1,1,0.25,relMSE,2,4
box,uniform,cpu,0,4,0.5,relMSE,1,1
box,uniform,cpu,1,4,0.25,relMSE,0.5,1
box,mis,cpu,0,1,0.5,relMSE,0.4,0.4
box,mis,cpu,1,1,0.25,relMSE,0.2,0.4
box,mis,cpu,0,4,0.5,relMSE,0.1,0.1
box,mis,cpu,1,4,0.25,relMSE,0.05,0.1
";
    assert_eq!(text, expected);
}

/// Layers of every kind with values that a careless conversion would lose.
fn layers() -> Layers {
    let mut layers = Layers::new(5, 3);
    let odd = [0.0, -0.0, 1.0, f32::MIN_POSITIVE, 1e-45, f32::MAX, f32::INFINITY, -1.5, 0.1];
    layers.insert("", 3, (0..45).map(|i| odd[i % odd.len()]));
    for layer in ["sample_variance", "std_error", "m3", "m4", "min", "max"] {
        layers.insert(layer, 3, (0..45).map(|i| noise(i + layer.len() * 100) as f32));
    }
    layers.insert_counts("n", (0..15).map(|i| u32::MAX - i).collect());
    layers.insert_counts("argmax", (0..15).collect());
    layers
}

#[test]
fn exr_round_trip_is_exact() {
    let path = folder("report-exr").join("images/all.exr");
    let attributes = Attributes {
        samples_per_pixel: 4096,
        render_time_seconds: 1.5,
        seed: u64::MAX,
        strategy: "größer \"mis\"".into(),
        cell_hash: "c0ffee".into(),
        definitions: vec![("std_error".into(), "from 16 replicates".into())],
    };
    write_exr(&path, &layers(), &attributes).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let read = read_exr(&path).unwrap();
    let bits = |l: &Layers| l.floats.values().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&read), bits(&layers()));
    assert_eq!(read.counts, layers().counts);
    assert_eq!(read.layer("").unwrap().0, 3);
    assert_eq!(read.layer("n").unwrap().0, 1);
    assert_eq!(read.std_error(), layers().layer("std_error"));
    assert!(read.layer("m5").is_none());
    // The header is the same every time, although the encoder keeps it in a hash map.
    for _ in 0..8 {
        write_exr(&path, &layers(), &attributes).unwrap();
        assert!(std::fs::read(&path).unwrap() == bytes, "the same image has other bytes");
    }
    let header = String::from_utf8_lossy(&bytes).into_owned();
    for said in ["samplesPerPixel", "renderTimeSeconds", "größer", "c0ffee", "from 16 replicates", "definition.n\0"] {
        assert!(header.contains(said), "the header lacks {said:?}");
    }
    let mut one = Layers::new(2, 1);
    one.insert("", 1, [0.25, 4.0]);
    write_exr(&path, &one, &Attributes::default()).unwrap();
    assert_eq!(read_exr(&path).unwrap().layer(""), Some((1, vec![0.25, 4.0])));
}

/// Every file that is cut or changed in one byte is read or refused, but never panics; what is refused says so.
#[test]
fn damaged_exr_gives_errors() {
    let path = folder("report-damaged").join("a.exr");
    write_exr(&path, &layers(), &Attributes::default()).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        read_exr(&path)
    };
    for end in (0..whole.len()).step_by(7) {
        let error = read(&whole[..end]).expect_err("a part of a file");
        assert!(matches!(error, Error::Damaged { .. }), "{error}");
    }
    for at in (0..whole.len()).step_by(3) {
        let mut changed = whole.clone();
        changed[at] ^= 0xff;
        if let Err(error) = read(&changed) {
            assert!(matches!(error, Error::Damaged { .. }), "{error}");
        }
    }
    // Dimensions that no file of this size can hold are refused before anything is allocated.
    let window = whole.windows(11).position(|w| w == b"dataWindow\0").unwrap() + 11 + 6 + 4;
    let mut huge = whole.clone();
    huge[window + 8..window + 12].copy_from_slice(&60_000i32.to_le_bytes());
    huge[window + 12..window + 16].copy_from_slice(&60_000i32.to_le_bytes());
    let message = read(&huge).unwrap_err().to_string();
    assert!(message.contains("60001 × 60001"), "{message}");
}

/// The files of a folder of the shared collection; `None`, with a reason, where it is absent outside CI.
fn shared(part: &str) -> Option<Vec<PathBuf>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(part);
    if !root.is_dir() {
        assert!(std::env::var_os("CI").is_none(), "{} is missing", root.display());
        println!("skipped: no {}", root.display());
        return None;
    }
    let (mut folders, mut files) = (vec![root], vec![]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
            if entry.is_dir() { folders.push(entry) } else { files.push(entry) }
        }
    }
    files.sort();
    Some(files)
}

#[test]
fn foreign_exr_files_are_read_or_refused() {
    let Some(files) = shared("scenes/openexr-damaged/Damaged") else { return };
    assert!(files.len() > 50);
    let (mut refused, mut read) = (0, 0);
    for file in files.iter().chain(&shared("scenes/openexr-odd/TestImages").unwrap()) {
        match read_exr(file) {
            Ok(layers) => {
                let pixels = layers.width * layers.height;
                assert!(layers.floats.values().all(|c| c.len() == pixels), "{}", file.display());
                read += 1;
            }
            Err(error) => {
                assert!(matches!(error, Error::Damaged { .. }), "{error}");
                refused += 1;
            }
        }
    }
    println!("{read} read, {refused} refused");
    assert!(read > 0 && refused > 0);
}

#[test]
fn references_have_means_and_standard_errors() {
    let Some(files) = shared("references") else { return };
    for file in files.iter().filter(|f| f.extension().is_some_and(|e| e == "exr")) {
        let layers = read_exr(file).unwrap();
        let ((channels, mean), (_, error)) = (layers.layer("").unwrap(), layers.std_error().unwrap());
        assert_eq!((channels, mean.len()), (3, 3 * layers.width * layers.height));
        assert_eq!(mean.len(), error.len());
        assert!(mean.iter().chain(&error).all(|v| v.is_finite() && *v >= 0.0), "{}", file.display());
    }
}

/// What headless Chromium says on stderr while it shows a page; `None` where there is no Chromium (in CI that fails).
fn browse(page: &Path, profile: &Path) -> Option<(String, Vec<u8>)> {
    let picture = profile.join("page.png");
    let output = std::process::Command::new("chromium")
        .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--enable-logging=stderr", "--log-level=0", "--window-size=1000,3000"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("--screenshot={}", picture.display()))
        .arg(format!("file://{}", page.display()))
        .output();
    match output {
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            Some((said, std::fs::read(picture).unwrap_or_default()))
        }
        Err(e) => {
            assert!(std::env::var_os("CI").is_none(), "chromium: {e}");
            println!("skipped: no chromium ({e})");
            None
        }
    }
}

#[test]
fn a_browser_shows_the_page_without_complaint() {
    let folder = folder("report-browser");
    let record = seven_presets(&folder);
    report::write(&record, &folder).unwrap();
    let profile = tempfile::tempdir().unwrap();
    let Some((said, picture)) = browse(&folder.join("report.html"), profile.path()) else { return };
    let complaints: Vec<&str> = said.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
    // A blank page of this size compresses to some 10 kB.
    assert!(picture.len() > 50_000, "screenshot of {} bytes", picture.len());

    // The same check must see a page that breaks its own rules.
    let broken = folder.join("broken.html");
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    std::fs::write(&broken, page.replace("</body>", "<script>alert(1)</script></body>")).unwrap();
    let Some((said, _)) = browse(&broken, profile.path()) else { return };
    assert!(said.lines().any(|l| l.contains("CONSOLE")), "a blocked script went unnoticed");
}
