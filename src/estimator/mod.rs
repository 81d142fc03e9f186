//! The seam between the harness and whatever it measures.

pub mod choice;
pub mod cpu;
pub mod integrand;
pub mod mock;
#[cfg(feature = "vulkan")]
pub mod vulkan;

use crate::error::Result;
use crate::moments::{BLOCK, BlockTree};
use crate::record::Dependence;
use crate::sampling::{Draw, Key, Sequence};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Width, height and channels of a field of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Channels per pixel.
    pub channels: usize,
}

impl Shape {
    /// Number of pixels.
    pub const fn pixels(self) -> usize {
        self.width * self.height
    }

    /// Number of values.
    pub const fn values(self) -> usize {
        self.pixels() * self.channels
    }
}

/// Largest field, in pixels: 8K UHD. Three channels of moments then take 7 GB.
pub const MOST_PIXELS: u64 = 1 << 25;

/// One replicate of one strategy: everything that its samples depend on beside the estimator itself.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Seed, role, strategy and replicate.
    pub key: Key,
    /// Samples per value of the whole run; sequences that are not progressive divide by it.
    pub length: u64,
}

/// An estimate at a checkpoint.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// One value per pixel and channel, pixel-major.
    pub field: Vec<f64>,
    /// Moments of the samples, from which the estimate can be continued; `None` for estimators without samples.
    pub moments: Option<BlockTree>,
    /// How much was spent on this estimate: samples per value, mesh elements …
    pub abscissa: u64,
    /// Seconds of sampling, all that led to this estimate, by the device's own clock where it has one.
    pub seconds: f64,
    /// Seconds that passed meanwhile, transfers and waiting included.
    pub wall_seconds: f64,
}

/// Something that estimates a field of values, better as its abscissa grows.
///
/// A complete estimator for one's own integral, here π by throwing darts, measured by the harness:
///
/// ```
/// use rootn::estimator::{Cell, Estimate, Estimator, Shape, estimate_by_samples};
/// use rootn::{record::Dependence, run, sampling::{Sequence, rng::unit_f32}};
///
/// struct Darts;
///
/// impl Estimator for Darts {
///     fn shape(&self) -> Shape { Shape { width: 16, height: 16, channels: 1 } } // 256 estimates of the same number
///     fn identity(&self) -> String { "darts 1".into() } // names what determines the samples
///     fn dependence(&self) -> Dependence { Dependence::Independent }
///     fn estimate(&self, cell: &Cell, n: u64, previous: &mut Option<Estimate>) -> rootn::Result<Estimate> {
///         Ok(estimate_by_samples(self.shape(), Sequence::Independent, cell, n, previous, |draw, out| {
///             let [x, y, ..] = draw.words(0).map(unit_f32);
///             out[0] = if x * x + y * y < 1.0 { 4.0 } else { 0.0 };
///         }))
///     }
/// }
///
/// let record = run::quick("pi", &Darts, std::f64::consts::PI, 256, 16)?;
/// let slope = record.scenes[0].strategies[0].slope.as_ref().unwrap().slope;
/// assert!((slope.estimate + 0.5).abs() < 0.05);
/// # Ok::<(), rootn::Error>(())
/// ```
pub trait Estimator: Sync {
    /// Shape of the field.
    fn shape(&self) -> Shape;

    /// Names everything that determines the samples of a cell beside the cell: two estimators with equal identity give
    /// equal samples. Results on disk are kept under its hash.
    fn identity(&self) -> String;

    /// What may be said of the samples.
    fn dependence(&self) -> Dependence;

    /// Whether the first N samples of a longer run are the run of N samples. If not, every checkpoint is a run of its own.
    fn progressive(&self) -> bool {
        true
    }

