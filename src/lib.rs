//! rootn: how fast does a Monte Carlo estimator converge, is it right, and what does accuracy cost in time?
//!
//! How data flow through the modules:
//!
//! 1. [`experiment`] reads a TOML file and turns it into a [`run::Plan`]: scenes read by [`scene::format`] and checked,
//!    [`accel`] structures built over them, and on each scene one [`estimator`] per strategy ([`sampling::strategy`]).
//! 2. [`run`] walks the plan. It knows nothing of rendering, only [`estimator::Estimator`]: for each strategy and replicate
//!    it asks for the estimate at ascending numbers of samples. The path tracer among the estimators draws random numbers
//!    from [`sampling`], traces paths in [`transport`] and sums them up in [`moments`], which are also what is kept on disk
//!    ([`moments::cell`]). On GPUs all of this is done by its twins in `shaders/`, which `estimator::vulkan` runs.
//! 3. [`analysis`] applies [`stats`] to the estimates: error curves, slopes, variances, efficiencies, costs, with intervals
//!    over replicates. [`claim`] turns them into verdicts.
//!    [`run::calibrate`] repeats a plan whose truth is known, and counts how often they are right.
//! 4. All of it is one [`record`], and of that alone, with its images, [`report`] makes tables, plots and pages.
//!
//! [`cli`] has one file per command; [`math`] and [`error`] serve all.

pub mod accel;
pub mod analysis;
pub mod claim;
pub mod cli;
pub mod error;
pub mod estimator;
pub mod experiment;
pub mod math;
pub mod moments;
pub mod record;
pub mod report;
pub mod run;
pub mod sampling;
pub mod scene;
pub mod stats;
pub mod transport;

pub use error::{Error, Result};
