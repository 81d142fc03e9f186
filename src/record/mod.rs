//! What a run leaves behind: `record.json`, from which every table, plot, page and verdict is made, and images beside it.

pub mod calibration;
pub mod image;
pub mod layers;
mod number;

use crate::error::{Error, Result};
use crate::sampling::Strategy;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the record format. A record of another version is refused.
pub const FORMAT: u32 = 3;

/// A whole run: configuration, provenance, results, verdicts, warnings.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// [`FORMAT`].
    pub format: u32,
    /// The experiment's name.
    pub name: String,
    /// The question it asks, in the author's words.
    pub question: Option<String>,
    /// The experiment file, verbatim.
    pub experiment: String,
    /// How and where it was run.
    pub provenance: Provenance,
    /// The metrics measured; the first is the headline metric, which curves, slopes and tables speak of.
    pub metrics: Vec<MetricInfo>,
    /// Results per scene.
    pub scenes: Vec<SceneResult>,
    /// Verdicts on the claims.
    pub claims: Vec<ClaimResult>,
    /// Doubts about the data, each with advice.
    pub warnings: Vec<String>,
}

/// How and where a run was made.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of rootn.
    pub version: String,
    /// Processor, operating system and architecture.
    pub machine: String,
    /// Worker threads.
    pub threads: usize,
    /// Experiment seed.
    pub seed: u64,
    /// Devices that rendered, and why they were taken; empty for integrands.
    #[serde(default)]
    pub devices: Vec<DeviceNote>,
    /// Seconds of sampling, everything together (reused cells count with the time they once took).
    pub sampling_seconds: f64,
}

/// A device and why it was taken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeviceNote {
    /// Its name.
    pub name: String,
    /// Why.
    pub reason: String,
}

/// A metric and its exact meaning.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MetricInfo {
    /// Name, for example `relMSE`.
    pub name: String,
    /// Formula with ε.
    pub formula: String,
    /// How channels enter.
    pub channels: String,
    /// Whether it is a square, so that curves show its root and slopes are those of the root.
    pub squared: bool,
    /// Unit or scale, for example "relative", "radiance", "dB".
    pub unit: String,
}

/// An estimate with a confidence interval. Bounds are absent where there is no honest one (for example n = 1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The point estimate; NaN (`null` in the file) where there is none.
    #[serde(with = "number")]
    pub estimate: f64,
    /// Lower bound.
    pub lower: Option<f64>,
    /// Upper bound.
    pub upper: Option<f64>,
    /// Confidence level of the bounds, for example 0.95.
    pub confidence: f64,
}

impl Interval {
    /// Whether a value lies between the bounds; not where one is missing.
    pub fn contains(&self, x: f64) -> bool {
        self.lower.is_some_and(|l| l <= x) && self.upper.is_some_and(|u| x <= u)
    }
}

/// Results on one scene (or integrand).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SceneResult {
    /// Name.
    pub name: String,
    /// Width, height and channels of the field.
    pub shape: [usize; 3],
    /// What one step of the abscissa is: `spp` for images, `samples` for integrals.
    pub abscissa: String,
    /// Longest path in edges, where paths are traced; `None` = unbounded or not a path tracer.
    pub max_depth: Option<u32>,
    /// What errors are measured against.
    pub reference: ReferenceResult,
    /// Errors at which cost is stated, in the root metric (0.01 = 1 %).
    pub targets: Vec<f64>,
    /// One per strategy, in the order of the file. The first is the one that others are compared with.
    pub strategies: Vec<StrategyResult>,
    /// Parts of the field that claims speak of.
    #[serde(default)]
    pub regions: Vec<RegionResult>,
}

/// Results on a part of a scene's field.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RegionResult {
    /// First column, first row, and the column and row behind the last ones.
    pub region: [u32; 4],
    /// The reference there.
    pub reference: ReferenceResult,
    /// One per strategy, as in the scene.
    pub strategies: Vec<StrategyResult>,
}

