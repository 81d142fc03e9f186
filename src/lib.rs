//! rootn: how fast does a Monte Carlo estimator converge, is it right, and what does accuracy cost in time?
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