    /// What one unit of the abscissa is called in tables.
    fn abscissa(&self) -> &'static str {
        "samples"
    }

    /// Seconds of set-up that the estimator has spent, apart from sampling.
    fn setup_seconds(&self) -> f64 {
        0.0
    }

    /// Whether seconds are measured, not made up.
    fn is_timed(&self) -> bool {
        true
    }

    /// The estimate of `cell` at `checkpoint` (> 0), continuing `previous` of the same cell where given. May take what it
    /// continues; where it fails it leaves it, so that no work is lost.
    fn estimate(&self, cell: &Cell, checkpoint: u64, previous: &mut Option<Estimate>) -> Result<Estimate>;
}

impl<E: Estimator + ?Sized> Estimator for &E {
    fn shape(&self) -> Shape {
        (**self).shape()
    }
    fn identity(&self) -> String {
        (**self).identity()
    }
    fn dependence(&self) -> Dependence {
        (**self).dependence()
    }
    fn progressive(&self) -> bool {
        (**self).progressive()
    }
    fn abscissa(&self) -> &'static str {
        (**self).abscissa()
    }
    fn setup_seconds(&self) -> f64 {
        (**self).setup_seconds()
    }
    fn is_timed(&self) -> bool {
        (**self).is_timed()
    }
    fn estimate(&self, cell: &Cell, checkpoint: u64, previous: &mut Option<Estimate>) -> Result<Estimate> {
        (**self).estimate(cell, checkpoint, previous)
    }
}

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Asks for the end of sampling at the next opportunity (Ctrl-C).
pub fn interrupt() {
    INTERRUPTED.store(true, Ordering::SeqCst);
}

/// Whether [`interrupt`] was called. An estimator that would go on for long may return [`crate::Error::Interrupted`].
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// Whether a sequence's first N points are the sequence of N points.
pub fn is_progressive(sequence: Sequence) -> bool {
    matches!(sequence, Sequence::Independent | Sequence::Sobol)
}

/// The dependence class of samples drawn with a sequence.
pub fn dependence_of(sequence: Sequence) -> Dependence {
    match sequence {
        Sequence::Independent => Dependence::Independent,
        Sequence::Stratified | Sequence::LatinHypercube | Sequence::Sobol => Dependence::Dependent,
    }
}

/// Estimates by averaging samples: `sample(draw, out)` fills `out` with the channels of one sample.
pub fn estimate_by_samples(
    shape: Shape,
    sequence: Sequence,
    cell: &Cell,
    checkpoint: u64,
    previous: &mut Option<Estimate>,
    sample: impl Fn(&Draw, &mut [f64]) + Sync,
) -> Estimate {
    estimate_by_batches(shape, checkpoint, previous, |pixels, samples, out| {
        let identities = pixels.flat_map(|pixel| samples.clone().map(move |sample| (pixel, sample)));
        for ((pixel, index), out) in identities.zip(out.chunks_exact_mut(shape.channels)) {
            sample(&Draw { key: cell.key, pixel, sample: index, length: cell.length, sequence }, out);
        }
    })
}

/// Estimates by averaging samples drawn many at a time: see [`BlockTree::extend`].
pub fn estimate_by_batches(
    shape: Shape,
    checkpoint: u64,
    previous: &mut Option<Estimate>,
    draw: impl Fn(Range<u32>, Range<u64>, &mut [f64]) + Sync,
) -> Estimate {
    let (tree, spent, passed) = match previous.take() {
        Some(Estimate { moments: Some(tree), seconds, wall_seconds, .. }) => (tree, seconds, wall_seconds),
        _ => (BlockTree::new(shape.channels), 0.0, 0.0),
    };
    let start = Instant::now();
    let tree = tree.extend(shape.pixels(), checkpoint, draw);
    let elapsed = start.elapsed().as_secs_f64();
    Estimate {
        field: tree.fold_map(|m| m.mean),
        moments: Some(tree),
        abscissa: checkpoint,
        seconds: spent + elapsed,
        wall_seconds: passed + elapsed,
    }
}

const _: () = assert!(BLOCK == 64, "part of the file format and of every figure's bits");