/// The reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReferenceResult {
    /// In words: how it was made.
    pub description: String,
    /// Mean value over pixels and channels.
    pub mean: f64,
    /// Standard error of that mean; 0 for exact ones.
    pub mean_std_error: f64,
    /// Degrees of freedom of that standard error; `None` where it is known.
    pub mean_degrees: Option<f64>,
    /// The reference's own mean weighted variance (of its mean), in units of the headline metric; 0 for exact ones.
    /// Already subtracted from every error; its root is the floor drawn in plots.
    pub variance: f64,
    /// Seconds of sampling it took, if it was rendered.
    pub seconds: Option<f64>,
    /// Image relative to the record's folder, if there is one.
    pub image: Option<String>,
}

/// What may be said of an estimator's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Dependence {
    /// Independent, identically distributed samples per value: s²/N is the variance of the mean.
    Independent,
    /// Samples of one value depend on one another (stratified, Latin hypercube, Sobol): variance from replicates only.
    Dependent,
    /// Values share samples (light tracing, splatting filters): run-level replicates only.
    SharedAcrossPixels,
    /// No randomness: bias alone.
    Deterministic,
}

/// Results of one strategy on one scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StrategyResult {
    /// Name.
    pub name: String,
    /// Device that ran it.
    pub device: String,
    /// Its axis values.
    pub strategy: Strategy,
    /// Hash of all that determines its samples beside seed and replicate: scene, film, depth, strategy, engine.
    pub identity: String,
    /// Dependence class of its samples.
    pub dependence: Dependence,
    /// Seconds of set-up (loading, BVH) per run.
    pub setup_seconds: f64,
    /// Seconds of sampling per sample of the whole field divided by its pixels: seconds per pixel sample, with interval over replicates.
    pub seconds_per_sample: Interval,
    /// Results at each checkpoint, ascending in `spp`.
    pub checkpoints: Vec<CheckpointResult>,
    /// Slope of log error over log N with interval; `None` with fewer than three usable checkpoints or two replicates.
    pub slope: Option<Slope>,
    /// Relative variance per sample: mean over pixels and channels of w·σ²_eff at the last checkpoint, w = 1/(r²+0.01).
    pub relative_variance: Interval,
    /// The relative variance without replicate i, for i = 0, 1, …: what jackknife intervals of ratios are made of.
    #[serde(with = "number::list")]
    pub relative_variance_without: Vec<f64>,
    /// 1/(relative variance × seconds per sample) over the same of the first strategy; `None` for the first itself.
    pub efficiency_ratio: Option<Interval>,
    /// Weighted variance over that of the first strategy at equal N.
    pub variance_ratio: Option<VarianceRatio>,
    /// Cost of the scene's targets.
    pub cost: Vec<TargetCost>,
    /// Mean over pixels and channels at the last checkpoint, per replicate.
    #[serde(with = "number::list")]
    pub means: Vec<f64>,
    /// N·variance of the replicates' means over the samples' own variance, weighted like the relative variance: 1 for
    /// independent samples, far below it where their arrangement helps. `None` for estimators without samples.
    pub dispersion: Option<Jackknifed>,
    /// Largest deviation of any value from the reference in any replicate at the last checkpoint, over the mean of the
    /// reference's magnitude (or absolute where that is 0).
    #[serde(with = "number")]
    pub largest_deviation: f64,
    /// What the samples say about how far figures on variance can be trusted; `None` for estimators without samples.
    pub health: Option<Health>,
    /// Running means of the probe pixels.
    pub probes: Vec<ProbeResult>,
    /// Non-finite samples: the count over all replicates and where the first ones lie.
    pub non_finite: NonFinite,
    /// Final image over all replicates (layers: see [`image`]), relative to the record's folder; absent for non-images.
    pub image: Option<String>,
}

impl StrategyResult {
    /// The relative variance per sample as a statistic over replicates.
    pub(crate) fn variance_statistic(&self) -> Jackknifed {
        Jackknifed { all: self.relative_variance.estimate, without: self.relative_variance_without.clone() }
    }
}

