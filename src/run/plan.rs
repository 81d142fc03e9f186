//! What a run is asked to do.

use crate::analysis::scene::Reference;
use crate::claim::Claim;
use crate::estimator::Estimator;
use crate::record::DeviceNote;
use crate::sampling::Strategy;
use crate::stats::Metric;
use crate::stats::sequential::spend;
use std::path::PathBuf;

/// Everything that a run needs, resolved and checked. The default has no checkpoints, metrics and replicates, which every plan
/// needs.
#[derive(Default)]
pub struct Plan<'a> {
    /// Name of the experiment.
    pub name: String,
    /// The question, in the author's words.
    pub question: Option<String>,
    /// The experiment file, verbatim.
    pub experiment: String,
    /// Experiment seed.
    pub seed: u64,
    /// Replicates per strategy.
    pub replicates: u32,
    /// When to stop before all is spent.
    pub stop: Stop,
    /// Values of N at which the running estimate is looked at, ascending.
    pub checkpoints: Vec<u64>,
    /// Metrics, the headline one first.
    pub metrics: Vec<Metric>,
    /// Wanted errors.
    pub targets: Vec<f64>,
    /// Probe pixels.
    pub probes: Vec<[u32; 2]>,
    /// Keep images of every checkpoint and replicate, not only the last over all replicates.
    pub log_pixels: bool,
    /// Scenes with their contenders.
    pub scenes: Vec<PlannedScene<'a>>,
    /// Claims to judge.
    pub claims: Vec<Claim>,
    /// Devices that were taken, and why.
    pub devices: Vec<DeviceNote>,
    /// What was found odd while planning.
    pub warnings: Vec<String>,
}

/// When a run ends before its budget is spent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Stop {
    /// Never.
    #[default]
    Never,
    /// On each scene when every claim about it is decided: looked at after certain numbers of replicates.
    Decided,
    /// For each strategy at the first N at which the error, in the root of the headline metric, is at most so large with this
    /// confidence.
    Error {
        /// The error.
        target: f64,
        /// The confidence, all looks together.
        confidence: f64,
    },
}

/// A look at the claims.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// After so many replicates.
    pub replicates: u32,
    /// Share of the error probability that this look may spend.
    pub share: f64,
}

/// Fewest replicates that claims are looked at with.
const FIRST_LOOK: u32 = 8;

impl Plan<'_> {
    /// When claims are looked at: once at the end, or, to stop as soon as they are decided, after each doubling.
    pub fn looks(&self) -> Vec<Look> {
        if self.stop != Stop::Decided {
            return vec![Look { replicates: self.replicates, share: 1.0 }];
        }
        let halves = std::iter::successors(Some(self.replicates), |r| Some(r / 2));
        let mut replicates: Vec<u32> = halves.take_while(|&r| r >= FIRST_LOOK).collect();
        if replicates.is_empty() {
            replicates.push(self.replicates);
        }
        replicates.reverse();
        let fractions: Vec<f64> = replicates.iter().map(|&r| f64::from(r) / f64::from(self.replicates)).collect();
        let shares = spend(&fractions, 1.0);
        replicates.into_iter().zip(shares).map(|(replicates, share)| Look { replicates, share }).collect()
    }
}

/// One scene or integrand and who is measured on it.
pub struct PlannedScene<'a> {
    /// Name.
    pub name: String,
    /// Strategies, in the order of tables.
    pub contenders: Vec<Contender<'a>>,
    /// What errors are measured against.
    pub reference: ReferencePlan<'a>,
    /// Longest path, where paths are traced and bounded.
    pub max_depth: Option<u32>,
    /// Whether paths are traced.
    pub rendered: bool,
}

/// A named estimator.
pub struct Contender<'a> {
    /// Name of the strategy.
    pub name: String,
    /// Device it runs on.
    pub device: String,
    /// Its axis values.
    pub strategy: Strategy,
    /// The estimator.
    pub estimator: Box<dyn Estimator + 'a>,
}

/// Where the truth comes from.
pub enum ReferencePlan<'a> {
    /// Every value is this.
    Exact(f64),
    /// An image with its standard error.
    Image {
        /// The file.
        path: PathBuf,
        /// Its values and their variance.
        reference: Reference,
    },
    /// To be rendered.
    Rendered {
        /// By this estimator.
        estimator: Box<dyn Estimator + 'a>,
        /// Its name.
        name: String,
        /// Samples per value and replicate.
        spp: u64,
        /// Replicates.
        replicates: u32,
    },
}

/// Powers of two up to `last`, and `last` itself.
pub fn powers_of_two(last: u64) -> Vec<u64> {
    let mut n: Vec<u64> = (0..64).map(|k| 1 << k).take_while(|&n| n <= last).collect();
    if n.last() != Some(&last) {
        n.push(last);
    }
    n
}
