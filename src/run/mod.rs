//! The one place that walks the flow: cells, then estimates at checkpoints, then statistics, verdicts, record.

mod image;
mod plan;
mod reference;
mod sample;

pub(crate) use image::file_name;
pub use plan::{Contender, Plan, PlannedScene, ReferencePlan, powers_of_two};
pub use sample::{progress_bar, sample};

use crate::analysis::scene::{Analysed, Reference, Settings, Subject, analyse, compare_with_first};
use crate::error::{Error, Result};
use crate::estimator::{Cell, Estimate, Estimator};
use crate::moments::cell::{CellFolder, Checkpoint, Saving};
use crate::record::{FORMAT, Provenance, Record, SceneResult, StrategyResult};
use crate::sampling::{Key, Role, Strategy};
use crate::stats::Metric;
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};

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
    let mut scenes = Vec::new();
    for scene in &plan.scenes {
        scenes.push(runner.scene(scene, &folder)?);
    }
    runner.bar.finish_and_clear();
    let claims = plan.claims.iter().flat_map(|c| c.judge(&scenes)).collect();
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
        question: None,
        experiment: String::new(),
        seed: 1,
        replicates,
        checkpoints: powers_of_two(samples),
        metrics: vec![Metric::RelMse],
        targets: vec![0.01],
        probes: Vec::new(),
        log_pixels: false,
        scenes: vec![PlannedScene {
            name: name.into(),
            contenders: vec![contender],
            reference: ReferencePlan::Exact(exact),
            max_depth: None,
        }],
        claims: Vec::new(),
        devices: Vec::new(),
        warnings: Vec::new(),
    };
    let options = Options { out: folder.path().to_owned(), fresh: true, quiet: true };
    run(&plan, &options).map(|(record, _)| record)
}