/// A statistic over replicates with its leave-one-out values, from which intervals are made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jackknifed {
    /// On all replicates.
    #[serde(with = "number")]
    pub all: f64,
    /// Without replicate i, for i = 0, 1, …
    #[serde(with = "number::list")]
    pub without: Vec<f64>,
}

impl Jackknifed {
    /// A function of the statistic.
    #[must_use]
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self { all: f(self.all), without: self.without.iter().map(|&x| f(x)).collect() }
    }
}

/// Checks in the manner of MCNP and Geant4 (G4ConvergenceTester) at the last checkpoint, over all replicates. Samples are
/// weighted like the relative variance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// Variance of the variance: squared relative standard error of the weighted variance, by the samples' fourth moments.
    pub variance_of_variance: f64,
    /// Shape k of the generalised Pareto distribution that the largest samples follow, and its standard error: moments
    /// above the (1/k)-th are infinite. Fitted to the largest sample of every value and replicate, over that value's
    /// standard deviation; `None` where those are too few.
    pub tail_index: Option<[f64; 2]>,
    /// Share of the weighted sum of squared deviations that the largest sample has.
    pub largest_share: f64,
    /// The same share of the 0.1 % of all values and replicates that have most of it.
    pub top_share: f64,
    /// Slope of log(1/(error² × seconds)) over log N in the second half of the curve: about 0 for independent samples,
    /// below 0 where error or cost grow out of proportion.
    pub drift: Option<Interval>,
    /// Fraction of samples that are exactly 0.
    pub zero_fraction: f64,
    /// The samples that have most of the variance.
    pub largest: Vec<LargestSample>,
}

/// A sample that stands out. `rootn replay` explains it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LargestSample {
    /// Replicate.
    pub replicate: u32,
    /// Pixel column and row.
    pub pixel: [u32; 2],
    /// Channel.
    pub channel: u32,
    /// Index of the sample.
    pub sample: u64,
    /// Its value.
    pub value: f64,
    /// Its share of the weighted sum of squared deviations.
    pub share: f64,
}

/// Where non-finite samples were met. They are kept out of the mean and make the run unhealthy.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NonFinite {
    /// How many, over all replicates.
    pub count: u64,
    /// (replicate, pixel index, sample index) of at most the first sixteen.
    pub first: Vec<(u32, u32, u64)>,
}

/// A fitted order of convergence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slope {
    /// d log(error) / d log(N); −0.5 for independent samples of finite variance.
    pub slope: Interval,
    /// The jackknife's pseudo-values, one per replicate: their mean is the slope.
    pub values: Vec<f64>,
    /// Smallest N of the fit.
    pub from: u64,
    /// Largest N of the fit.
    pub to: u64,
}

/// Results at one checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CheckpointResult {
    /// Samples per value.
    pub spp: u64,
    /// Seconds of sampling up to here, by the device's own clock where it has one; one entry per replicate.
    pub seconds: Vec<f64>,
    /// Seconds that passed meanwhile, transfers and waiting included; one entry per replicate.
    #[serde(default)]
    pub wall_seconds: Vec<f64>,
    /// One per metric of the record, in that order.
    pub metrics: Vec<MetricResult>,
    /// What σ/√N predicts for the headline metric (not its root), from the samples' own variance; only for independent samples.
    pub predicted: Option<f64>,
    /// Set where the reference is too noisy to judge this error: such points are not plotted.
    pub refused: Option<String>,
}

/// A metric at a checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MetricResult {
    /// One value per replicate, corrected for the reference's variance where the metric is a square (can be negative then).
    #[serde(with = "number::list")]
    pub values: Vec<f64>,
    /// Mean over replicates with a 95 % interval.
    pub mean: Interval,
    /// The same mean without the 0.1 % largest terms of each replicate; beside, never instead. `None` where it is not
    /// finite.
    pub trimmed: Option<f64>,
}

/// Ratio of weighted variances, with the spread of the per-pixel ratio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VarianceRatio {
    /// The ratio of image-level weighted variances.
    pub ratio: Interval,
    /// Quantiles 5, 25, 50, 75, 95 % of the per-pixel ratio (pixels where both variances are positive).
    pub quantiles: Option<[f64; 5]>,
}

