//! What a calibration leaves: how often verdicts, intervals and forecasts were right.

use serde::{Deserialize, Serialize};

/// Outcomes of all repetitions of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Name of the experiment.
    pub name: String,
    /// The question, in the author's words.
    pub question: Option<String>,
    /// The experiment file.
    pub experiment: String,
    /// How often it was repeated.
    pub repetitions: u32,
    /// Replicates of each strategy in a repetition, at most.
    pub replicates: u32,
    /// Verdicts, by scene and claim.
    pub verdicts: Vec<Verdicts>,
    /// Forecasts, by scene, strategy and wanted error.
    pub forecasts: Vec<Forecasts>,
}

/// How one claim fared on one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdicts {
    /// Scene.
    pub scene: String,
    /// The claim in words.
    pub text: String,
    /// Its kind.
    pub kind: String,
    /// Confidence of its intervals.
    pub confidence: f64,
    /// What the quantity is in truth; `None` where it has no value, so that any decision is wrong.
    pub truth: Option<f64>,
    /// Whether the claim is true.
    pub holds: Option<bool>,
    /// Largest probability of a wrong verdict that the claim's confidence allows.
    pub nominal_error: f64,
    /// Whether all looks share that probability, so that intervals at the last of them need not cover the truth as often as
    /// they say.
    pub sequential: bool,
    /// Outcomes at each N.
    pub points: Vec<Outcomes>,
    /// Where the claim is false: with as many samples as the tool asks for.
    pub power: Option<Power>,
}

/// Counts of outcomes at an N.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcomes {
    /// Samples per value and replicate.
    pub spp: u64,
    /// Median over repetitions of the larger variance of the variance of the claim's strategies: (kurtosis − 1) / number of samples,
    /// where all values are of one distribution. `None` without samples.
    pub variance_of_variance: Option<f64>,
    /// Supported.
    pub supported: u32,
    /// Refuted.
    pub refuted: u32,
    /// Neither, for want of data.
    pub open: u32,
    /// Neither, because the tool does not trust its own interval.
    pub doubtful: u32,
    /// Intervals that hold the truth, of those that the tool trusts.
    pub covered: u32,
    /// Intervals that hold the truth, of those that it does not trust.
    pub covered_doubtful: u32,
}

impl Outcomes {
    /// All verdicts.
    pub const fn total(&self) -> u32 {
        self.trusted() + self.doubtful
    }

    /// Intervals that hold the truth.
    pub const fn holding(&self) -> u32 {
        self.covered + self.covered_doubtful
    }

    /// Verdicts that the tool trusts its interval for.
    pub const fn trusted(&self) -> u32 {
        self.supported + self.refuted + self.open
    }
}

/// How often a difference is found at the budget that the tool predicts from a pilot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Power {
    /// Median over repetitions of the samples per value and replicate that the tool asks for.
    pub spp: f64,
    /// Repetitions in which it asked for some.
    pub trials: u32,
    /// Verdicts that found the claim wrong.
    pub found: u32,
    /// Verdicts that called it supported.
    pub missed: u32,
}

/// How often one more run needs what was predicted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forecasts {
    /// Scene.
    pub scene: String,
    /// Strategy.
    pub strategy: String,
    /// Wanted error, in the root of the headline metric.
    pub target: f64,
    /// Confidence of the prediction intervals.
    pub confidence: f64,
    /// Samples per value of the pilot.
    pub pilot: u64,
    /// Median over repetitions of the predicted samples per value.
    pub spp: f64,
    /// Repetitions with a prediction.
    pub trials: u32,
    /// Runs that needed as many samples as predicted.
    pub spp_held: u32,
    /// Runs that needed as many seconds as predicted; `None` where repetitions competed for the processor.
    pub seconds_held: Option<u32>,
}
