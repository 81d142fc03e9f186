//! The experiment file as typed data.

pub mod load;
pub mod plan;

use crate::claim::Claim;
use crate::estimator::choice::{DeviceRequest, Traversal};
use crate::estimator::integrand::Integrand;
use crate::estimator::mock::{Distribution, Knobs};
use crate::run::Stop;
use crate::sampling::sequence::Sequence;
use crate::sampling::strategy::{
    Directions, Heuristic, LightChoice, Lights, NoRoulette, Preset, Roulette, Strategy, Technique,
};
use crate::stats::Metric;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// An experiment: one question, the scenes and strategies that answer it, and what is claimed beforehand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Name; results go to `reports/<name>/`.
    pub name: String,
    /// The question that the experiment asks, in one or two sentences.
    pub question: Option<String>,
    /// Film size in pixels; default: the scene's own. For integrands and mocks: how many estimates stand side by side (16 × 16).
    pub film: Option<FilmSize>,
    /// Longest path in edges (1 = emission only), or "none" for unbounded paths; default: the scene's own.
    pub max_depth: Option<MaxDepth>,
    /// The headline metric; the others are measured beside it.
    #[serde(default)]
    pub metric: Metric,
    /// What is kept of the pixels.
    #[serde(default)]
    pub log: Log,
    /// Whether scenes may read files outside their own folders. Not for the file to say: `--allow-outside`.
    #[serde(skip)]
    pub allow_outside: bool,
    /// The only transport that strategies on rendered scenes estimate, and their references, whatever the file says: `--only`.
    #[serde(skip)]
    pub only: Option<Technique>,
    /// Whether nothing is left out that scenes do not call for: `--all-effects`.
    #[serde(skip)]
    pub all_effects: bool,
    /// Pixels [column, row] whose running mean is plotted.
    #[serde(default, deserialize_with = "pairs")]
    pub probes: Vec<[u32; 2]>,
    /// Errors whose cost is stated, in the root of the headline metric (0.01 = 1 %).
    #[serde(default = "default_targets")]
    pub targets: Vec<f64>,
    /// Scenes.
    pub scene: Vec<SceneEntry>,
    /// How much is spent.
    pub budget: Budget,
    /// What errors are measured against; may be left out for integrands and mocks, whose value is known.
    pub reference: Option<ReferenceEntry>,
    /// Strategies; the first is the one that others are compared with.
    pub strategy: Vec<StrategyEntry>,
    /// What is claimed.
    #[serde(default)]
    pub claim: Vec<Claim>,
    /// How often `rootn calibrate` repeats all of it.
    pub calibration: Option<Calibration>,
}

impl Experiment {
    /// A strategy on rendered scenes with transport restricted as the command line asks.
    pub fn restricted(&self, strategy: Strategy) -> Strategy {
        Strategy { technique: self.only.unwrap_or(strategy.technique), ..strategy }
    }
}

/// A repetition of an experiment with fresh random numbers, that holds verdicts and forecasts against the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// How often.
    pub repetitions: u32,
}

/// Lists of exactly two numbers; the TOML reader alone would drop what a longer list holds.
fn pairs<'de, D: serde::Deserializer<'de>>(d: D) -> Result<Vec<[u32; 2]>, D::Error> {
    let pair = |list: Vec<u32>| {
        let found = list.len();
        list.try_into().map_err(|_| serde::de::Error::custom(format!("{found} numbers; a probe is [column, row]")))
    };
    Vec::<Vec<u32>>::deserialize(d)?.into_iter().map(pair).collect()
}

fn default_targets() -> Vec<f64> {
    vec![0.1, 0.05, 0.02, 0.01]
}

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FilmSize {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// A path length, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number of edges or \"none\" is allowed")]
pub enum MaxDepth {
    /// Edges.
    Edges(u32),
    /// Unbounded.
    Unbounded(NoRoulette),
}

/// What is kept of the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Log {
    /// The image over all replicates at the last checkpoint.
    #[default]
    Final,
    /// Also the running mean and sample variance of every replicate at every checkpoint.
    Pixels,
}

/// A scene file, an integrand or a mock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneEntry {
    /// Name in tables; default: the file's stem, the integrand's or the mock's name.
    pub name: Option<String>,
    /// Mitsuba 3 XML file, relative to the experiment file.
    pub file: Option<PathBuf>,
    /// An integral with a known value.
    pub integrand: Option<Integrand>,
    /// Samples of a known distribution with mean 1, seconds by a formula: what tests and calibration hold verdicts against.
    pub mock: Option<Distribution>,
    /// Values for the scene file's `<default>` parameters.
    #[serde(default)]
    pub parameters: std::collections::BTreeMap<String, String>,
}

