use super::render::Settings;
use super::{print, use_threads};
use crate::claim::known;
use crate::error::{Error, Place, Result};
use crate::estimator::cpu::{CpuEstimator, PreparedScene};
use crate::estimator::{Estimator, dependence_of};
use crate::experiment::{self, Experiment};
use crate::record::{Dependence, LargestSample, Record};
use crate::sampling::strategy::{Preset, Strategy};
use crate::sampling::{Draw, Key, Role};
use crate::stats::number::{about, significant};
use crate::transport::sink::Recorder;
use std::path::PathBuf;
use std::sync::Arc;

/// Traces samples again and prints their paths vertex by vertex: positions, densities, weights, contributions.
#[derive(clap::Args)]
pub struct Replay {
    /// Scene file (Mitsuba 3 XML), or experiment file (TOML).
    file: PathBuf,
    /// Pixel.
    #[arg(long, value_name = "X,Y", value_parser = pixel, required_unless_present = "largest")]
    pixel: Option<[u32; 2]>,
    /// Index of the sample, from 0.
    #[arg(long, default_value_t = 0)]
    sample: u64,
    /// The K samples that make most of the variance, as the experiment's record names them (at most 8).
    #[arg(long, value_name = "K", conflicts_with_all = ["pixel", "sample", "replicate", "spp"])]
    largest: Option<usize>,
    /// Sampling strategy: a preset; of an experiment: the strategy's name, default: its first.
    #[arg(long, value_name = "NAME")]
    strategy: Option<String>,
    /// Scene of an experiment; default: its first.
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
    /// Folder with the results of the experiment.
    #[arg(long, value_name = "DIR", default_value = "reports")]
    out: PathBuf,
    /// Replicate of the experiment; `render` is replicate 0.
    #[arg(long, default_value_t = 0)]
    replicate: u32,
    /// Samples per pixel of the whole run, on which stratified points depend; default: 64, or the experiment's.
    #[arg(long)]
    spp: Option<u64>,
    #[command(flatten)]
    settings: Settings,
    /// Print JSON: the events of the path and the sample's radiance.
    #[arg(long)]
    json: bool,
}

/// Parses `x,y`.
fn pixel(text: &str) -> std::result::Result<[u32; 2], String> {
    let parts: Vec<u32> =
        text.split(',').map(|t| t.trim().parse()).collect::<std::result::Result<_, _>>().unwrap_or_default();
    <[u32; 2]>::try_from(parts).map_err(|_| "expected X,Y".into())
}

/// What a sample is traced with.
struct Tracer {
    estimator: CpuEstimator,
    strategy: Strategy,
    seed: u64,
    spp: u64,
}

/// Which sample.
struct Wanted {
    replicate: u32,
    pixel: [u32; 2],
    sample: u64,
    /// What is known of it: a line, channel and value.
    known: Option<(String, usize, f64)>,
}

