//! The one place that walks the flow: cells, then estimates at checkpoints, then statistics, verdicts, record.

mod calibration;
mod image;
mod plan;
mod reference;
mod sample;
mod scene;
mod track;

pub use calibration::calibrate;
pub(crate) use image::file_name;
pub use plan::{Contender, Look, Plan, PlannedScene, ReferencePlan, Stop, powers_of_two};
pub use sample::{progress_bar, sample};

use crate::error::{Error, Result};
use crate::estimator::Estimator;
use crate::moments::cell::CellFolder;
use crate::record::{FORMAT, Provenance, Record, SceneResult, StrategyResult};
use crate::stats::Metric;
use indicatif::ProgressBar;
use std::path::PathBuf;

/// How to run.
pub struct Options {
    /// Folder that takes `<experiment>/` and `cells/`.
    pub out: PathBuf,
    /// Recompute everything.
    pub fresh: bool,
    /// No progress on stderr.
    pub quiet: bool,
}

/// What was computed and what was found on disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reuse {
    /// Checkpoints computed now.
    pub computed: u64,
    /// Checkpoints found from earlier runs.
    pub reused: u64,
}

/// Runs a plan and writes its record and images (not yet the report) below `options.out`.
pub fn run(plan: &Plan<'_>, options: &Options) -> Result<(Record, Reuse)> {
    let mut runner = Runner::new(plan, options);
    CellFolder::tidy(&runner.cells);
    let folder = options.out.join(&plan.name);
    let (mut scenes, mut claims) = (Vec::new(), Vec::new());
    for scene in &plan.scenes {
        let (result, judged) = runner.scene(scene, &folder)?;
        scenes.push(result);
        claims.extend(judged);
    }
    runner.bar.finish_and_clear();
    // In the order of the file, then of scenes.
    claims.sort_by_key(|c| c.0);
    let claims = claims.into_iter().map(|c| c.1).collect();
    let mut warnings = plan.warnings.clone();
    warnings.append(&mut runner.warnings);
    let record = Record {
        format: FORMAT,
        name: plan.name.clone(),
        question: plan.question.clone(),
        experiment: plan.experiment.clone(),
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").into(),
            machine: machine(),
            threads: rayon::current_num_threads(),
            seed: plan.seed,
            devices: plan.devices.clone(),
            sampling_seconds: scenes.iter().map(sampling_seconds).sum(),
        },
        metrics: plan.metrics.iter().map(|m| m.info()).collect(),
        scenes,
        claims,
        warnings,
    };
    record.save(&folder)?;
    Ok((record, runner.reuse))
}

/// Measures one estimator of a known integral, in a temporary folder: the harness on one page.
///
/// Powers of two up to `samples` per value, `replicates` replicates, relMSE against `exact`.
pub fn quick(name: &str, estimator: &dyn Estimator, exact: f64, samples: u64, replicates: u32) -> Result<Record> {
    let folder = tempfile::tempdir().map_err(|e| Error::io(std::env::temp_dir(), e))?;
    let contender = Contender {
        name: name.into(),
        device: "cpu".into(),
        strategy: crate::sampling::strategy::Preset::Uniform.strategy(),
        estimator: Box::new(estimator),
    };
    let plan = Plan {
        name: name.into(),
        seed: 1,
        replicates,
        checkpoints: powers_of_two(samples),
        metrics: vec![Metric::RelMse],
        targets: vec![0.01],
        scenes: vec![PlannedScene {
            name: name.into(),
            contenders: vec![contender],
            reference: ReferencePlan::Exact(exact),
            max_depth: None,
            rendered: false,
        }],
        ..Plan::default()
    };
    let options = Options { out: folder.path().to_owned(), fresh: true, quiet: true };
    run(&plan, &options).map(|(record, _)| record)
}

struct Runner<'a> {
    plan: &'a Plan<'a>,
    cells: PathBuf,
    fresh: bool,
    reuse: Reuse,
    warnings: Vec<String>,
    bar: ProgressBar,
}

impl<'a> Runner<'a> {
    fn new(plan: &'a Plan<'a>, options: &Options) -> Self {
        let bar = progress_bar(plan.scenes.iter().map(|s| work(plan, s)).fold(0, u64::saturating_add), options.quiet);
        Self {
            plan,
            cells: options.out.join("cells"),
            fresh: options.fresh,
            reuse: Reuse::default(),
            warnings: Vec::new(),
            bar,
        }
    }
}

/// Samples that a scene will take at most, over all strategies, replicates and its reference.
fn work(plan: &Plan<'_>, scene: &PlannedScene<'_>) -> u64 {
    let reference = match &scene.reference {
        ReferencePlan::Rendered { estimator, spp, replicates, .. } => {
            spp.saturating_mul(estimator.shape().pixels() as u64).saturating_mul(u64::from(*replicates))
        }
        _ => 0,
    };
    work_of_replicate(plan, scene).saturating_mul(u64::from(plan.replicates)).saturating_add(reference)
}

/// The same for one replicate of all strategies.
fn work_of_replicate(plan: &Plan<'_>, scene: &PlannedScene<'_>) -> u64 {
    let last = *plan.checkpoints.last().expect("a plan has checkpoints");
    let of = |c: &Contender<'_>| {
        let samples = if c.estimator.progressive() { last } else { plan.checkpoints.iter().sum() };
        samples.saturating_mul(c.estimator.shape().pixels() as u64)
    };
    scene.contenders.iter().map(of).fold(0, u64::saturating_add)
}

/// Seconds of sampling that went into a scene's results.
fn sampling_seconds(scene: &SceneResult) -> f64 {
    let last = |s: &StrategyResult| s.checkpoints.last().map_or(0.0, |c| c.seconds.iter().sum());
    scene.strategies.iter().map(last).sum::<f64>() + scene.reference.seconds.unwrap_or(0.0)
}

/// Processor, operating system, architecture.
pub fn machine() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpuinfo.lines().find_map(|l| l.strip_prefix("model name")?.split(": ").nth(1)).unwrap_or("processor");
    format!("{model}, {} {}", std::env::consts::OS, std::env::consts::ARCH)
}