/// How much is spent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Samples per value and replicate.
    pub spp: u64,
    /// Independent randomisations of each strategy.
    #[serde(default = "default_replicates")]
    pub replicates: u32,
    /// Seed of the whole experiment.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// "decided": on each scene sampling ends when every claim about it is decided, and spp and replicates are the most that
    /// is spent. Claims are looked at after 8, 16, 32 … replicates; the error probability is shared by all looks.
    pub until: Option<Until>,
    /// Each strategy ends at the first N (1, 2, 4 … spp) at which its mean error is at most this, in the root of the
    /// headline metric (0.01 = 1 %), with `confidence`.
    pub relative_error: Option<f64>,
    /// Confidence of `relative_error`, all looks together.
    pub confidence: Option<f64>,
}

/// When sampling ends early.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Until {
    /// When every claim is decided.
    Decided,
}

impl Budget {
    /// When a run ends before all is spent.
    pub fn stop(&self) -> Stop {
        match (self.until, self.relative_error) {
            (Some(Until::Decided), _) => Stop::Decided,
            (None, Some(target)) => Stop::Error { target, confidence: self.confidence.unwrap_or(DEFAULT_CONFIDENCE) },
            (None, None) => Stop::Never,
        }
    }
}

const DEFAULT_CONFIDENCE: f64 = 0.95;

const fn default_replicates() -> u32 {
    16
}

const fn default_seed() -> u64 {
    1
}

/// What errors are measured against: rendered (`spp`), an image, or an exact value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReferenceEntry {
    /// Samples per value and replicate of a rendered reference.
    pub spp: Option<u64>,
    /// Replicates of a rendered reference, at least 32.
    pub replicates: Option<u32>,
    /// EXR file with R, G, B and std_error.R, .G, .B (or stderr.*), relative to the experiment file.
    pub image: Option<PathBuf>,
    /// The value of every pixel and channel.
    pub exact: Option<f64>,
}

/// A preset, single axes, or both (axes win).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrategyEntry {
    /// Name in tables; default: the preset's name.
    pub name: Option<String>,
    /// Named set of axis values that the rest starts from; default: mis.
    pub preset: Option<Preset>,
    /// How directions are drawn.
    pub directions: Option<Directions>,
    /// How points on lights are drawn.
    pub lights: Option<Lights>,
    /// How both are combined.
    pub heuristic: Option<Heuristic>,
    /// Which light is sampled.
    pub light_choice: Option<LightChoice>,
    /// How sample points are arranged.
    pub sequence: Option<Sequence>,
    /// Depth from which Russian roulette may end a path, or "none"; default: the scene's.
    pub roulette_depth: Option<Roulette>,
    /// Which transport is estimated.
    pub technique: Option<Technique>,
    /// Which independent stream of random numbers is used; two strategies that differ in it alone are the same estimator,
    /// sampled independently: what a test against itself needs.
    #[serde(default)]
    pub stream: u32,
    /// How this strategy's samples of a mock differ from the distribution's.
    pub mock: Option<Knobs>,
    /// auto, cpu, vulkan, vulkan:NAME or vulkan:INDEX; default: what the command line says.
    pub device: Option<DeviceRequest>,
    /// How rays find what they meet on a Vulkan device; default: what the command line says.
    pub traversal: Option<Traversal>,
}

impl StrategyEntry {
    /// Name and axis values.
    pub fn resolve(&self) -> (String, Strategy) {
        let preset = self.preset.unwrap_or(Preset::Mis);
        let base = preset.strategy();
        let strategy = Strategy {
            directions: self.directions.unwrap_or(base.directions),
            lights: self.lights.unwrap_or(base.lights),
            heuristic: self.heuristic.unwrap_or(base.heuristic),
            light_choice: self.light_choice.unwrap_or(base.light_choice),
            sequence: self.sequence.unwrap_or(base.sequence),
            roulette: self.roulette_depth.or(base.roulette),
            technique: self.technique.unwrap_or(base.technique),
            stream: self.stream,
        };
        (self.name.clone().unwrap_or_else(|| preset.label().to_owned()), strategy)
    }
}

/// The JSON schema (draft 07, which editors understand) of experiment files.
pub fn schema() -> String {
    let settings = schemars::generate::SchemaSettings::draft07();
    let schema = settings.into_generator().into_root_schema_for::<Experiment>();
    serde_json::to_string_pretty(&schema).expect("plain data") + "\n"
}