/// One replicate of one estimator, being sampled: the estimate so far and where it is kept.
struct Track<'a> {
    estimator: &'a dyn Estimator,
    /// The estimator's identity, role, seed and replicate as text.
    identity: String,
    key: Key,
    current: Option<Estimate>,
    /// Samples per value of the state on disk, once it was read or written; 0 before.
    stored: u64,
    saving: Saving,
    /// The state is kept at this checkpoint and all later ones.
    last: u64,
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

    fn scene(&mut self, scene: &PlannedScene<'_>, folder: &Path) -> Result<SceneResult> {
        let shape = scene.contenders[0].estimator.shape();
        let (reference, described) = self.reference(scene, folder)?;
        self.sample(scene)?;
        let settings = Settings {
            shape,
            metrics: &self.plan.metrics,
            targets: &self.plan.targets,
            probes: &self.plan.probes,
            checkpoints: &self.plan.checkpoints,
            replicates: self.plan.replicates,
        };
        let mut analysed = Vec::new();
        for contender in &scene.contenders {
            self.bar.set_message(format!("{} · analysing", scene.name));
            analysed.push(self.analyse(contender, &settings, &reference)?);
        }
        compare_with_first(&mut analysed);
        for (a, contender) in analysed.iter_mut().zip(&scene.contenders) {
            self.images(a, contender, scene, folder)?;
        }
        let strategies: Vec<StrategyResult> = analysed.into_iter().map(|a| a.result).collect();
        self.warn_of(&scene.name, &strategies);
        Ok(SceneResult {
            name: scene.name.clone(),
            shape: [shape.width, shape.height, shape.channels],
            abscissa: scene.contenders[0].estimator.abscissa().into(),
            max_depth: scene.max_depth,
            reference: described,
            targets: self.plan.targets.clone(),
            strategies,
        })
    }

    /// Strategies take turns at every checkpoint of a replicate, so that drift of the machine hits all alike.
    fn sample(&mut self, scene: &PlannedScene<'_>) -> Result<()> {
        self.warm_up(scene)?;
        for replicate in 0..self.plan.replicates {
            let mut tracks: Vec<Track<'_>> =
                scene.contenders.iter().map(|c| self.track(&*c.estimator, &c.strategy, Role::Run, replicate)).collect();
            for &n in &self.plan.checkpoints {
                for (i, contender) in scene.contenders.iter().enumerate() {
                    self.bar.set_message(format!("{} · {}", scene.name, contender.name));
                    if let Err(e) = self.advance(&mut tracks[i], n) {
                        self.keep_states(&tracks)?;
                        return Err(e);
                    }
                }
            }
        }
        Ok(())
    }

    /// The states of all tracks that are further on than what is on disk.
    fn keep_states(&self, tracks: &[Track<'_>]) -> Result<()> {
        for track in tracks {
            if let Some(estimate) = track.current.as_ref().filter(|e| e.abscissa > track.stored) {
                let shape = track.estimator.shape();
                self.folder(track, estimate.abscissa).save_state(estimate, shape.pixels(), shape.channels)?;
            }
        }
        Ok(())
    }

    /// Runs one sample of every strategy that has anything left to compute, and throws it away.
    fn warm_up(&self, scene: &PlannedScene<'_>) -> Result<()> {
        for c in &scene.contenders {
            let track = self.track(&*c.estimator, &c.strategy, Role::Run, 0);
            let last = *self.plan.checkpoints.last().expect("a plan has checkpoints");
            if self.fresh || !self.folder(&track, last).has(last) {
                c.estimator.estimate(&Cell { key: track.key, length: 1 }, 1, &mut None)?;
            }
        }
        Ok(())
    }

    fn track<'e>(&self, estimator: &'e dyn Estimator, strategy: &Strategy, role: Role, replicate: u32) -> Track<'e> {
        let seed = self.plan.seed;
        let identity = format!(
            "rootn {} · {} · seed {seed} · {} · replicate {replicate}",
            env!("CARGO_PKG_VERSION"),
            estimator.identity(),
            role.name()
        );
        Track {
            estimator,
            identity,
            key: Key::new(seed, role, &strategy.identity(), replicate),
            current: None,
            stored: 0,
            saving: Saving::default(),
            last: match role {
                Role::Run => self.plan.checkpoints.last().copied().unwrap_or(0),
                Role::Reference => 0,
            },
        }
    }

    /// Where the estimate at `n` of a track is kept. Sequences that are not progressive have a cell per N.
    fn folder(&self, track: &Track<'_>, n: u64) -> CellFolder {
        let identity = match track.estimator.progressive() {
            true => track.identity.clone(),
            false => format!("{} · length {n}", track.identity),
        };
        CellFolder::new(&self.cells, identity)
    }

    /// The checkpoint `n` of a track: from disk, or sampled now and kept.
    fn advance(&mut self, track: &mut Track<'_>, n: u64) -> Result<Checkpoint> {
        let folder = self.folder(track, n);
        let shape = track.estimator.shape();
        let before = if track.estimator.progressive() { self.previous(n) } else { 0 };
        let samples = (n - before).saturating_mul(shape.pixels() as u64);
        if self.fresh && track.current.is_none() {
            folder.remove()?;
        }
        match folder.load_checkpoint(n, shape.values()) {
            Ok(Some(found)) => {
                self.reuse.reused += 1;
                self.bar.set_length(self.bar.length().unwrap_or(0).saturating_sub(samples));
                return Ok(found);
            }
            Err(e @ Error::Damaged { .. }) => self.warn_damaged(&e),
            Err(e) => return Err(e),
            Ok(None) => {}
        }
        track.current = self.resume(track, &folder, n)?;
        // What a killed run left no state of is sampled again.
        let again = before.saturating_sub(track.current.as_ref().map_or(0, |e| e.abscissa));
        self.bar.inc_length(again.saturating_mul(shape.pixels() as u64));
        let cell = Cell { key: track.key, length: n };
        let sampled = sample(track.estimator, &cell, n, &mut track.current, &self.bar);
        // A state that is further on stays. That one cannot be kept is told before why it has to be.
        let keep = |e: &Estimate, stored: u64| match e.abscissa > stored {
            true => folder.save_state(e, shape.pixels(), shape.channels),
            false => Ok(()),
        };
        if let (Err(_), Some(kept)) = (&sampled, track.current.take()) {
            keep(&kept, track.stored)?;
        }
        let (estimate, interrupted) = sampled?;
        if interrupted && estimate.abscissa < n {
            keep(&estimate, track.stored)?;
            return Err(Error::Interrupted);
        }
        let checkpoint = Checkpoint::of(&estimate);
        folder.save_checkpoint(n, &checkpoint)?;
        self.reuse.computed += 1;
        if track.estimator.progressive() {
            // A state that is further on stays: longer runs continue from it.
            if n > track.stored && (n >= track.last || track.saving.is_worth_it(estimate.seconds)) {
                track.saving.write(&folder, &estimate, shape.pixels(), shape.channels)?;
                track.stored = n;
            }
            track.current = Some(estimate);
        } else if track.stored > 0 {
            // An interrupted run left it; nothing continues from here.
            folder.remove_state()?;
            track.stored = 0;
        }
        if interrupted {
            return Err(Error::Interrupted);
        }
        Ok(checkpoint)
    }

    /// The checkpoint before `n`, or 0.
    fn previous(&self, n: u64) -> u64 {
        self.plan.checkpoints.iter().copied().take_while(|&c| c < n).last().unwrap_or(0)
    }

    /// The estimate to continue from: the track's own, or the state on disk, where it does not lie beyond `n`.
    fn resume(&mut self, track: &mut Track<'_>, folder: &CellFolder, n: u64) -> Result<Option<Estimate>> {
        let current = track.current.take();
        if current.as_ref().is_some_and(|e| e.abscissa >= track.stored || n < track.stored) {
            return Ok(current);
        }
        let shape = track.estimator.shape();
        match folder.load_state(shape.pixels(), shape.channels) {
            Ok(state) => {
                track.stored = state.as_ref().map_or(0, |e| e.abscissa);
                track.saving = Saving::from_disk(state.as_ref().map_or(0.0, |e| e.seconds));
                Ok(state.filter(|e| e.abscissa <= n).or(current))
            }
            Err(e @ Error::Damaged { .. }) => {
                self.warn_damaged(&e);
                (track.stored, track.saving) = (0, Saving::default());
                Ok(current)
            }
            Err(e) => Err(e),
        }
    }

    fn warn_damaged(&mut self, e: &Error) {
        self.warnings.push(format!("recomputed a stored result: {e}"));
    }
}

