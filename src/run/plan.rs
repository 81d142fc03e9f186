//! What a run is asked to do.

use crate::analysis::scene::Reference;
use crate::claim::Claim;
use crate::estimator::Estimator;
use crate::record::DeviceNote;
use crate::sampling::Strategy;
use crate::stats::Metric;
use std::path::PathBuf;

/// Everything that a run needs, resolved and checked.
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

/// One scene or integrand and who is measured on it.
pub struct PlannedScene<'a> {
    /// Name.
    pub name: String,
    /// Strategies, in the order of tables.
    pub contenders: Vec<Contender<'a>>,
    /// What errors are measured against.
    pub reference: ReferencePlan<'a>,
    /// Longest path, where paths are traced.
    pub max_depth: Option<u32>,
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
