//! Strategies: every axis along which sampling can differ, and the presets.

use super::sequence::Sequence;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How directions are drawn at a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Directions {
    /// Uniformly over the hemisphere (the whole sphere on transmissive surfaces).
    Uniform,
    /// Proportional to the cosine with the shading normal.
    Cosine,
    /// By the BSDF's own importance sampling.
    #[default]
    Bsdf,
}

/// How points on lights are drawn for next-event estimation. Point lights are always sampled, with weight 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lights {
    /// Lights with an extent are found by chance only.
    None,
    /// Uniformly over their area (environments: by solid angle).
    #[default]
    Area,
    /// Uniformly over the solid angle they subtend: spherical triangles and rectangles, cones for spheres; disks and cylinders by area.
    SolidAngle,
}

/// How light sampling and direction sampling are combined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Heuristic {
    /// Light sampling alone: emission met by chance counts only where light sampling cannot reach.
    None,
    /// p₁/(p₁+p₂). Veach 1997, §9.2.2.
    Balance,
    /// p₁²/(p₁²+p₂²). Veach 1997, §9.2.3.
    #[default]
    Power,
    /// Densities below a tenth of the largest count as 0. Veach 1997, §9.2.3 (α = 0.1).
    Cutoff,
    /// All weight to the larger density, half each where they are equal up to rounding. Veach 1997, §9.2.3.
    Maximum,
}

/// Which light is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LightChoice {
    /// Every light equally often.
    Uniform,
    /// Proportional to emitted power.
    #[default]
    Power,
}

/// Which transport is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Technique {
    /// All paths up to the depth limit.
    #[default]
    #[value(skip)]
    Path,
    /// Emission and light scattered once: paths of at most two edges.
    Direct,
}

/// From which depth on Russian roulette may end a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a depth in edges or \"none\" is allowed")]
pub enum Roulette {
    /// From this depth (edges).
    Depth(u32),
    /// Never.
    Never(NoRoulette),
}

/// The word `none`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoRoulette {
    /// Roulette is off.
    None,
}

/// A named set of axis values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Uniform directions, no light sampling.
    Uniform,
    /// Cosine directions, no light sampling.
    Cosine,
    /// BSDF directions, no light sampling.
    Importance,
    /// Light sampling alone.
    Light,
    /// MIS with jittered strata.
    Stratified,
    /// MIS of BSDF and light sampling.
    Mis,
    /// MIS with Owen-scrambled Sobol points.
    Sobol,
}

impl Preset {
    /// All presets, in the order of tables.
    pub const ALL: [Self; 7] =
        [Self::Uniform, Self::Cosine, Self::Importance, Self::Light, Self::Stratified, Self::Mis, Self::Sobol];

    /// The name in files and tables.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Cosine => "cosine",
            Self::Importance => "importance",
            Self::Light => "light",
            Self::Stratified => "stratified",
            Self::Mis => "mis",
            Self::Sobol => "sobol",
        }
    }

    /// The axis values that the preset stands for; roulette as the scene says.
    pub const fn strategy(self) -> Strategy {
        let mis = Strategy {
            directions: Directions::Bsdf,
            lights: Lights::Area,
            heuristic: Heuristic::Power,
            light_choice: LightChoice::Power,
            sequence: Sequence::Independent,
            roulette: None,
            technique: Technique::Path,
            stream: 0,
        };
        match self {
            Self::Uniform => Strategy { directions: Directions::Uniform, lights: Lights::None, ..mis },
            Self::Cosine => Strategy { directions: Directions::Cosine, lights: Lights::None, ..mis },
            Self::Importance => Strategy { lights: Lights::None, ..mis },
            Self::Light => Strategy { heuristic: Heuristic::None, ..mis },
            Self::Stratified => Strategy { sequence: Sequence::Stratified, ..mis },
            Self::Mis => mis,
            Self::Sobol => Strategy { sequence: Sequence::Sobol, ..mis },
        }
    }
}

/// How an estimator draws its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Strategy {
    /// Direction sampling.
    pub directions: Directions,
    /// Light sampling.
    pub lights: Lights,
    /// Combination of the two.
    pub heuristic: Heuristic,
    /// Choice among lights.
    pub light_choice: LightChoice,
    /// Arrangement of sample points.
    pub sequence: Sequence,
    /// Russian roulette; `None` = as the scene says.
    pub roulette: Option<Roulette>,
    /// Transport technique.
    pub technique: Technique,
    /// Which independent stream of random numbers: strategies that differ in it alone are the same estimator, sampled
    /// independently.
    #[serde(default, skip_serializing_if = "is_first")]
    pub stream: u32,
}

fn is_first(stream: &u32) -> bool {
    *stream == 0
}

impl Strategy {
    /// The text that stands for the strategy in keys and hashes: equal exactly where the samples are equal.
    pub fn identity(&self) -> String {
        serde_json::to_string(self).expect("plain data")
    }
}