impl Replay {
    pub(super) fn execute(self) -> Result<()> {
        use_threads(Some(1))?;
        let (tracer, wanted) = match self.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            true => self.of_experiment()?,
            false => self.of_scene()?,
        };
        let samples = wanted.iter().map(|w| tracer.trace(w, self.json)).collect::<Result<Vec<_>>>()?;
        print(&match (self.json, self.largest) {
            (true, Some(_)) => format!("[{}]\n", samples.join(",\n")),
            (true, None) => samples.join("") + "\n",
            (false, _) => samples.join("\n"),
        })
    }

    fn pixel(&self) -> Wanted {
        let pixel = self.pixel.expect("asked for by the parser");
        Wanted { replicate: self.replicate, pixel, sample: self.sample, known: None }
    }

    fn estimator(&self, prepared: PreparedScene, strategy: Strategy) -> CpuEstimator {
        let estimator = CpuEstimator::new(Arc::new(prepared), strategy);
        if self.settings.transport.all_effects { estimator.with_all_effects() } else { estimator }
    }

    fn of_scene(&self) -> Result<(Tracer, Vec<Wanted>)> {
        if self.largest.is_some() || self.scene.is_some() {
            return Err(Error::Usage("--largest and --scene are for experiments (TOML)".into()));
        }
        let name = self.strategy.as_deref().unwrap_or(Preset::Mis.label());
        known("preset", name, &Preset::ALL.map(Preset::label)).map_err(Error::Usage)?;
        let preset = Preset::ALL.into_iter().find(|p| p.label() == name).expect("it is known");
        let strategy = self.settings.strategy(preset);
        let estimator = self.estimator(self.settings.prepare(&self.file)?, strategy);
        let tracer = Tracer { estimator, strategy, seed: self.settings.seed, spp: self.spp.unwrap_or(64) };
        Ok((tracer, vec![self.pixel()]))
    }

    fn of_experiment(&self) -> Result<(Tracer, Vec<Wanted>)> {
        if !self.settings.is_default() {
            let message = "film, depth, roulette, seed and parameters of an experiment are those of its file";
            return Err(Error::Usage(message.into()));
        }
        let (mut experiment, _) = experiment::load::load(&self.file, &[])?;
        experiment.allow_outside = self.settings.reading.allow_outside;
        self.settings.transport.apply(&mut experiment);
        let scenes: Vec<String> = experiment.scene.iter().map(|s| s.label()).collect();
        let strategies: Vec<(String, Strategy)> = experiment
            .strategy
            .iter()
            .map(|s| s.resolve())
            .map(|(name, strategy)| (name, experiment.restricted(strategy)))
            .collect();
        let names: Vec<String> = strategies.iter().map(|s| s.0.clone()).collect();
        let scene = self.named("scene", self.scene.as_deref(), &scenes)?;
        let (name, strategy) = &strategies[self.named("strategy", self.strategy.as_deref(), &names)?];
        let entry = &experiment.scene[scene];
        if entry.file.is_none() {
            let message = format!("`{}` is no rendered scene: there are no paths to replay", scenes[scene]);
            return Err(Error::input(Place::file(&self.file), message));
        }
        let prepared = PreparedScene::new(experiment::plan::read_scene(&experiment, entry, &self.file)?)?;
        let estimator = self.estimator(prepared, *strategy);
        let spp = self.spp.unwrap_or(experiment.budget.spp);
        let tracer = Tracer { estimator, strategy: *strategy, seed: experiment.budget.seed, spp };
        match self.largest {
            None => Ok((tracer, vec![self.pixel()])),
            Some(k) => {
                let (seed, spp, largest) = self.recorded(&experiment, &scenes[scene], name)?;
                let wanted = largest.iter().take(k).map(wanted).collect();
                Ok((Tracer { seed, spp, ..tracer }, wanted))
            }
        }
    }

    /// The place of a name in a list; without a name the first.
    fn named(&self, what: &str, name: Option<&str>, all: &[String]) -> Result<usize> {
        let Some(name) = name else { return Ok(0) };
        let names: Vec<&str> = all.iter().map(String::as_str).collect();
        known(what, name, &names).map_err(|message| Error::input(Place::file(&self.file), message))?;
        Ok(names.iter().position(|n| *n == name).expect("it is known"))
    }

    /// Seed and samples per pixel of a strategy's run, and its largest samples.
    fn recorded(&self, experiment: &Experiment, scene: &str, strategy: &str) -> Result<(u64, u64, Vec<LargestSample>)> {
        let folder = self.out.join(&experiment.name);
        let record = Record::load(&folder)?;
        let found = record.scenes.iter().find(|s| s.name == scene);
        let found = found.and_then(|s| s.strategies.iter().find(|s| s.name == strategy));
        let seed = record.provenance.seed;
        let found = found.and_then(|s| Some((seed, s.checkpoints.last()?.spp, s.health.as_ref()?.largest.clone())));
        found.ok_or_else(|| {
            let message = format!("it names no samples of {strategy} on {scene}; run the experiment again");
            Error::damaged(folder.join("record.json"), message)
        })
    }
}

fn wanted(l: &LargestSample) -> Wanted {
    let channel = ["red", "green", "blue"].get(l.channel as usize).copied().unwrap_or("value");
    let (share, value) = (about(l.share), significant(l.value, 4));
    let ([x, y], sample, replicate) = (l.pixel, l.sample, l.replicate);
    let heading =
        format!("replicate {replicate}, pixel ({x}, {y}), sample {sample}: {channel} {value}, {share} of the variance");
    Wanted { replicate, pixel: l.pixel, sample, known: Some((heading, l.channel as usize, l.value)) }
}

impl Tracer {
    /// The path of a sample as text or JSON.
    fn trace(&self, wanted: &Wanted, json: bool) -> Result<String> {
        let shape = self.estimator.shape();
        let [x, y] = wanted.pixel.map(|v| v as usize);
        if x >= shape.width || y >= shape.height {
            let message = format!("--pixel {x},{y} lies outside the film of {} × {}", shape.width, shape.height);
            return Err(Error::Usage(message));
        }
        if dependence_of(self.strategy.sequence) != Dependence::Independent && wanted.sample >= self.spp {
            return Err(Error::Usage(format!("--sample {}: the run has --spp {} samples", wanted.sample, self.spp)));
        }
        let draw = Draw {
            key: Key::new(self.seed, Role::Run, &self.strategy.identity(), wanted.replicate),
            pixel: (y * shape.width + x) as u32,
            sample: wanted.sample,
            length: self.spp,
            sequence: self.strategy.sequence,
        };
        let mut recorder = Recorder::default();
        let value = self.estimator.sample_with(&draw, &mut recorder);
        if let Some((heading, channel, expected)) = &wanted.known {
            // Devices may differ by rounding.
            let found = value.to_array().get(*channel).copied().unwrap_or(0.0);
            if (f64::from(found) - expected).abs() > 1e-3 * expected.abs() {
                let message = format!(
                    "{heading}; now it is {}: since the run, the scene or the experiment has changed",
                    significant(found.into(), 4)
                );
                return Err(Error::Usage(message));
            }
        }
        Ok(match json {
            true => {
                let path = serde_json::json!({ "events": recorder.events, "radiance": value.to_array() });
                serde_json::to_string_pretty(&path).expect("plain data")
            }
            // Shortest digits that give the very same float.
            false => {
                let heading = wanted.known.as_ref().map(|k| format!("{}\n", k.0)).unwrap_or_default();
                format!("{heading}{recorder}radiance ({:e}, {:e}, {:e})\n", value.x, value.y, value.z)
            }
        })
    }
}