/// What an error costs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TargetCost {
    /// The error wanted, in the root metric.
    pub target: f64,
    /// Samples per pixel that reach it.
    pub spp: f64,
    /// Seconds of sampling that reach it; `None` where extrapolation has no basis.
    pub seconds: Option<Interval>,
    /// Whether the figure lies beyond the largest N measured.
    pub extrapolated: bool,
    /// What one more run will need.
    pub forecast: Option<Forecast>,
}

/// Prediction for one more run of a strategy, at the same wanted error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Samples per value, with prediction interval.
    pub spp: Interval,
    /// Seconds of sampling, with prediction interval; noise of the clock included.
    pub seconds: Interval,
    /// By what factor N grows for each halving of the error.
    pub halving: f64,
}

/// Running mean of one pixel (mean over channels).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ProbeResult {
    /// Pixel column and row.
    pub pixel: [u32; 2],
    /// The reference's value.
    pub reference: f64,
    /// (spp, mean over replicates, lower, upper): 95 % interval over replicates.
    pub points: Vec<(u64, f64, f64, f64)>,
}

/// Three-valued answer to a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The whole interval satisfies the claim.
    Supported,
    /// The whole interval violates it.
    Refuted,
    /// The interval straddles the threshold.
    Inconclusive,
}

/// A claim, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClaimResult {
    /// The author's words.
    pub text: String,
    /// Kind of claim, as in experiment files.
    pub kind: String,
    /// Scene it was judged on.
    pub scene: String,
    /// Replicates that it was judged on.
    pub replicates: u32,
    /// The measured quantity.
    pub interval: Interval,
    /// The answer.
    pub verdict: Verdict,
    /// The answer as one sentence with figures.
    pub sentence: String,
    /// How far beyond its threshold the quantity would have been seen with probability 0.9: as a factor for ratios, else as
    /// a difference.
    pub detectable: Option<f64>,
    /// Where the verdict is inconclusive: why, and what would decide.
    pub open: Option<String>,
    /// Whether it is inconclusive because the interval itself is not to be trusted.
    pub doubtful: bool,
}

impl Record {
    /// Reads `record.json` from a folder.
    pub fn load(folder: &Path) -> Result<Self> {
        let path = folder.join("record.json");
        let text = std::fs::read_to_string(&path).map_err(|e| Error::io(&path, e))?;
        let record: Self =
            serde_json::from_str(&text).map_err(|e| Error::damaged(&path, format!("not a record: {e}")))?;
        if record.format != FORMAT {
            return Err(Error::damaged(&path, format!("record format {}; this version reads {FORMAT}", record.format)));
        }
        Ok(record)
    }

    /// Writes `record.json` into a folder, atomically.
    pub fn save(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).expect("plain data");
        write_atomically(&folder.join("record.json"), text.as_bytes())
    }
}

/// Writes a file so that it is either absent, old or complete, whatever happens in between, loss of power included.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, &[bytes], true)
}

/// The same without waiting for the disk: loss of power may leave the file damaged. For files that carry a checksum or
/// can be made again.
pub fn write_quickly(path: &Path, parts: &[&[u8]]) -> Result<()> {
    replace(path, parts, false)
}

/// Writes beside the file, then renames.
fn replace(path: &Path, parts: &[&[u8]], sync: bool) -> Result<()> {
    use std::io::Write;
    let folder = path.parent().unwrap_or(Path::new("."));
    let write = || {
        std::fs::create_dir_all(folder)?;
        let mut builder = tempfile::Builder::new();
        // Readable as any other file, as far as the user's mask allows; temporary files are private by default.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut file = builder.tempfile_in(folder)?;
        for part in parts {
            file.write_all(part)?;
        }
        if sync {
            file.as_file().sync_data()?;
        }
        file.persist(path).map_err(|e| e.error)?;
        Ok(())
    };
    write().map_err(|e| Error::io(path, e))
}