impl Runner<'_> {
    fn analyse(&mut self, c: &Contender<'_>, settings: &Settings<'_>, reference: &Reference) -> Result<Analysed> {
        let subject = Subject {
            name: c.name.clone(),
            device: c.device.clone(),
            strategy: c.strategy,
            dependence: c.estimator.dependence(),
            setup_seconds: c.estimator.setup_seconds(),
        };
        analyse(subject, settings, reference, |replicate, n| self.stored(c, replicate, n))
    }

    /// A checkpoint that sampling has left on disk.
    fn stored(&self, c: &Contender<'_>, replicate: u32, n: u64) -> Result<Checkpoint> {
        let track = self.track(&*c.estimator, &c.strategy, Role::Run, replicate);
        let folder = self.folder(&track, n);
        let found = folder.load_checkpoint(n, c.estimator.shape().values())?;
        found.ok_or_else(|| Error::damaged(&self.cells, format!("the cell of {} at N = {n} has vanished", c.name)))
    }

    fn warn_of(&mut self, scene: &str, strategies: &[StrategyResult]) {
        for s in strategies.iter().filter(|s| s.non_finite.count > 0) {
            let (replicate, pixel, sample) = s.non_finite.first.first().copied().unwrap_or_default();
            self.warnings.push(format!(
                "{scene}, {}: {} non-finite samples, kept out of the mean (the estimate is not to be trusted); first in \
                 replicate {replicate}, pixel {pixel}, sample {sample}: see `rootn replay`",
                s.name, s.non_finite.count
            ));
        }
    }
}

/// Samples that a scene will take, over all strategies, replicates and its reference.
fn work(plan: &Plan<'_>, scene: &PlannedScene<'_>) -> u64 {
    let last = *plan.checkpoints.last().expect("a plan has checkpoints");
    let run = |c: &Contender<'_>| {
        let samples = if c.estimator.progressive() { last } else { plan.checkpoints.iter().sum() };
        samples.saturating_mul(c.estimator.shape().pixels() as u64).saturating_mul(u64::from(plan.replicates))
    };
    let reference = match &scene.reference {
        ReferencePlan::Rendered { estimator, spp, replicates, .. } => {
            spp.saturating_mul(estimator.shape().pixels() as u64).saturating_mul(u64::from(*replicates))
        }
        _ => 0,
    };
    scene.contenders.iter().map(run).fold(reference, u64::saturating_add)
}

/// Seconds of sampling that went into a scene's results.
fn sampling_seconds(scene: &SceneResult) -> f64 {
    let last = |s: &StrategyResult| s.checkpoints.last().map_or(0.0, |c| c.seconds.iter().sum());
    scene.strategies.iter().map(last).sum::<f64>() + scene.reference.seconds.unwrap_or(0.0)
}

/// Processor, operating system, architecture.
fn machine() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpuinfo.lines().find_map(|l| l.strip_prefix("model name")?.split(": ").nth(1)).unwrap_or("processor");
    format!("{model}, {} {}", std::env::consts::OS, std::env::consts::ARCH)
}
